"""Runs of a machine: its parameters, commands and conditions, and the law by which one quantity of it changes."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from ..forms import Curve, Lag, Memory

SEQUENCE = "run order"
"""Word for the place of a run in the test sequence: 0 for the first, 1 for the last."""
PAST = "past voltage"
CHANNELS = {"two tanks": "temperature", "dc motor": "winding temperature"}
"""Name of the temperature of each machine."""
Name = Literal["two tanks", "dc motor"]
Abscissas = Mapping[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Change:
    """A `quantity` that changes with an `abscissa`, and the `pair` of words for it; the change has an amplitude.

    The law is a `form` over the abscissa, or over its `magnitude`, which is `low` to `high` where the form is 0 to 1;
    less `zero`. Over an angle in rad it may repeat `turns` times in a turn, in phase with `phase` in rad. An amplifier
    with a `memory` has plays of this width in V, and a `lag` delays the voltage, or a sensor, by the amplitude in s.
    `pace` in s is the time constant of the averaged voltage, which is the abscissa `PAST`.
    """

    pair: tuple[str, str]
    quantity: str
    abscissa: str
    form: Curve | None = None
    low: float = 0.0
    high: float = 1.0
    zero: float = 0.0
    magnitude: bool = False
    turns: int = 0
    phase: float = 0.0
    pace: float = 0.0
    lag: Lag | None = None
    memory: Memory | None = None

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Return the change at an amplitude of 1, of the shape of `x`; lines join the nodes of the form."""
        assert self.form is not None
        if self.turns:
            x = 0.5 - 0.5 * np.cos(self.turns * x + self.phase)
        elif self.magnitude:
            x = np.abs(x)
        return np.interp((x - self.low) / (self.high - self.low), self.form.nodes, self.form.values) - self.zero


@dataclass(frozen=True, eq=False)
class Runs:
    """n runs of `count` samples, every `period` s, the first at 0 s.

    `values` and `conditions` (n,) are the actual parameters and conditions by name, `channel` (n,) the temperature in
    degC, `order` (n,) the place of each run in the test sequence, 0 to n - 1. The commanded voltage in V is piecewise
    linear with corners at `corner_time` in s and `corner_value` (n, m). A `change` has the `amplitude` (n,), which is 0
    in runs in which it does not act.
    """

    machine: Name
    values: Mapping[str, np.ndarray]
    conditions: Mapping[str, np.ndarray]
    channel: np.ndarray
    order: np.ndarray
    period: float
    count: int
    corner_time: np.ndarray
    corner_value: np.ndarray
    change: Change | None = None
    amplitude: np.ndarray = field(default_factory=lambda: np.zeros(1))

    @property
    def time(self) -> np.ndarray:
        """Times (k,) of the samples in s."""
        return np.arange(self.count) * self.period

    @property
    def sequence(self) -> np.ndarray:
        """Places (n,) of the runs in the test sequence, from 0 to 1."""
        return self.order / max(int(self.order.max()), 1)

    def take(self, lanes: np.ndarray) -> "Runs":
        """Return the runs of these indices; their places in the test sequence stay."""
        values, conditions = ({name: column[lanes] for name, column in columns.items()}
                              for columns in (self.values, self.conditions))
        return replace(self, values=values, conditions=conditions, channel=self.channel[lanes], order=self.order[lanes],
                       corner_time=self.corner_time[lanes], corner_value=self.corner_value[lanes],
                       amplitude=np.broadcast_to(self.amplitude, self.order.shape)[lanes])

    def times_factors(self, factors: Mapping[str, np.ndarray]) -> "Runs":
        """Return the runs with parameters multiplied by factors (n,)."""
        return replace(self, values={name: value * factors.get(name, 1.0) for name, value in self.values.items()})

    def with_change(self, change: Change | None, amplitude: np.ndarray) -> "Runs":
        """Return the runs with a change of the amplitudes (n,)."""
        return replace(self, change=change, amplitude=amplitude)

    def evaluate(self, quantity: str, abscissas: Abscissas) -> np.ndarray | float:
        """Return the change (n,) of a quantity at abscissas (n,), or (n, k) for both; 0 if it does not change."""
        change = self.change
        if change is None or change.quantity != quantity or change.form is None:
            return 0.0
        x = abscissas[change.abscissa]
        return (self.amplitude if x.ndim == 1 else self.amplitude[:, None]) * change(x)


@dataclass(frozen=True, eq=False)
class Inputs:
    """What drives n runs on the grid of the integrator, with K steps of `step` s, time first.

    `commanded`, `applied` (after plays and lags of the amplifier) and `past` (averaged) voltage (K + 1, n) in V,
    linear in a step; `fixed` are abscissas (n,) that are constant in a run.
    """

    step: float
    commanded: np.ndarray
    applied: np.ndarray
    past: np.ndarray
    fixed: Abscissas

    @property
    def time(self) -> np.ndarray:
        """Times (K + 1,) in s."""
        return np.arange(len(self.commanded)) * self.step


def prepare_inputs(runs: Runs, substeps: int) -> Inputs:
    """Return the inputs of runs for an integrator with `substeps` steps in a sampling period."""
    step = runs.period / substeps
    time = np.arange((runs.count - 1) * substeps + 1) * step
    corners = zip(runs.corner_time, runs.corner_value, strict=True)
    commanded = np.array([np.interp(time, *corner) for corner in corners])
    applied = past = commanded
    change = runs.change
    if change is not None and change.abscissa == PAST:
        if change.form is not None:
            past = Lag("cascade", {"a": 1.0})(commanded, step, change.pace)
        else:
            applied = respond(runs, commanded, step)
    fixed = {SEQUENCE: runs.sequence, **runs.conditions, CHANNELS[runs.machine]: runs.channel}
    rows = [np.ascontiguousarray(voltage.T) for voltage in (commanded, applied, past)]
    return Inputs(step, rows[0], rows[1], rows[2], fixed)


def respond(runs: Runs, signal: np.ndarray, step: float) -> np.ndarray:
    """Return a signal (n, k), sampled every `step` s, after the lag or the plays of the runs' change."""
    change, output = runs.change, signal.copy()
    assert change is not None
    for amplitude in np.unique(runs.amplitude[runs.amplitude > 0]):
        lanes = runs.amplitude == amplitude
        if change.lag is not None:
            output[lanes] = change.lag(signal[lanes], step, float(amplitude))
        elif change.memory is not None:
            output[lanes] = _play(signal[lanes], amplitude * change.memory.widths, change.memory)
    return output


def _play(signal: np.ndarray, widths: np.ndarray, memory: Memory) -> np.ndarray:
    """Return a signal (n, k) after plays in parallel that lag by `widths` (m,), in the mean, either way."""
    up, down = (widths * (1.0 + sign * memory.asymmetry) for sign in (1.0, -1.0))
    held = np.repeat(signal[:, :1], len(widths), axis=1)
    output = np.empty_like(signal)
    for index in range(signal.shape[1]):
        now = signal[:, index, None]
        held = np.clip(held, now - up, now + down)
        output[:, index] = held @ memory.weights
    return output
