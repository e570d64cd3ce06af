"""The suites: kinds of cases that ask one question each, drawn from a seed.

A case is determined by its suite and its seed, so that `--seed 5 --cases 4` are the cases with the seeds 5 to 8. Its
bench, the form of each law, strength, deviations, sensors and bad runs are drawn.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .generator.bench import SENSORS, Bench
from .generator.case import Case, Hidden, simulate
from .generator.dependences import KNOWN, OVER_TEMPERATURE, UNKNOWN, Dependence
from .generator.draw_bench import draw_bench
from .generator.draw_effect import DrawnEffect, can_act_in_few_runs, draw_effect, size_of
from .generator.run import Run
from .generator.strength import Scale
from .generator.temptations import TEMPTATIONS
from .generator.world import World, draw_world

RUNS = (28, 54)  # least and most runs of a case, of which those that do not lock are left out
STRENGTHS = (1.0, 10.0)  # least and most residual that an effect leaves, over the noise
FEW = 0.1  # share of runs of an effect that acts in few of them
OFTEN_FEW = 0.15  # probability of such an effect
TRIED = 12  # runs that show whether an effect is plausible
LOCKED = 0.9  # least share of runs that lock
MEASURED = 4  # times that the strength of an amplitude is measured, at most
NEAR = 1.15  # factor between the wanted strength and that of the effect
LEAST_SHOWN = 0.01  # strength at the typical amplitude, or the bench has nothing that the effect changes
LARGEST_RATIO = 3.0  # of a quantity with its effect to that without it
LARGEST_SHARE = 0.5  # of the change of a quantity to its size
LIMITED = ("chamber_pressure", "net_pressure", "load_torque", *(f"{name}_sensor" for name in SENSORS))
"""Quantities that change by a difference of limited size; the others are small in themselves, or zero without it."""
ERRORS = ("lag", "offset", "gain")  # of sensors
_BENCH, _WORLD, _CHOICES = range(10, 13)
"""Streams of random numbers of a case beside those of case.py."""


@dataclass(frozen=True, eq=False)
class Chance:
    """What the cases of a suite and a seed draw from."""

    suite: str
    seed: int
    bench: Bench
    nominal: Run
    world: World
    random: np.random.Generator

    @property
    def key(self) -> tuple[int, int]:
        """The integers from which a case draws."""
        return [*SUITES].index(self.suite), self.seed

    @cached_property
    def _scale(self) -> Scale:
        return Scale(self.nominal, self.world.noise)

    def draw_pair(self, dependences: tuple[Dependence, ...], few_allowed: bool = False) -> Hidden | None:
        """Draw an effect of one of the pairs, of a drawn strength; None where the bench shows no such effect."""
        pairs = sorted({dependence.pair for dependence in dependences})
        pair = pairs[self.random.integers(len(pairs))]
        variants = [dependence for dependence in dependences if dependence.pair == pair]
        drawn = draw_effect(variants[self.random.integers(len(variants))], self.nominal, self.random)
        is_few = few_allowed and self.random.random() < OFTEN_FEW and can_act_in_few_runs(drawn.effect)
        wanted = float(np.exp(self.random.uniform(*np.log(STRENGTHS))))
        return self.scale(drawn, wanted, FEW if is_few else 1.0)

    def scale(self, drawn: DrawnEffect, wanted: float, share: float) -> Hidden | None:
        """Return an effect of about the `wanted` strength, or of the largest plausible one below it.

        An effect in a share of the runs has the strength over all runs, so that it is larger where it acts. None is
        returned where the bench hardly shows it; `RuntimeError` is raised where the integrator does not get through.
        """
        amplitude = drawn.typical
        for _ in range(MEASURED):
            amplitude = self._plausible(drawn, amplitude)
            strength = self._scale.measure(drawn.effect, amplitude) * float(np.sqrt(share))
            if strength < LEAST_SHOWN:
                return None
            if abs(np.log(wanted / strength)) < np.log(NEAR):
                break
            tried, amplitude = amplitude, amplitude * float(np.clip(wanted / strength, 0.05, 20))
        else:
            amplitude = tried
        return Hidden(drawn.effect, amplitude, share, strength)

    def _plausible(self, drawn: DrawnEffect, amplitude: float) -> float:
        """Return the amplitude, or a smaller one, with which runs lock and no quantity changes by too much."""
        while not self._is_plausible(Hidden(drawn.effect, amplitude)):
            amplitude /= 1.5
        return amplitude

    def _is_plausible(self, hidden: Hidden) -> bool:
        case = Case("", self.key, self.bench, TRIED, (hidden,), World(), shift=0.0)
        try:
            run = simulate(case, relative=1e-4)
        except RuntimeError:
            return False
        if len(run.conditions) < LOCKED * TRIED:
            return False
        acting, = run.engagements.effects
        abscissa = run.quantities[acting.effect.abscissa]
        change = acting.effect.law(acting.amplitude, abscissa)
        if acting.effect.kind == "ratio":
            return bool(1 / LARGEST_RATIO < change.min() <= change.max() < LARGEST_RATIO)
        size = size_of(acting.effect.quantity, self.nominal) if acting.effect.quantity in LIMITED else np.inf
        return bool(np.abs(change).max() <= LARGEST_SHARE * size)

    def case(self, label: str, hidden: tuple[Hidden, ...] = (), **others: object) -> Case:
        """Return a case of the suite, whose name says what is hidden, the seed, and the strengths."""
        strengths = "+".join(f"{each.strength:.2g}x" for each in hidden)
        name = "/".join([self.suite, label, f"seed-{self.seed}", *([strengths] if hidden else [])])
        count = int(self.random.integers(RUNS[0], RUNS[1] + 1))
        arguments = {"world": self.world} | others
        return Case(name, self.key, self.bench, min(count, len(self.bench.profile)), hidden, **arguments)


def name_pairs(hidden: tuple[Hidden, ...]) -> str:
    """Return the words of effects for the name of a case."""
    pairs = [each.effect.pair for each in hidden]
    words = [f"{quantity} {on if on in ERRORS else f'over {on}'}" for quantity, on in pairs]
    return "+".join(words).replace(" ", "-")


def _draw_until(chance: Chance, dependences: tuple[Dependence, ...], few_allowed: bool = False) -> Hidden:
    """Draw until the bench shows the effect."""
    while True:
        try:
            hidden = chance.draw_pair(dependences, few_allowed)
        except RuntimeError:
            continue
        if hidden is not None:
            return hidden


def _nothing(chance: Chance) -> Case:
    """Half of the cases have a deviation that looks like an effect."""
    if chance.seed % 2:
        return chance.case("plain")
    name = [*TEMPTATIONS][chance.random.integers(len(TEMPTATIONS))]
    return chance.case(name.replace("_", "-"), world=TEMPTATIONS[name](chance.world, chance.bench, chance.random))


def _known(chance: Chance) -> Case:
    hidden = _draw_until(chance, KNOWN, few_allowed=True),
    return chance.case(name_pairs(hidden) + ("-in-few-runs" if hidden[0].share < 1 else ""), hidden)


def _unknown(chance: Chance) -> Case:
    hidden = _draw_until(chance, UNKNOWN),
    return chance.case(name_pairs(hidden), hidden)


def _two(chance: Chance) -> Case:
    """In half of the cases both effects are in one block."""
    first = _draw_until(chance, KNOWN)
    others = tuple(each for each in KNOWN if (each.block == first.effect.block) == bool(chance.seed % 2)
                   and each.quantity != first.effect.quantity and each.pair != first.effect.pair)
    hidden = first, _draw_until(chance, others)
    return chance.case(name_pairs(hidden), hidden)


def _wrong_parameter(chance: Chance) -> Case:
    """In half of the cases a parameter that is calibrated is off, within its bounds, and in half one that is not."""
    bench, names = chance.bench, [name for name in chance.bench.parameters if name not in ("gr", "beta", "eps", "c2")]
    names = [name for name in names if (name in bench.uncertain) == bool(chance.seed % 2)]
    name = names[chance.random.integers(len(names))]
    factor = float(np.exp(chance.random.choice([-1, 1]) * chance.random.uniform(np.log(1.15), np.log(1.45))))
    kind = "calibrated" if name in bench.uncertain else "fixed"
    return chance.case(f"{kind}-{name}-times-{factor:.2f}", factors={name: factor})


def _faulty(chance: Chance) -> Case:
    """Many bad runs and a loud sensor; half of the cases have an effect."""
    world = replace(TEMPTATIONS["loud_sensor"](chance.world, chance.bench, chance.random), bad_runs=0.08)
    chance = replace(chance, world=world)
    if chance.seed % 2:
        return chance.case("no-effect")
    hidden = _draw_until(chance, KNOWN),
    return chance.case(name_pairs(hidden), hidden)


def _missing(chance: Chance) -> Case:
    """One to three signals were not recorded; half of the cases have an effect."""
    count = int(chance.random.integers(1, 4))
    missing = tuple(sorted(chance.random.permutation(SENSORS)[:count].tolist()))
    without = "-without-" + "-and-".join(name.replace("_", "-") for name in missing)
    if chance.seed % 2:
        return chance.case("no-effect" + without, missing=missing)
    known = tuple(each for each in KNOWN if each.quantity.partition("_sensor")[0] not in missing)
    hidden = _draw_until(chance, known),
    return chance.case(name_pairs(hidden) + without, hidden, missing=missing)


def _further(chance: Chance) -> Case:
    """A temperature was recorded: half of the cases have an effect that depends on it, and a quarter another effect."""
    chance = replace(chance, world=replace(chance.world, thermometer=True))
    if chance.seed % 4 == 3:
        return chance.case("no-effect")
    hidden = _draw_until(chance, OVER_TEMPERATURE if chance.seed % 2 == 0 else KNOWN),
    return chance.case(name_pairs(hidden), hidden)


SUITES: Mapping[str, Callable[[Chance], Case]] = {
    "nothing_missing": _nothing, "one_known_effect": _known, "one_unknown_effect": _unknown, "two_effects": _two,
    "wrong_parameter": _wrong_parameter, "faulty_recordings": _faulty, "missing_signals": _missing,
    "further_channel": _further,
}
"""Name of each suite, and how it draws a case."""


OTHER_MACHINES = "other_machines"
"""The suite of machines that are no clutch; `generator.machines` draws its cases."""


def draw_case(suite: str, seed: int) -> Case:
    """Return the case of a suite and a seed."""
    key = [*SUITES].index(suite), seed
    bench, nominal = draw_bench([*key, _BENCH])
    world = draw_world([*key, _WORLD], bench)
    random = np.random.default_rng([*key, _CHOICES])
    return SUITES[suite](Chance(suite, seed, bench, nominal, world, random))
