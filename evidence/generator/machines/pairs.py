"""The words of hidden effects: which quantity of a machine may depend on what, and which of these are alike."""

from collections.abc import Mapping

Pair = tuple[str, str]


def _list(text: str) -> tuple[Pair, ...]:
    """Return the pairs of lines "quantity: word, word"."""
    lines = (line.split(":") for line in text.strip().splitlines())
    return tuple((quantity.strip(), on.strip()) for quantity, words in lines for on in words.split(","))


PAIRS: Mapping[str, tuple[Pair, ...]] = {
    "two tanks": _list("""
        voltage: voltage, past voltage, time
        pump flow: voltage, past voltage, time, run order, temperature, level 1
        outflow 1: level 1, level 2, time, run order, temperature
        outflow 2: level 2, time, run order, temperature
        overflow: level 1, level 2, run order
        leak 1: level 1, time, run order
        leak 2: level 2, time, temperature
        level 1 sensor: gain, lag, run order, time, offset, level 2
        level 2 sensor: gain, lag, run order, time, offset, level 1"""),
    "dc motor": _list("""
        voltage: voltage, past voltage, current, time
        resistance: winding temperature, time, current, past voltage, run order
        torque constant: current, winding temperature, position, time
        inertia: position, run order
        brush voltage: current, speed, winding temperature
        viscous friction: winding temperature, time, run order
        dry friction: speed, position, load torque, run order, winding temperature, time
        friction torque: speed, position, time
        current sensor: gain, lag, run order, time, offset, speed
        speed sensor: gain, lag, run order, time, offset, current"""),
}
"""Pairs (quantity, depends on) of each machine from which effects are drawn."""
ABSCISSAS: Mapping[str, tuple[str, ...]] = {
    "two tanks": ("time", "run order", "temperature", "voltage", "past voltage", "level 1", "level 2"),
    "dc motor": ("time", "run order", "winding temperature", "voltage", "past voltage", "current", "speed", "position",
                 "load torque"),
}
"""What a quantity of each machine may depend on."""


def _list_equal() -> dict[str, tuple[tuple[Pair, ...], ...]]:
    equal: dict[str, list[tuple[Pair, ...]]] = {machine: [] for machine in PAIRS}
    for on in ABSCISSAS["two tanks"]:  # a leak of the first tank is pump gain times a voltage
        also = (("pump flow", on),) if on in ("voltage", "past voltage") else ()
        equal["two tanks"].append((("voltage", on), ("leak 1", on), *also))
    equal["two tanks"].append((("leak 2", "level 2"), ("outflow 2", "level 2")))
    for on in ABSCISSAS["dc motor"]:  # the brushes take voltage away; as a resistance does that depends on the current
        also = (("resistance", on),) if on == "current" else ()
        equal["dc motor"].append((("voltage", on), ("brush voltage", on), *also))
    equal["dc motor"].append(tuple((quantity, "speed") for quantity in (
        "viscous friction", "dry friction", "friction torque")))
    for machine, signals in (("two tanks", ("level 1", "level 2")), ("dc motor", ("current", "speed"))):
        equal[machine] += [((f"{signal} sensor", "gain"), (f"{signal} sensor", signal)) for signal in signals]
    return {machine: tuple(groups) for machine, groups in equal.items()}


EQUAL_PAIRS: Mapping[str, tuple[tuple[Pair, ...], ...]] = _list_equal()
"""Groups of pairs of each machine that no recording can tell apart."""
WIDER_PAIRS: Mapping[str, Mapping[Pair, tuple[Pair, ...]]] = {
    "two tanks": {("overflow", "level 1"): (("outflow 1", "level 1"),)},
    "dc motor": {},
}
"""Pairs whose every law is also a law of other pairs, which have further laws: those of the weir act above the brim."""


def accept_pairs(machine: str, pair: Pair) -> set[Pair]:
    """Return the pairs that are right names of a hidden effect of a machine."""
    groups = [group for group in EQUAL_PAIRS[machine] if pair in group]
    return {pair, *(other for group in groups for other in group), *WIDER_PAIRS[machine].get(pair, ())}
