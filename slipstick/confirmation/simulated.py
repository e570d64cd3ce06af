"""The whole bench as one block: conditions -> all signals and the shifting time, with random effects on parameters.

It has the form of the other blocks, so that the same fit (`slipstick.naming.curved`) finds the parameters of each
engagement, how they scatter, and the coefficients of the terms that are added.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slipstick.bench import parameters
from slipstick.blocks.whitening import BlockNoise
from slipstick.clutch import ensemble
from slipstick.confirmation.terms import Terms
from slipstick.confirmation.traces import Traces
from slipstick.naming.block import Laws, Pair, changed
from slipstick.naming.law_map import LawMap
from slipstick.naming.mechanics import CONDITIONS_WITHIN, KNOWN
from slipstick.numerics.threads import mapped

CONDITIONS = ("motor_speed", "load_inertia", "brake_torque")
"""Conditions that differ from what is stated."""
RANDOM: Mapping[str, tuple[float, float]] = {
    "friction_coefficient": (np.inf, 0.1), "current_delay": (np.inf, 0.1), "current_bias": (np.inf, 0.2),
    "current_gain": (np.inf, 0.1), "pressure_bias": (np.inf, 0.2), "initial_position": (np.inf, 0.4),
    "temperature_gain": (np.inf, 0.3), "piston_return": (KNOWN, 0.05), "film_coefficient": (KNOWN, 0.05),
    "ramp_share": (KNOWN, 0.05), "output_viscous": (KNOWN, 0.1), "input_inertia": (KNOWN, 0.1),
    "input_coulomb": (KNOWN, 0.1), "input_viscous": (KNOWN, 0.1),
    **dict.fromkeys(CONDITIONS, (CONDITIONS_WITHIN, 0.05))}
"""Parameter or condition -> standard deviations, relative to nominal: of the prior of its mean, and of its scatter at
most. They are those of the blocks."""
_ROUGH, _FINE = 1e-3, 1e-6
"""Steps of differences, relative ones of parameters, and those of coefficients over their spans.

Near lock-up, signals have kinks in the parameters, and are measured to a thousandth of what these change. By rough
steps, a change of a parameter and that of an effect which does the same differ by per cents there, which looks like
knowledge: standard errors of what differs between engagements were a tenth of what they are. Fine ones meet hardly any
kink, and rounding errors are 1e-7 of what they measure: the two differ by less than the noise. Rough steps lead over
kinks at which a fit with fine ones stops."""
_FACTORS = (0.1, 10.0)
"""Least and largest parameter over its nominal value: a step that leads further is as far off as no fit goes."""
_AT_ONCE = 500
"""Engagements that a thread simulates at once: the samples of all would take gigabytes."""
_WIDE = 0.3
"""Prior standard deviation of a coefficient about neutral, over its span: next to none."""
_LATE = 1.0
"""Prior standard deviation of the clock of a signal about 0 in samples, as in the blocks."""


class SimulatedBench:
    """All signals and the shifting time of recordings, from their conditions alone, with `terms` in the model.

    Engagements share p coefficients of the terms, over their spans, and then the delays of the c clocks of the measured
    signals in samples: a lag of a sensor and a late clock look alike, and neither is known without the other.
    """

    name, signal, fine = "simulation", "all signals", 0
    finer: Mapping[Pair, int] = {}
    random: tuple[str, ...] = tuple(RANDOM)

    def __init__(self, traces: Traces, terms: Terms, widest: np.ndarray | None = None, rough: bool = False) -> None:
        """`widest` (q,) are the largest standard deviations of the parameters, those of `RANDOM` by default.

        A `rough` one takes differences by long steps.
        """
        self.step = _ROUGH if rough else _FINE
        # Far from where a fit ends, engagements would be explained by their own parameters, before it is known how
        # these scatter.
        self.follows_chords = not rough
        self.traces, self.terms, self.scene = traces, terms, traces.scene
        self.measured, self.counted = traces.measured, traces.counted
        self.fixed: tuple[str, ...] = (*(f"{unknown.term}: {unknown.name}" for unknown in terms.unknowns),
                                       *(f"clock of {signal}" for signal in traces.signals))
        known, scatter = (np.array(values) for values in zip(*RANDOM.values(), strict=True))
        self.freed = traces.freed
        self.random_std = np.where([name in self.freed for name in self.random], np.inf, known)
        self.widest = scatter if widest is None else widest
        self.coefficients = slice(len(terms.unknowns))
        self.clocks = slice(len(terms.unknowns), len(self.fixed))
        self.fixed_std = np.full(len(self.fixed), _LATE)
        self.fixed_std[self.coefficients] = _WIDE
        self.shared = self.neutral
        ends = [((unknown.lower - unknown.neutral) / unknown.span, (unknown.upper - unknown.neutral) / unknown.span)
                for unknown in terms.unknowns]
        ends += [(-np.inf, np.inf)] * len(traces.signals)
        self.bounds = np.array(ends).reshape(-1, 2).T

    @property
    def neutral(self) -> np.ndarray:
        """Shared values (p + c,) with terms that do nothing, and the clocks that the blocks have."""
        late = [self.traces.clocks.get(signal, 0.0) / self.scene.step for signal in self.traces.signals]
        return np.concatenate([np.zeros(len(self.terms.unknowns)), late])

    def at(self, shared: np.ndarray) -> "SimulatedBench":
        """The block with the `shared` values (p + c,): coefficients are differences from neutral over the span."""
        return changed(self, shared=shared)

    def values(self, shared: np.ndarray) -> np.ndarray:
        """The coefficients (p,) in their units, within their bounds."""
        unknowns = self.terms.unknowns
        values = [unknown.neutral + unknown.span * move
                  for unknown, move in zip(unknowns, np.nan_to_num(shared[self.coefficients]), strict=True)]
        return np.asarray(np.clip(values, [unknown.lower for unknown in unknowns],
                                  [unknown.upper for unknown in unknowns]))

    def base(self, points: np.ndarray, laws: Laws = ()) -> np.ndarray:
        """The rows (n, K) at `points` (n, q)."""
        return np.asarray(self.rows_at(points[None], self.shared)[0])

    def part(self, points: np.ndarray, laws: Laws, rows: np.ndarray) -> np.ndarray:
        """The rows (n, K) of the engagements `rows` (n,), and 0 of the others."""
        return np.where(rows[:, None], self.base(points), 0.0)

    def rows_at(self, points: np.ndarray, shared: np.ndarray) -> np.ndarray:
        """The rows (s, n, K) at s sets of `points` (s, n, q) relative to nominal."""
        at_once = max(1, _AT_ONCE // points.shape[1])

        def simulate(first: int) -> np.ndarray:
            batch = points[first:first + at_once]
            response = self.respond(batch.reshape(-1, batch.shape[-1]), shared)
            rows = self.traces.simulated(response, shared[self.clocks])
            return rows.reshape(len(batch), points.shape[1], -1)

        return np.concatenate(mapped(simulate, range(0, len(points), at_once)))

    def respond(self, points: np.ndarray, shared: np.ndarray) -> ensemble.Response:
        """The simulated engagements at `points` (m, q) relative to nominal, of the n conditions again and again."""
        values, given = self.values(shared), self.traces.conditions
        vectors = np.tile(self.scene.base, (len(points), 1))
        conditions, changed = given.take(np.arange(len(points)) % len(given)), dict[str, np.ndarray]()
        for column, name in enumerate(self.random):
            factor = np.clip(np.nan_to_num(1 + points[:, column]), *_FACTORS)
            if name in CONDITIONS:
                changed[name] = getattr(conditions, name) * factor
            else:
                vectors[:, parameters.index(name)] *= factor
        coefficients = np.tile(self.terms.coefficients(values), (len(points), 1))
        return ensemble.simulate(self.traces.converter, vectors, coefficients, replace(conditions, **changed),
                                 self.scene.time, paired=True, laws=self.terms.scaled(values))

    def columns(self, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives (n, q, K) with respect to the parameters and (n, p + c, K) to what engagements share.

        Those with respect to coefficients are inwards at a bound.
        """
        steps = self.step * np.eye(len(self.random))[:, None]
        ahead = self.rows_at(points + steps, self.shared)
        own = (ahead - predicted) / self.step
        columns, units = [], np.eye(len(self.fixed))
        for place, upper in enumerate(self.bounds[1, self.coefficients]):
            step = self.step if self.shared[place] + self.step <= upper else -self.step
            ahead = self.rows_at(points[None], self.shared + step * units[place])[0]
            columns.append((ahead - predicted) / step)
        # Rows are linear in clocks, and each signal has its own.
        late = self.rows_at(points[None], self.shared + units[self.clocks].sum(axis=0))[0] - predicted
        clocks = np.zeros((len(points), len(self.traces.signals), late.shape[1]))
        for place, signal in enumerate(self.traces.signals):
            clocks[:, place, self.traces.columns[signal]] = late[:, self.traces.columns[signal]]
        fixed = np.concatenate([*(column[:, None] for column in columns), clocks], axis=1)
        return own.transpose(1, 0, 2), fixed

    def noise(self, points: np.ndarray) -> BlockNoise:
        """Independent with unit variance."""
        return BlockNoise(1.0, 0.0)

    def pairs(self, rare: bool = False) -> list[Pair]:
        """None: what is asked for is in the terms."""
        return []

    def size(self, pair: Pair) -> int:
        """No pair has a law here."""
        raise KeyError(pair)

    def basis(self, pair: Pair, points: np.ndarray, laws: Laws, predicted: np.ndarray) -> np.ndarray:
        """No pair has a law here."""
        raise KeyError(pair)

    def law(self, pair: Pair) -> LawMap:
        """No pair has a law here."""
        raise KeyError(pair)
