"""Candidates: which quantities may depend on what, and the variables of these laws."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipstick.engine.bases import OUTERMOST, Variable, curve, lags, own_variable, past
from slipstick.engine.recordings import Pair, Part, Recorded
from slipstick.machine.declaration import SENSOR, Quantity, identifier_of

PAST, LAG, GAIN, CONSTANT = "past ", "lag", "gain", "offset"
CURVE = "curve over "
FINER = 3
"""Knots of a curve for each declared one: between these, a smooth curve is off its lines by 2 % of its deviation."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A law of a `quantity`, in units of `size`, over the variable `on`, with `knots` as all parts have it.

    `variables` are those of the parts on which it acts, by their name.
    """

    pair: Pair
    quantity: Quantity
    size: float
    variables: dict[str, Variable]

    @property
    def count(self) -> int:
        """Number of coefficients."""
        return len(self.variable.knots)

    @property
    def variable(self) -> Variable:
        """The variable of the first part."""
        return next(iter(self.variables.values()))

    def coarse(self) -> "Candidate":
        """Return the candidate with few coefficients."""
        return replace(self, variables={name: variable.coarse() for name, variable in self.variables.items()})

    def with_knots(self, law: "Candidate") -> "Candidate":
        """Return the candidate with the knots of a law of the same pair."""
        first = law.variable
        return replace(self, variables={name: replace(variable, knots=first.knots, jumps=first.jumps)
                                        for name, variable in self.variables.items()})

    def renew(self, recorded: Recorded) -> "Candidate":
        """Return the candidate over signals as they are explained now."""
        def read(variable: Variable, part: Part) -> Variable:
            is_within = variable.values is not None and variable.values.ndim == 2
            return replace(variable, values=recorded.fine(variable.name, part)) if is_within else variable

        return replace(self, variables={part.name: read(self.variables[part.name], part) for part in recorded.parts
                                        if part.name in self.variables})

    def take(self, rows: slice | np.ndarray) -> "Candidate":
        """Return the candidate for the runs `rows`."""
        return take_all([self], rows)[0]


def take_all(candidates: Sequence[Candidate], rows: slice | np.ndarray) -> list[Candidate]:
    """Return candidates for the runs `rows`, which share values as before: these are then sent elsewhere once."""
    values = {id(variable.values): variable.values[rows] for candidate in candidates
              for variable in candidate.variables.values() if variable.values is not None}
    return [replace(candidate, variables={
        name: variable if variable.values is None else replace(variable, values=values[id(variable.values)])
        for name, variable in candidate.variables.items()}) for candidate in candidates]


def list_candidates(recorded: Recorded, own: dict[str, dict[str, np.ndarray]]) -> list[Candidate]:
    """Return all candidates of a machine: every quantity over everything, and every sensor's errors.

    `own` are the values (n, K) of the own variables of each part, from a fit.
    """
    return [candidate for quantity in recorded.machine.quantities
            for candidate in _list_of(recorded, quantity, own)]


def _list_of(recorded: Recorded, quantity: Quantity, own: dict[str, dict[str, np.ndarray]]) -> list[Candidate]:
    parts = [part for part in recorded.parts if acts(quantity, part)]
    if not parts:
        return []
    signal = quantity.name.removesuffix(SENSOR) if quantity.name.endswith(SENSOR) else None
    names = dict.fromkeys((*(name for part in parts for name in own[part.name]), *recorded.signals))

    def may(name: str) -> bool:
        return name not in quantity.without and (quantity.over is None or name in quantity.over)

    # What the model explains as the same value at all times is none of the signals on which laws depend.
    size = quantity.size if signal is None else float(
        np.abs(recorded.signals.get(signal, recorded.runs.signals[signal])).max())
    listed = [_over(recorded, quantity, size, name, parts, own) for name in names if may(name)]
    known = [each for each in listed if each is not None]
    constant = Variable(CONSTANT, "", "between", np.zeros(1), np.zeros(len(recorded)))
    if may(CONSTANT):
        known.append(Candidate((quantity.name, CONSTANT), quantity, size, {part.name: constant for part in parts}))
    if signal is None:
        inputs = dict.fromkeys(name for part in parts for name in part.block.reads
                               if name in recorded.signals and recorded.signals[name].ndim == 2)
        pasts = [_past(recorded, quantity, size, name, parts) for name in inputs if may(PAST + name)]
        return [*known, *(each for each in pasts if each is not None)]
    if signal not in recorded.signals:
        return known
    known = [each if each.pair[1] != signal else replace(each, pair=(quantity.name, GAIN)) for each in known]
    span = float(np.ptp(recorded.signals[signal]))
    own_signal = {part.name: lags(signal, None if signal in part.signals else recorded.fine(signal, part), part.fine,
                                  span) for part in parts}
    return [*known, *([Candidate((quantity.name, LAG), quantity, 1.0, own_signal)] if may(LAG) else [])]


def acts(quantity: Quantity, part: Part) -> bool:
    """Whether a quantity acts in a part: in its equations, or as an error of a sensor that it gives or reads."""
    if quantity.name.endswith(SENSOR):
        signal = quantity.name.removesuffix(SENSOR)
        return signal in part.signals or signal in part.block.reads
    return quantity in part.block.quantities


def _over(recorded: Recorded, quantity: Quantity, size: float, name: str, parts: list[Part],
          own: dict[str, dict[str, np.ndarray]]) -> Candidate | None:
    """Return the candidate over a variable, which is own in some parts and known in others; None where neither."""
    unit, variables = recorded.units.get(name, ""), dict[str, Variable]()
    signal = quantity.name.removesuffix(SENSOR)  # a sensor of what a part gives reads it when the equations are solved

    def is_own(part: Part) -> bool:
        is_read_after = signal in part.signals and signal not in part.drawn
        return name in own[part.name] and (is_read_after or name in part.system.own)

    for part in sorted(parts, key=lambda part: not is_own(part)):
        if is_own(part):
            values = own[part.name][name]
            if not np.ptp(values) > 0:
                return None
            variable = own_variable(name, unit, values, name in part.block.switches)
        elif name in recorded.signals:
            # The lines that are closest to a command go beyond it beside its jumps.
            like = recorded.signals[name] if name in recorded.runs.commands else None
            variable = curve(name, unit, recorded.fine(name, part), like)
        else:
            return None
        for first in variables.values():
            variable = replace(variable, knots=first.knots, jumps=first.jumps)
        variables[part.name] = variable
    return Candidate((quantity.name, name), quantity, size, {part.name: variables[part.name] for part in parts})


def _past(recorded: Recorded, quantity: Quantity, size: float, name: str, parts: list[Part]) -> Candidate | None:
    reading = [part for part in parts if identifier_of(name) in part.inputs]
    if len(reading) < len(parts):
        return None
    variables = {part.name: past(name, recorded.units.get(name, ""), part.inputs[identifier_of(name)], part.fine)
                 for part in reading}
    scale = float(np.ptp(recorded.signals[name]))
    return Candidate((quantity.name, PAST + name), quantity, size / scale if scale > 0 else size, variables)


def list_curves(recorded: Recorded,
                own: dict[str, dict[str, np.ndarray]]) -> dict[Pair, tuple[Candidate, float]]:
    """Return the laws of curves that are not known exactly, with their standard deviations."""
    listed = {}
    for part in recorded.parts:
        for declared in part.block.curves:
            values = own[part.name][declared.over]
            low, high = (float(end) for end in np.quantile(values, [OUTERMOST, 1 - OUTERMOST]))
            knots = np.linspace(low, high, FINER * (declared.knots - 1) + 1)
            variable = Variable(declared.over, "", "own", knots)
            pair = declared.quantity, CURVE + declared.over
            candidate = Candidate(pair, recorded.machine.quantity(declared.quantity), 1.0, {part.name: variable})
            listed[pair] = candidate, declared.within
    return listed
