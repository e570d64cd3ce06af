"""Which quantity may depend on what: the pairs that a catalogue of effects would list, and those that it would not."""

from dataclasses import dataclass
from typing import Literal

Law = Literal["ratio", "exponent", "difference", "size", "friction", "current", "past current", "plays", "sensor lag"]


@dataclass(frozen=True)
class Dependence:
    """A `quantity` of the equations that changes with an `abscissa`, and the `pair` of words for it.

    `law` is how it changes: by a "ratio" or its "exponent", by a "difference", by a "size" that is not negative, by a
    "friction" against a force, as the "current" of a valve or by its "past current" or its "plays", or by a "sensor
    lag". `block` is the part of the bench in which it acts.
    """

    pair: tuple[str, str]
    block: Literal["pressure", "torque", "output speed", "input speed"]
    quantity: str
    abscissa: str
    law: Law


WORDS = {
    "motor_speed": "motor speed", "sequence": "run order", "current": "current", "pressure": "pressure",
    "input_speed": "input speed", "output_speed": "output speed", "slip": "slip", "energy": "heat",
    "contact_time": "time in contact", "time": "time", "piston": "piston position",
    "output_position": "output position", "oil_temperature": "oil temperature",
}
"""Abscissas on which any quantity may depend, and their words."""
CONSTANT_IN_A_RUN = ("motor_speed", "sequence", "oil_temperature")
SENSOR_BLOCKS = {"pressure": "pressure", "input_speed": "input speed", "output_speed": "output speed",
                 "output_torque": "torque"}


def _list_known() -> list[Dependence]:
    """What a catalogue of such a clutch would list."""
    listed = [
        Dependence(("line pressure", "motor speed"), "pressure", "pressure_gain", "motor_speed", "ratio"),
        Dependence(("valve current", "current"), "pressure", "valve_current", "current", "current"),
        Dependence(("valve current", "past current"), "pressure", "valve_current", "current_excess", "past current"),
        Dependence(("valve current", "past current"), "pressure", "valve_plays", "sequence", "plays"),
        Dependence(("chamber pressure", "input speed"), "torque", "chamber_pressure", "input_speed", "difference"),
        Dependence(("piston gain", "run order"), "torque", "oil_temperature_gain", "sequence", "ratio"),
        Dependence(("clearance", "run order"), "torque", "clearance", "sequence", "ratio"),
        Dependence(("clearance", "pressure"), "torque", "clearance", "pressure", "ratio"),
        Dependence(("piston rate", "pressure"), "torque", "piston_feed", "pressure", "size"),
        Dependence(("piston rate", "piston rate"), "torque", "piston_rate", "free_piston_rate", "ratio"),
        Dependence(("piston rate", "piston position"), "torque", "net_pressure", "piston", "difference"),
        Dependence(("piston rate", "piston position"), "torque", "spring_rate", "piston", "ratio"),
        Dependence(("piston rate", "direction"), "torque", "net_pressure", "driving_pressure", "friction"),
        Dependence(("friction coefficient", "slip"), "torque", "friction_coefficient", "slip", "ratio"),
        Dependence(("friction coefficient", "pressure"), "torque", "friction_coefficient", "contact_pressure",
                   "ratio"),
        Dependence(("friction coefficient", "heat"), "torque", "friction_coefficient", "energy", "ratio"),
        Dependence(("friction coefficient", "lag"), "torque", "friction_lag", "contact_pressure", "size"),
        Dependence(("film torque", "run order"), "torque", "film_coefficient", "sequence", "exponent"),
        Dependence(("stick torque", "twist"), "torque", "shaft_compliance", "twist", "size"),
        Dependence(("converter torque", "lag"), "input speed", "converter_lag", "motor_speed", "size"),
        Dependence(("load torque", "output speed"), "output speed", "load_torque", "output_speed", "difference"),
        Dependence(("load torque", "output speed"), "output speed", "brake_torque", "output_speed", "ratio"),
    ]
    for signal, block in SENSOR_BLOCKS.items():
        sensor = f"{signal.replace('_', ' ')} sensor"
        listed += [Dependence((sensor, "lag"), block, f"{signal}_sensor_lag", "sequence", "sensor lag"),
                   Dependence((sensor, "offset"), block, f"{signal}_sensor", "sequence", "difference"),
                   Dependence((sensor, "offset"), block, f"{signal}_sensor", "time", "difference"),
                   Dependence((sensor, "gain"), block, f"{signal}_sensor", signal, "difference")]
    return listed


_QUANTITIES = {  # words, block, law, and the abscissas on which it does not depend or that other parameters make up for
    "pressure_gain": ("line pressure", "pressure", "ratio", ("current", "pressure")),
    "valve_delay": ("valve delay", "pressure", "ratio", ("current", "pressure")),
    "chamber_pressure": ("chamber pressure", "torque", "difference", ("pressure",)),
    "oil_temperature_gain": ("piston gain", "torque", "ratio", ("piston", "pressure")),
    "clearance": ("clearance", "torque", "ratio", ("piston",)),
    "net_pressure": ("piston rate", "torque", "difference", ("pressure",)),
    "contact_pressure": ("friction coefficient", "torque", "ratio", ("piston",)),
    "friction_coefficient": ("friction coefficient", "torque", "ratio", ("piston",)),
    "film_coefficient": ("film torque", "torque", "exponent", ("contact_time", "energy")),
    "load_torque": ("load torque", "output speed", "difference", ()),
    "brake_torque": ("load torque", "output speed", "ratio", ()),
    "converter_torque": ("converter torque", "input speed", "ratio", ("input_speed",)),
    "input_drag": ("input torque", "input speed", "difference", ()),
    **{f"{signal}_sensor": (f"{signal.replace('_', ' ')} sensor", block, "difference", (signal, "time", "sequence"))
       for signal, block in SENSOR_BLOCKS.items()},
}
KNOWN: tuple[Dependence, ...] = tuple(_list_known())
"""Dependences that a catalogue would list."""
KNOWN_PAIRS = frozenset(dependence.pair for dependence in KNOWN)
UNKNOWN: tuple[Dependence, ...] = tuple(
    Dependence((words, on), block, quantity, abscissa, law)
    for quantity, (words, block, law, left_out) in _QUANTITIES.items() for abscissa, on in WORDS.items()
    if abscissa not in (*left_out, "oil_temperature") and (words, on) not in KNOWN_PAIRS)
"""Dependences that no catalogue would list."""
OVER_TEMPERATURE: tuple[Dependence, ...] = tuple(
    Dependence((words, "oil temperature"), block, quantity, "oil_temperature", law)
    for quantity, (words, block, law, _) in _QUANTITIES.items() if quantity != "net_pressure")
"""Dependences on the oil temperature, which is then a further channel of the recordings."""
