"""Identification on two tanks that scipy simulates, effects in few runs, and fits of parts together and apart."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from slipstick.engine import selection
from slipstick.engine.evidence import multiply, screen
from slipstick.engine.fit import Fit, fit, join
from slipstick.engine.kinds import KindOfLaw, find_kind
from slipstick.engine.laws import list_candidates
from slipstick.engine.linear_model import restricted_likelihood
from slipstick.engine.measured_law import measure
from slipstick.engine.preparation import prepare
from slipstick.engine.selection import Identification, identify
from slipstick.engine.settings import EngineSettings
from slipstick.engine.settling import fit_bare, settle
from slipstick.errors import InvalidValue
from slipstick.machine import Block, Command, Machine, Parameter, Profile, Quantity, Runs, Sensor, open_machine

TANKS = open_machine(Path(__file__).parents[3] / "tables" / "machines" / "two_tanks.py")
RUNS, TIME, NOISE = 30, np.linspace(0, 100, 201), 0.003
CORNERS = np.array([0.0, 20, 25, 50, 55, 80, 100])
ALONE = [4, 11, 17, 26]
CASES = {"none": (np.inf, 3, range(RUNS)), "most": (0.4, 3, range(RUNS)), "a tenth": (0.55, 3, range(RUNS)),
         "a sixth": (0.55, 5, range(RUNS)), "alone": (0.2, 3, ALONE)}
"""The level in m from which tank 1 leaks, the number of runs that are filled high, and those in which it may leak."""


@cache
def record(name: str) -> tuple[Runs, np.ndarray]:
    """The recordings, and the runs in which tank 1 leaks."""
    rng, (place, high, may) = np.random.default_rng(12), CASES[name]
    may_leak = np.isin(np.arange(RUNS), may)
    voltage = Profile(np.tile(CORNERS, (RUNS, 1)), rng.uniform(2, 6, (RUNS, len(CORNERS))))
    voltage.value[rng.permutation(RUNS)[:high], 3:5] = 11.0
    gain, outlets = 0.92e-3 * rng.normal(1.02, 0.01, RUNS), [[8e-3], [9e-3]] * rng.normal(0.98, 0.01, (2, RUNS))

    def rate(t: float, x: np.ndarray) -> np.ndarray:
        first, second = np.maximum(x, 0.0).reshape(2, RUNS)
        between = outlets[0] * np.sqrt(first) + 0.02 * np.maximum(first - 0.6, 0.0) ** 1.5
        leak = 5e-4 * may_leak * (1 - np.exp(-np.maximum(first - place, 0.0) / 0.05))
        return np.concatenate([(gain * voltage.at(np.array([t]))[:, 0] - between - leak) / 0.05,
                               (between - outlets[1] * np.sqrt(second)) / 0.06])

    begin = rng.uniform(0.2, 0.4, 2 * RUNS)
    levels = solve_ivp(rate, (0, 100), begin, t_eval=TIME, max_step=1.0, rtol=1e-7, atol=1e-9).y.reshape(2, RUNS, -1)
    leaking = (levels[0] > place).any(axis=1) & may_leak
    levels += NOISE * rng.standard_normal(levels.shape)
    return Runs(TIME, {"level 1": levels[0], "level 2": levels[1]}, {"voltage": voltage},
                order=rng.permutation(RUNS).astype(float)), leaking


@cache
def identified(name: str) -> Identification:
    return identify(prepare(TANKS, record(name)[0]))


@pytest.mark.parametrize("name", [pytest.param("most", marks=pytest.mark.slow), "a tenth",
                                  pytest.param("a sixth", marks=pytest.mark.slow)])
def test_a_leak_of_a_tank_is_named_first_and_alone(name: str) -> None:
    """Where few runs get there as well, which may be bad ones: they are set aside, and all are searched again."""
    answer = identified(name)
    assert [finding.pair for finding in answer.findings] == [("leak 1", "level 1")]
    assert answer.findings[0].errors > 10
    assert not answer.set_aside
    assert answer.apart is None
    assert not answer.unexplained


def test_a_kind_with_which_the_equations_have_no_solution_leaves_the_law_as_it_was_measured() -> None:
    fit, pair = identified("a sixth").fits[0], ("leak 1", "level 1")
    overflowing = replace(fit, recorded=replace(fit.recorded, parts=tuple(
        replace(part, parameters={name: np.nan * value for name, value in part.parameters.items()})
        for part in fit.recorded.parts)))
    assert find_kind(overflowing, pair) is None


def test_a_leak_shows_in_the_runs_that_have_it() -> None:
    gains, leaking = identified("a sixth").findings[0].gains, record("a sixth")[1]
    assert leaking.sum() == 5
    assert gains[leaking].min() > 10 * np.abs(gains[~leaking]).max()


def test_nothing_is_named_of_two_tanks_as_declared() -> None:
    answer = identified("none")
    assert not answer.findings
    assert not answer.set_aside
    assert not answer.unexplained


def test_a_law_that_few_runs_have_alone_is_named_beside_what_all_others_tell() -> None:
    """They are more than a tenth, and all others get to the levels at which it acts in these. What the others ask for
    is kept before, as a time budget may end."""
    kept = list[Identification]()
    answer = identify(prepare(TANKS, record("alone")[0]), keep=kept.append)
    assert [(each.findings, each.set_aside, each.apart) for each in kept] == [((), tuple(ALONE), None)]
    assert not answer.findings
    assert not answer.unexplained
    assert answer.set_aside == tuple(ALONE)
    assert answer.apart is not None
    assert [finding.pair for finding in answer.apart.findings] == [("leak 1", "level 1")]
    assert answer.apart.rows.tolist() == ALONE
    assert max(float(chi.max()) for fit in answer.apart.fits for chi in fit.chi_square.values()) < 1.3
    law = measure(answer.apart.fits[0], ("leak 1", "level 1"))
    np.testing.assert_allclose(law.change, 5e-4 * (1 - np.exp(-np.maximum(law.x - 0.2, 0.0) / 0.05)), atol=8e-5)


def test_runs_without_a_solution_beside_the_others_stay_set_aside(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> list[Fit]:
        raise InvalidValue("The equations have no finite solution", "Check the units")

    monkeypatch.setattr(selection, "fit_apart", fail)
    answer = identify(prepare(TANKS, record("alone")[0]))
    assert answer.set_aside == tuple(ALONE)
    assert answer.apart is None


def test_a_law_of_few_runs_may_not_be_fitted_to_different_errors_of_recordings() -> None:
    """The control: a drift, a spike and a late sensor have no law in common, as far as one may go with each."""
    runs = record("none")[0]
    signals = {name: value.copy() for name, value in runs.signals.items()}
    signals["level 1"][3] += 0.1 * TIME / TIME[-1]
    signals["level 2"][9, 80:90] += 0.2
    signals["level 1"][15, 10:] = signals["level 1"][15, :-10].copy()
    answer = identify(prepare(TANKS, replace(runs, signals=signals)))
    assert answer.set_aside == (3, 9, 15)
    assert answer.apart is None
    assert not answer.findings
    assert not answer.unexplained


@pytest.mark.slow
def test_an_offset_of_a_sensor_is_in_the_level_at_which_a_run_begins_and_named_alone() -> None:
    runs = record("none")[0]
    off = replace(runs, signals={**runs.signals, "level 2": runs.signals["level 2"] + 0.1})
    answer = identify(prepare(TANKS, off))
    assert [finding.pair for finding in answer.findings] == [("level 2 sensor", "offset")]
    assert not answer.findings[0].rivals
    kind = find_kind(answer.fits[-1], ("level 2 sensor", "offset"))
    assert kind is not None
    constant, = kind.coefficients
    assert (kind.name, constant.unit) == ("constant", "m")
    assert constant.lower < 0.1 < constant.upper < 0.11
    assert not answer.unexplained
    starts = next(place for place, term in enumerate(answer.fits[-1].recorded.random) if term.name == "start 2")
    assert abs(answer.fits[-1].means[starts]) < 0.3  # in cm


@pytest.fixture(scope="module")
def bare() -> Fit:
    return settle(prepare(TANKS, record("none")[0]), EngineSettings())[0]


@pytest.mark.parametrize("pair", [("leak 1", "level 1"), ("pump flow", "voltage"), ("outflow 2", "run order"),
                                  ("level 2 sensor", "gain"), ("level 1 sensor", "lag"), ("overflow", "offset"),
                                  ("pump flow", "past voltage")])
def test_a_law_does_not_lower_the_evidence_of_the_model_that_it_contains(bare: Fit, pair: tuple[str, str]) -> None:
    own = {name: model.own() for name, model in bare.models.items()}
    candidate = next(each for each in list_candidates(bare.recorded, own) if each.pair == pair)
    screened = screen(bare, [candidate], multiply(bare.models, [candidate]))[0]
    full = fit(bare.recorded, {pair: candidate}, {pair: screened.prior}, bare.state, bare.fitted.variance)
    assert screened.nats > -1
    assert bare.evidence - 1 < full.evidence < bare.evidence + 12


def vessel(name: str) -> Block:
    block = Block(name, gives=f"{name} level", reads=(f"{name} command",), states=(f"{name} level",),
                  parameters=(Parameter(f"{name} rate", value=0.2),
                              Parameter(f"{name} start", first_of=f"{name} level", scale=0.1, scatter=1, within=1)),
                  quantities=(Quantity(f"{name} leak", size=0.1),))
    block.rate(lambda x, u, q, p: (getattr(p, f"{name}_rate") * (getattr(u, f"{name}_command")
                                                                 - getattr(x, f"{name}_level"))
                                   - getattr(q, f"{name}_leak")))
    block.start(lambda u, q, p: getattr(p, f"{name}_start"))
    return block


def record_apart(leak: Callable[[np.ndarray], np.ndarray] = np.zeros_like, seed: int = 5) -> tuple[Machine, Runs]:
    """Two vessels and their recordings; the left one has a leak over its level."""
    rng, time, n, names = np.random.default_rng(seed), np.arange(0, 30, 0.25), 10, ("left", "right")
    signals, commands = {}, {}
    for name in names:
        profile = Profile(np.tile(np.linspace(0, 30, 7), (n, 1)), rng.uniform(0, 2, (n, 7)))
        command, level, levels = profile.at(time), rng.uniform(0.5, 1.5, n), []
        rates = 0.21 * (1 + 0.02 * rng.standard_normal(n))
        for j in range(len(time)):
            levels.append(level)
            for share in np.arange(20) / 20 if j + 1 < len(time) else ():
                level = level + 0.0125 * (rates * ((1 - share) * command[:, j] + share * command[:, j + 1] - level)
                                          - (leak(level) if name == "left" else 0))
        signals[f"{name} level"] = np.stack(levels, axis=1) + 0.01 * rng.standard_normal((n, len(time)))
        commands[f"{name} command"] = profile
    machine = Machine("apart", tuple(vessel(name) for name in names), tuple(Sensor(signal) for signal in signals),
                      commands=tuple(Command(command) for command in commands))
    return machine, Runs(time, signals, commands)


def test_groups_that_share_nothing_are_one_fit_or_several() -> None:
    whole = prepare(*record_apart())
    groups = whole.groups()
    assert [[part.name for part in group.parts] for group in groups] == [["left"], ["right"]]
    assert len(prepare(TANKS, record("none")[0]).groups()) == 1  # both tanks have the outlet of the first
    apart = [fit_bare(group) for group in groups]
    together, joined = fit_bare(whole), join(apart)
    assert joined.converged
    assert joined.evidence == pytest.approx(sum(each.evidence for each in apart), abs=1e-9)
    assert together.evidence == pytest.approx(joined.evidence, abs=0.1)
    # The joined model at its state is that of both: likelihood, coefficients of all and of each run, chi-squares.
    assert restricted_likelihood(joined.fitted.gram, joined.fitted.variance) == pytest.approx(
        sum(restricted_likelihood(each.fitted.gram, each.fitted.variance) for each in apart), abs=1e-6)
    names = [[term.name for term in (*each.recorded.random, *each.recorded.shared)] for each in (joined, *apart)]
    own = {name: value for each, listed in zip(apart, names[1:], strict=True)
           for name, value in zip(listed, each.fitted.coefficients, strict=True)}
    np.testing.assert_allclose(joined.fitted.coefficients, [own[name] for name in names[0]], atol=1e-9)
    np.testing.assert_allclose(joined.fitted.each, np.concatenate([each.fitted.each for each in apart], axis=1),
                               atol=1e-9)
    for each in apart:
        for name, chi in each.chi_square.items():
            np.testing.assert_allclose(joined.chi_square[name], chi, atol=1e-9)
            np.testing.assert_allclose(together.chi_square[name], chi, rtol=0.02)
    np.testing.assert_allclose(together.means, joined.means, atol=0.1 * np.sqrt(joined.fitted.variance).min())


def find_kind_of_leak(leak: Callable[[np.ndarray], np.ndarray], seed: int = 5) -> KindOfLaw | None:
    answer = identify(prepare(*record_apart(leak, seed)))
    assert [finding.pair for finding in answer.findings] == [("left leak", "left level")]
    return find_kind(next(each for each in answer.fits if each.laws), ("left leak", "left level"))


def find_errors(seed: int) -> list[float]:
    """The errors of slope and threshold of a leak above a threshold, in the standard errors that intervals tell."""
    kind = find_kind_of_leak(lambda level: 0.3 * np.maximum(level - 1.1, 0), seed)
    assert kind is not None
    assert kind.name == "above a threshold"
    assert [each.name for each in kind.coefficients] == ["slope", "threshold"]
    assert kind.coefficients[0].upper < 0.35
    return [(each.value - true) / (each.upper - each.value) * 1.96
            for each, true in zip(kind.coefficients, (0.3, 1.1), strict=True)]


@pytest.mark.slow
def test_a_law_of_a_known_kind_has_its_coefficients_within_their_intervals() -> None:
    assert np.abs(find_errors(5)).max() < 1.96


@pytest.mark.slow
def test_errors_of_coefficients_have_the_size_that_their_intervals_tell() -> None:
    spread = np.sqrt(np.mean(np.square([find_errors(seed) for seed in range(5, 11)]), axis=0))
    assert (spread > 0.3).all()  # by chi-square with 6 degrees of freedom, 0.3 % are below 0.3 and 0.1 % above 1.9
    assert (spread < 1.9).all()
