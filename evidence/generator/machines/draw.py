"""Draws a case of the suite `other_machines`: a machine, its runs, deviations, and mostly one hidden effect."""

from dataclasses import dataclass

import numpy as np

from .. import sensors
from ..bad_runs import BadRun
from ..case import choose_runs
from ..truth import HiddenEffect, Truth
from .effects import can_act_in_few_runs, draw_change
from .pairs import PAIRS
from .recordings import MACHINES, Reading, measure, simulate
from .runs import SEQUENCE, Change, Name, Runs
from .settings import EXACT, draw_nominal, draw_values, vary
from .strength import Scale
from .world import TEMPTATIONS, World, draw_world

SUITE = "other_machines"
STRENGTHS = (1.0, 10.0)  # least and most residual that an effect leaves, over the noise
FEW, OFTEN_FEW = 0.1, 0.15  # share of runs of an effect that acts in few of them, and probability of such an effect
_NOMINAL, _WORLD, _EFFECT, _RUNS, _NOISE = range(5)
"""Streams of random numbers of a case."""


@dataclass(frozen=True)
class Hidden:
    """A `change` of an `amplitude` in a `share` of the runs, its `strength`, and the `signal` that shows it most."""

    change: Change
    amplitude: float
    share: float
    strength: float
    signal: str


@dataclass(frozen=True, eq=False)
class MachineCase:
    """A set of recordings: cases from the same seed give identical files.

    `values` are the nominal numbers by parameter, `stated` the stated conditions (n,) by name. `runs` have the actual
    numbers and the hidden effect, if there is any, and `world` the deviations that are no effect.
    """

    name: str
    seed: int
    values: dict[str, float]
    stated: dict[str, np.ndarray]
    runs: Runs
    world: World
    hidden: Hidden | None = None

    @property
    def machine(self) -> str:
        """The machine in words."""
        return self.runs.machine


def draw_machine_case(seed: int) -> MachineCase:
    """Return the case of a seed: two tanks for even ones, and the motor for odd ones.

    A quarter have no effect, and half of these a deviation that looks like an effect.
    """
    streams = [np.random.default_rng([*SUITE.encode(), seed, stream]) for stream in range(_NOISE)]
    random = streams[_NOMINAL]
    machine: Name = "dc motor" if seed % 2 else "two tanks"
    nominal, values = draw_nominal(machine, draw_values(machine, random), random)
    reading = simulate(nominal, MACHINES[machine].COARSE)
    ranges = {name: float(np.ptp(rows)) for name, rows in reading.signals.items()}
    scattered = tuple(name for name in values if name not in EXACT)
    world = draw_world(machine, ranges, scattered, streams[_WORLD])
    hidden, label = None, "plain"
    if seed // 2 % 4 < 3:
        hidden = _draw_hidden(nominal, reading, world, streams[_EFFECT])
        label = _name_pair(hidden) + ("-in-few-runs" if hidden.share < 1 else "") + f"/seed-{seed}"
        label += f"/{hidden.strength:.2g}x"
    else:
        if seed // 8 % 2 == 0:
            label = [*TEMPTATIONS][(seed // 16 + seed % 2 * 3) % len(TEMPTATIONS)]
            world = TEMPTATIONS[label](world, ranges, reading.signals[next(iter(ranges))].shape, streams[_WORLD])
        label = f"{label.replace(' ', '-')}/seed-{seed}"
    runs, stated = vary(nominal, world, streams[_RUNS])
    if hidden is not None:
        acts = choose_runs(hidden.share, runs.order, streams[_RUNS]) | (hidden.share == 1)
        runs = runs.with_change(hidden.change, hidden.amplitude * acts)
    name = f"{SUITE}/{machine.replace(' ', '-')}/{label}"
    return MachineCase(name, seed, values, stated, runs, world, hidden)


def _draw_hidden(nominal: Runs, reading: Reading, world: World, random: np.random.Generator) -> Hidden:
    """Draw until an effect has the drawn strength, or the largest plausible one if that is 1 or more.

    An effect in a share of the runs has the strength over all runs, so that it is larger where it acts.
    """
    scale, pairs = Scale(nominal, world), PAIRS[nominal.machine]
    while True:
        change = draw_change(pairs[random.integers(len(pairs))], nominal, reading, random)
        share = FEW if random.random() < OFTEN_FEW and can_act_in_few_runs(change) else 1.0
        wanted = float(np.exp(random.uniform(*np.log(STRENGTHS))))
        try:
            scaled = scale.find_amplitude(change, wanted / np.sqrt(share), reading)
        except RuntimeError:
            continue
        if scaled is not None:
            amplitude, measured = scaled
            strength = measured.strength * float(np.sqrt(share))
            if strength >= STRENGTHS[0]:
                return Hidden(change, amplitude, share, strength, measured.signal)


def _name_pair(hidden: Hidden) -> str:
    quantity, on = hidden.change.pair
    return f"{quantity} {on if on in ('lag', 'offset', 'gain') else f'over {on}'}".replace(" ", "-")


def simulate_machine_case(case: MachineCase) -> Reading:
    """Run the case without noise; the sensors have their late clocks."""
    return simulate(case.runs, clocks=case.world.clocks)


def measure_machine_case(case: MachineCase, reading: Reading) -> sensors.Signals:
    """Return the measured signals (n, k) of a run of the case."""
    return measure(reading, case.world, np.random.default_rng([*SUITE.encode(), case.seed, _NOISE]))


def describe_machine_case(case: MachineCase, reading: Reading) -> Truth:
    """Return what is hidden; a spike is a bad run, and `base` the mean of the parameter that a share belongs to."""
    spike, means = case.world.spike, {name: float(np.mean(column)) for name, column in case.runs.values.items()}
    bad = () if spike is None else (
        BadRun(spike.run, "spike", spike.signal, start=float(case.runs.time[spike.sample]),
               duration=spike.length * case.runs.period, run=spike.run),)
    hidden = () if case.hidden is None else (_describe(case, case.hidden, reading, means),)
    return Truth(case.name, len(case.runs.order), hidden, (), {}, bad, means)


_BASES = {"pump flow": "pump gain", "outflow 1": "outlet 1", "outflow 2": "outlet 2", "resistance": "resistance value",
          "torque constant": "motor constant", "inertia": "rotor inertia", "viscous friction": "viscous coefficient",
          "dry friction": "dry torque"}


def _name_abscissa(change: Change) -> str:
    """Return the abscissa as the other suites call it; a constant has none."""
    return "" if change.pair[1] == "offset" else "sequence" if change.abscissa == SEQUENCE else change.abscissa


def _describe(case: MachineCase, hidden: Hidden, reading: Reading, means: dict[str, float]) -> HiddenEffect:
    change, ratio = hidden.change, hidden.change.quantity in MACHINES[case.machine].RATIOS
    grid = law = visits = np.zeros(0)
    trend = "neither"
    if change.form is not None:
        trend, x = change.form.trend, reading.abscissas[change.abscissa].ravel()
        low, high = np.quantile(x, (0.01, 0.99))
        grid = np.linspace(low, high, 41)
        edges = np.concatenate([[-np.inf], (grid[1:] + grid[:-1]) / 2, [np.inf]])
        visits = np.histogram(x, edges)[0] / x.size
        law = hidden.amplitude * change(grid) + ratio
    form = change.form or change.lag
    plays = "" if change.memory is None else f"{len(change.memory.widths)} plays"
    return HiddenEffect(change.pair, True, hidden.signal, form.family if form else plays, trend, hidden.share,
                        round(hidden.strength, 2), change.quantity,
                        _name_abscissa(change),
                        "ratio" if ratio else "difference", means.get(_BASES.get(change.quantity, "")), grid.tolist(),
                        law.tolist(), visits.tolist())
