"""The equations of a system on a grid of instants, with laws inside, and a step of them that meets surfaces."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from slipstick.machine.declaration import Namespace, as_tuple
from slipstick.machine.system import States, System, Values

EDGE = 1e-9
"""Distance from 0 of the two knots between which a law over a switching state jumps, over the range of the law."""


@dataclass(frozen=True, eq=False)
class OwnLaw:
    """A change of a quantity or of an input over the own `variable` of a system: linear between `values` at `knots`
    (m,).

    Over a switching state, `place` is that of the state, and the law may jump at 0.
    """

    kind: Literal["quantity", "input"]
    name: str
    variable: str
    knots: np.ndarray
    values: np.ndarray
    place: int | None = None

    def at(self, x: np.ndarray, side: np.ndarray | None) -> np.ndarray:
        """Return the law at x, on the `side` (-1 to 1) of a jump."""
        beside = x if side is None else beside_jump(x, side, self.knots)
        return np.asarray(np.interp(beside, self.knots, self.values))


def beside_jump(x: np.ndarray, side: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Return x moved to its side of 0, by which a law with a jump is read: at rest, to its share within the jump."""
    edge = EDGE * (knots[-1] - knots[0])
    return np.asarray(np.where(side >= 1, np.maximum(x, edge), np.where(side <= -1, np.minimum(x, -edge), side * edge)))


@dataclass(frozen=True, eq=False)
class Problem:
    """A `system` on K instants with steps `h` in s, scalar or (K - 1,), for n runs.

    `inputs` and `quantities` are (n, K), or scalars; `parameters` (n, 1). Quantities also change by `laws` over own
    variables.
    """

    system: System
    h: Any
    inputs: Values
    quantities: Values
    parameters: Values
    laws: tuple[OwnLaw, ...] = ()

    @cached_property
    def shape(self) -> tuple[int, int]:
        """Numbers of runs and of instants."""
        return np.broadcast_shapes(*(np.shape(value) for value in (*self.inputs.values(), *self.parameters.values(),
                                                                   *self.quantities.values())))


def cut(values: Values, instants: slice) -> dict[str, Any]:
    """Return values at some instants; what is constant in a run stays."""
    return {name: value[:, instants] if np.ndim(value) == 2 and value.shape[1] > 1 else value
            for name, value in values.items()}


def refine(values: np.ndarray, fine: int) -> np.ndarray:
    """Return signals (n, k) at `fine` times as many instants, linear between samples."""
    if fine == 1:
        return values
    instants = np.arange(fine * (values.shape[1] - 1) + 1) / fine
    low = np.minimum(instants.astype(int), values.shape[1] - 2)
    return np.asarray(values[:, low] + (instants - low) * (values[:, low + 1] - values[:, low]))


def ends(values: Values) -> tuple[Values, Values]:
    """Return values at the begins and at the ends of all steps."""
    return cut(values, slice(None, -1)), cut(values, slice(1, None))


def _is_across(x: np.ndarray, side: np.ndarray) -> np.ndarray:
    """Whether states that do not rest at the begin of a step are on the other side behind it."""
    return np.asarray((np.abs(side) == 1) & (x * side < 0))


def halve(first: Values, second: Values) -> dict[str, Any]:
    """Return values half way between those at the begins and at the ends of steps."""
    return {name: 0.5 * (value + second[name]) for name, value in first.items()}


class Equations:
    """The equations of a system with laws inside, as functions of dictionaries."""

    def __init__(self, system: System, laws: Sequence[OwnLaw]) -> None:
        self.system, self.laws = system, laws

    def _changed(self, x: Namespace, u: Values, q: Values, p: Namespace) -> tuple[Namespace, Namespace]:
        """Return the inputs and the quantities with the laws."""
        inputs, quantities = Namespace(**u), Namespace(**q)
        if not self.laws:
            return inputs, quantities
        changed = {"input": dict(u), "quantity": dict(q)}
        for law in self.laws:
            side = None if law.place is None else getattr(x, self.system.states[law.place] + "_side")
            by = law.at(self.system.own[law.variable](x, inputs, p), side)
            changed[law.kind][law.name] = changed[law.kind][law.name] + by
        return Namespace(**changed["input"]), Namespace(**changed["quantity"])

    def rates(self, x: States, u: Values, q: Values, p: Namespace, sides: Mapping[int, np.ndarray]) -> States:
        """Return the rates of the states, on the `sides` of their surfaces: 0 of a state that rests between both."""
        named = self.system.name(x, sides)
        rates = as_tuple(self.system.rate(named, *self._changed(named, u, q, p), p))
        if not sides:
            return rates
        return tuple(np.where(np.abs(sides[place]) < 1, 0.0, rate) if place in sides else rate
                     for place, rate in enumerate(rates))

    def sides(self, x: States, u: Values, q: Values, p: Namespace) -> dict[int, np.ndarray]:
        """Return the side of each switching state: at 0 that to which its rate leads, or where it rests, a share.

        The share, between -1 and 1, is that at which the rate is 0 (the equivalent control: Utkin, Sliding Modes in
        Control and Optimization, 1992): what else depends on the side, such as the force between bodies that stick, is
        then as if the state moved to both sides in turn.
        """
        return self._settle({place: np.sign(x[place]) for place in self.system.switches}, x, u, q, p)

    def _settle(self, before: Mapping[int, np.ndarray], x: States, u: Values, q: Values,
                p: Namespace) -> dict[int, np.ndarray]:
        """Return the sides where those of states that rested `before` are found anew."""
        sides = dict(before)
        for place in self.system.switches:
            is_free = np.abs(sides[place]) < 1
            if not is_free.any():
                continue
            up, down = (self.rates(x, u, q, p, {**sides, place: np.full(x[place].shape, side)})[place]
                        for side in (1.0, -1.0))
            with np.errstate(invalid="ignore", divide="ignore"):
                share = np.where(down > up, (up + down) / (down - up), 0.0)
            leads = np.where(up > 0, 1.0, np.where(down < 0, -1.0, share))
            sides[place] = np.where(is_free, np.where(x[place] == 0, leads, np.sign(x[place])), sides[place])
        return sides

    def advance(self, x: States, u: tuple[Values, Values], q: tuple[Values, Values], p: Namespace, h: Any) -> States:
        """Return the states a step later. A state that meets its surface goes on from there, or rests."""
        if not self.system.switches:
            return self._step(x, u, q, p, h, {})
        sides = self.sides(x, u[0], q[0], p)
        following = self._step(x, u, q, p, h, sides)
        for place in self.system.switches:
            meets = _is_across(following[place], sides[place])
            if meets.any():
                following = self._meet(place, meets, x, following, u, q, p, h, sides)
        return following

    def _step(self, x: States, u: tuple[Values, Values], q: tuple[Values, Values], p: Namespace, h: Any,
              sides: Mapping[int, np.ndarray]) -> States:
        """Return the states after a Runge-Kutta step on these sides of their surfaces."""
        u_middle, q_middle = halve(*u), halve(*q)

        def moved(by: Any, rates: Sequence[np.ndarray]) -> States:
            return self._bound([state + by * rate for state, rate in zip(x, rates, strict=True)])

        def rates_of(x: States, u: Values, q: Values) -> States:
            return self.rates(x, u, q, p, self._settle(sides, x, u, q, p))

        a = rates_of(x, u[0], q[0])
        b = rates_of(moved(0.5 * h, a), u_middle, q_middle)
        c = rates_of(moved(0.5 * h, b), u_middle, q_middle)
        d = rates_of(moved(h, c), u[1], q[1])
        return moved(h / 6, [k1 + 2 * (k2 + k3) + k4 for k1, k2, k3, k4 in zip(a, b, c, d, strict=True)])

    def _bound(self, x: Sequence[np.ndarray]) -> States:
        return tuple(np.maximum(state, low) if low > -np.inf else state
                     for state, low in zip(x, self.system.lowest or (-np.inf,) * len(x), strict=True))

    def _meet(self, place: int, meets: np.ndarray, x: States, following: States, u: tuple[Values, Values],
              q: tuple[Values, Values], p: Namespace, h: Any, sides: Mapping[int, np.ndarray]) -> States:
        """Return the states a step later where one `meets` its surface within the step."""
        def chosen(values: Values) -> dict[str, Any]:
            return {name: np.broadcast_to(value, meets.shape)[meets] if np.ndim(value) else value
                    for name, value in values.items()}

        def between(pair: tuple[Values, Values]) -> tuple[Values, Values, Values]:
            first, last = chosen(pair[0]), chosen(pair[1])
            return first, {name: value + share * (last[name] - value) for name, value in first.items()}, last

        before = tuple(np.broadcast_to(state, meets.shape)[meets] for state in x)
        p, h = Namespace(**chosen(vars(p))), np.broadcast_to(h, meets.shape)[meets]
        share = before[place] / (before[place] - following[place][meets])  # of the step, as if the state were linear
        u_first, u_there, u_last = between(u)
        q_first, q_there, q_last = between(q)
        own = {other: side[meets] for other, side in sides.items()}
        there = list(self._step(before, (u_first, u_there), (q_first, q_there), p, share * h, own))
        there[place] = np.zeros_like(there[place])
        on = self.sides(tuple(there), u_there, q_there, p)
        after = list(self._step(tuple(there), (u_there, u_last), (q_there, q_last), p, (1 - share) * h, on))
        after[place] = np.where(_is_across(after[place], on[place]), 0.0, after[place])
        changed = []
        for state, value in zip(following, after, strict=True):
            state = state.copy()
            state[meets] = value
            changed.append(state)
        return tuple(changed)

    def start(self, u: Values, q: Values, p: Namespace, shape: tuple[int, ...]) -> States:
        """Return the states at the begin, of a `shape`."""
        start = as_tuple(self.system.start(Namespace(**u), Namespace(**q), p))
        return tuple(np.broadcast_to(np.asarray(state, float), shape) for state in start)

    def outputs(self, x: States, u: Values, q: Values, p: Namespace) -> States:
        """Return the outputs; a law inside the equations acts on them as well."""
        return self.read(x, u, q, p, self.sides(x, u, q, p) if self.system.switches else {})

    def read(self, x: States, u: Values, q: Values, p: Namespace, sides: Mapping[int, np.ndarray]) -> States:
        """Return the outputs on the `sides` of surfaces."""
        named = self.system.name(x, sides)
        return as_tuple(self.system.output(named, *self._changed(named, u, q, p), p))
