"""Identification on a vessel that drains, simulated by scipy: what is missing is named, and nothing else."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ndtri

from slipstick.engine import bases
from slipstick.engine.evidence import agree, hold_out
from slipstick.engine.fit import fit, join
from slipstick.engine.laws import list_candidates
from slipstick.engine.linear_model import estimate, solve
from slipstick.engine.measured_law import measure
from slipstick.engine.preparation import prepare
from slipstick.engine.priors import Prior
from slipstick.engine.recordings import Recorded
from slipstick.engine.selection import Identification, Lead, _Search, identify, is_rival
from slipstick.engine.settings import EngineSettings
from slipstick.engine.settling import is_unexplained, settle, temper
from slipstick.engine.simulation import simulate
from slipstick.engine.study import MachineStudy, _compare, study
from slipstick.machine import Block, Command, Machine, Parameter, Profile, Quantity, Runs, Sensor
from slipstick.machine.digest import digest
from slipstick.machine.kinds import KINDS
from slipstick.machine.whole import compose

RUNS, TIME, NOISE = 24, np.linspace(0, 100, 201), 0.004
INFLOW, OUTLET, AREA = 1e-3, 8e-3, 0.05


def declare() -> Machine:
    vessel = Block("vessel", gives="level", reads=("command",), states=("level",), lowest={"level": 0.0},
                   parameters=(Parameter("inflow", value=INFLOW), Parameter("outlet", value=OUTLET),
                               Parameter("start", first_of="level", scale=0.01, scatter=2.0, within=2.0)),
                   quantities=(Quantity("leak", "m^3/s", size=1e-3), Quantity("outflow", relative=True)))
    vessel.rate(lambda x, u, q, p: (p.inflow * u.command - p.outlet * (1 + q.outflow) * np.sqrt(np.maximum(x.level, 0))
                                    - q.leak) / AREA)
    vessel.start(lambda u, q, p: p.start)
    return Machine("vessel", (vessel,), (Sensor("level", "m"),), commands=(Command("command", "V"),))


def leak_of(level: np.ndarray) -> np.ndarray:
    """What leaves around a level of 0.45 m, in m^3/s: no error of the sensor looks like it."""
    return np.asarray(4e-4 * np.exp(-((level - 0.45) / 0.06) ** 2))


def record(leaks: np.ndarray, noise: np.ndarray, seed: int = 3) -> Runs:
    """Runs with a share (n,) of the leak, and a factor (n,) of the noise."""
    rng = np.random.default_rng(seed)
    command = Profile(np.tile([0.0, 30, 35, 65, 70, 100], (RUNS, 1)), rng.uniform(2, 9, (RUNS, 6)))
    inflow, outlet = INFLOW * rng.normal(1.03, 0.01, RUNS), OUTLET * rng.normal(0.98, 0.01, RUNS)

    def rate(t: float, x: np.ndarray) -> np.ndarray:
        level = np.maximum(x, 0.0)
        given, lost = inflow * command.at(np.array([t]))[:, 0], outlet * np.sqrt(level) + leaks * leak_of(level)
        return np.asarray((given - lost) / AREA)

    solved = solve_ivp(rate, (0, 100), rng.uniform(0.2, 0.5, RUNS), t_eval=TIME, max_step=1.0, rtol=1e-8, atol=1e-10)
    levels = solved.y + NOISE * noise[:, None] * rng.standard_normal(solved.y.shape)
    return Runs(TIME, {"level": levels}, {"command": command}, order=rng.permutation(RUNS).astype(float))


ONES = np.ones(RUNS)


def test_a_block_on_which_no_law_was_tried_alone_stays_open_where_one_of_two_blocks_is_not_named(
        monkeypatch: pytest.MonkeyPatch) -> None:
    scale = Block("scale", gives="weight", reads=("level",), parameters=(Parameter("density", value=2.0),),
                  quantities=(Quantity("push", "kg"),))
    scale.output(lambda x, u, q, p: p.density * u.level + q.push)
    machine = replace(declare(), blocks=(*declare().blocks, scale),
                      sensors=(*declare().sensors, Sensor("weight", "kg")))
    runs = record(0 * ONES, ONES)
    weight = 2 * runs.signals["level"] + 0.02 * np.random.default_rng(1).standard_normal((RUNS, len(TIME)))
    said, settings = list[str](), EngineSettings()
    fits = settle(prepare(machine, replace(runs, signals={**runs.signals, "weight": weight})), settings)
    search = _Search(settings, lambda doing: said.append(doing.words),
                     {tuple(part.name for part in each.recorded.parts): each for each in fits})
    ranked = search._rank()
    of_both = next(each for each in ranked if len(each.candidate.variables) == 2)
    of_last = next(each for each in ranked if set(each.candidate.variables) == {"scale"})
    monkeypatch.setattr(search, "_is_enough", lambda trial: False)
    monkeypatch.setattr(search, "_rank", lambda: [replace(of_both, nats=100.0), replace(of_last, nats=90.0)])
    assert search.step()
    assert search.closed == {("scale",)}
    assert said[-1].endswith("standard errors, which is too little")
    monkeypatch.setattr(search, "_rank", lambda: [replace(of_both, nats=100.0)])
    assert search.step()
    assert search.closed == {("vessel",), ("scale",)}


@pytest.fixture(scope="module")
def studied() -> MachineStudy:
    return study(declare(), record(ONES, ONES))


@pytest.fixture(scope="module")
def leaking(studied: MachineStudy) -> Identification:
    return studied.identification


@pytest.fixture(scope="module")
def tight() -> Recorded:
    return prepare(declare(), record(0 * ONES, ONES))


def test_a_leak_over_the_level_is_named_first_and_alone(leaking: Identification) -> None:
    assert len(leaking.findings) == 1
    finding = leaking.findings[0]
    assert ("leak", "level") in (finding.pair, *finding.rivals)  # an outlet that depends on the level is the same
    assert finding.nats > 50
    assert not leaking.unexplained


def test_a_part_that_leaves_no_more_than_noise_has_no_more_noise(leaking: Identification) -> None:
    """What it has left without a law counted as noise, and a little of that may be there still."""
    fitted, settings = leaking.fits[0], EngineSettings()
    part, = fitted.recorded.parts
    hotter = replace(fitted.recorded, parts=(replace(part, temper=1.15 * part.temper),))
    part, = temper(fitted.again(hotter), settings).recorded.parts
    assert (part.temper == 1).all()


def test_the_measured_law_is_the_hidden_one_up_to_what_parameters_replace(leaking: Identification) -> None:
    law = measure(leaking.fits[0], leaking.findings[0].pair)
    inner = (law.x > 0.3) & (law.x < np.quantile(law.x, 0.8))
    share = np.sqrt(law.x) * OUTLET if law.pair[0] == "outflow" else 1.0
    hidden = leak_of(law.x)
    # Parameters of inflow and outlet replace a constant and a square root.
    free = np.column_stack([np.ones(inner.sum()), np.sqrt(law.x[inner])])
    off = (law.change * share - hidden)[inner]
    off -= free @ np.linalg.lstsq(free, off, rcond=None)[0]
    assert np.sqrt(np.mean(off**2)) < 0.15 * np.ptp(hidden)


def test_nothing_is_named_where_nothing_is_missing(tight: Recorded) -> None:
    answer = identify(tight)
    assert not answer.findings
    assert not answer.unexplained
    assert not answer.set_aside


def test_loud_runs_stay_and_bad_runs_are_set_aside() -> None:
    runs = record(0 * ONES, np.where(np.arange(RUNS) % 2 == 0, 2.0, 1.0))
    runs.signals["level"][5, 60:] += 0.3
    answer = identify(prepare(declare(), runs))
    assert answer.set_aside == (5,)
    assert not answer.findings
    loudness = answer.fits[0].recorded.parts[0].loudness[:, 0]
    rows = answer.fits[0].recorded.rows
    assert np.median(loudness[rows % 2 == 0]) / np.median(loudness[rows % 2 == 1]) == pytest.approx(2, rel=0.15)


@pytest.mark.parametrize("is_held", [False, True])
def test_held_out_densities_are_those_of_fits_without_the_run(leaking: Identification, is_held: bool) -> None:
    """At fixed variances and linearisation: the density of all, less that of all others."""
    fitted = leaking.fits[0].fitted
    if is_held:  # the recordings would take a coefficient 10 standard deviations from its target
        precision = fitted.gram.precision.copy()
        off = fitted.coefficients[0] - fitted.gram.target[0]
        precision[0] = max(2.0, (10 / off) ** 2)
        gram = replace(fitted.gram, precision=precision, target=np.where(
            np.arange(len(precision)) == 0, fitted.coefficients - 10 / np.sqrt(precision), fitted.gram.target))
        fitted = estimate(gram, fitted.variance, fixed=True)
    total = fitted.marginal.sum(axis=0)
    held = solve(fitted.gram, total)
    assert (held.precision > fitted.gram.precision).any() == is_held
    gram = replace(fitted.gram, precision=held.precision, target=held.target)

    def density(products: np.ndarray, logdet: float) -> float:
        solved = solve(gram, products)
        left = np.append(-solved.coefficients, 1.0)
        off = solved.coefficients - solved.target
        return float(-0.5 * (left @ products @ left + solved.precision @ off**2 + logdet
                             - np.linalg.slogdet(solved.covariance)[1]))

    exact = [density(total, fitted.logdet.sum()) - density(total - own, fitted.logdet.sum() - logdet)
             for own, logdet in zip(fitted.marginal, fitted.logdet, strict=True)]
    np.testing.assert_allclose(hold_out(fitted), exact, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize(("gains", "expected", "agrees"), [
    (np.full(40, 2.0), np.full(40, 2.0), True), (np.r_[1000.0, np.full(39, -0.1)], np.full(40, 2.0), False),
    (np.r_[np.full(4, 8.0), np.zeros(36)], np.r_[np.full(4, 4.0), np.full(36, 0.01)], True),
    (np.r_[-8.0, 8.0, -8.0, 8.0, np.zeros(36)], np.r_[np.full(4, 4.0), np.full(36, 0.01)], False),
    (np.r_[160.0, np.full(39, 200.0)], np.r_[3400.0, np.full(39, 40.0)], True)])
def test_runs_agree_where_the_law_acts(gains: np.ndarray, expected: np.ndarray, agrees: bool) -> None:
    noisy = gains + 0.2 * np.random.default_rng(1).standard_normal(len(gains))
    assert (agree(noisy, expected) > EngineSettings().errors) == agrees


@pytest.mark.parametrize(("nats", "errors", "is_so"), [
    (99.0, 1.0, True), (90.0, 1.0, True), (90.0, 3.0, False), (99.9, 3.0, True), (11.0, 1.0, False)])
def test_a_rival_is_not_far_behind_in_errors_or_in_nats(nats: float, errors: float, is_so: bool) -> None:
    """Where all runs agree that it is behind by nearly nothing, it may be right as well."""
    assert is_rival(Lead(("leak", "level"), nats, errors), 100.0, EngineSettings()) == is_so


def test_a_law_of_no_size_changes_nothing(tight: Recorded) -> None:
    bare = settle(tight, EngineSettings())[0]
    assert join([bare]) is bare
    own = {part.name: bare.models[part.name].own() for part in bare.recorded.parts}
    candidate = next(each for each in list_candidates(bare.recorded, own) if each.pair == ("leak", "level"))
    kept = Prior(amplitude=1e-9, length=5.0)  # priors of curves do not change
    nested = fit(bare.recorded, {candidate.pair: candidate}, {candidate.pair: kept}, bare.state, bare.fitted.variance)
    assert nested.evidence == pytest.approx(bare.evidence, abs=0.3)


def test_the_whole_machine_confirms_the_law_and_not_the_control(studied: MachineStudy) -> None:
    confirmation = studied.confirmation
    assert confirmation is not None
    assert confirmation.gap.without > 500
    closed, by_control = confirmation.gap.closed, confirmation.control_gap.closed
    assert closed is not None
    assert by_control is not None
    assert by_control < 0.3 < 0.9 < closed
    for converged, share, is_known in ((False, 0.001, True), (False, 0.01, False), (True, 0.01, True)):
        further = replace(confirmation.fit, converged=converged, promised=0.5 * share * confirmation.gap.without)
        assert (_compare(confirmation.gap.without, confirmation.bare, further).closed is not None) == is_known
    inflow = next(each for each in studied.parameters if each.name == "inflow")
    assert abs(inflow.mean - 1.03 * INFLOW) < 4 * inflow.error + 0.02 * INFLOW
    assert studied.digest == digest(EngineSettings(), declare(), KINDS)


def test_a_law_of_no_known_kind_stays_a_measured_law(studied: MachineStudy) -> None:
    assert studied.findings
    assert not studied.kinds


def test_the_extended_machine_simulates_with_its_laws(studied: MachineStudy) -> None:
    runs = record(ONES, 0 * ONES)
    start = runs.signals["level"][:, 0]
    plain = simulate(studied.machine, TIME, runs.commands,
                     {"inflow": 1.03 * INFLOW, "outlet": 0.98 * OUTLET, "start": start})["level"]
    extended = studied.simulate(TIME, runs.commands, {"start": start})["level"]
    off = [float(np.sqrt(np.mean((signal - runs.signals["level"]) ** 2))) for signal in (plain, extended)]
    assert off[1] < 0.7 * off[0]  # the scatter between runs is left


def test_the_whole_of_one_block_is_that_block() -> None:
    whole = compose(declare()).blocks[0]
    assert whole.signals == ("level",)
    assert whole.states == ("level",)


def test_a_second_process_compiles_nothing() -> None:
    """Declared functions are never compiled, and the engine's own kernels are kept from process to process."""
    bases.play(np.zeros((1, 5)), 1.0)
    bases.lag(np.zeros((1, 5)), 2.0)
    code = ("import slipstick.engine.bases as bases, numpy as np\n"
            "bases.play(np.zeros((1, 5)), 1.0); bases.lag(np.zeros((1, 5)), 2.0)\n"
            "print(sum(sum(s.cache_misses.values()) for s in (bases.play.stats, bases.weigh_lags.stats)))")
    again = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert int(again.stdout) == 0


def test_runs_that_differ_much_do_not_hide_that_more_than_noise_is_left() -> None:
    normal = ndtri((np.arange(87) + 0.5) / 87)
    noise, left = np.exp(0.15 * normal), np.exp(1.0 + 1.7 * normal)
    spread = left.std(ddof=1) / np.sqrt(len(left))
    assert left.mean() - 1 < EngineSettings().errors * spread  # in the mean, it would not show
    assert is_unexplained(left, EngineSettings())
    assert not is_unexplained(noise, EngineSettings())


def test_blocks_that_have_a_parameter_of_all_runs_in_common_are_fitted_together() -> None:
    common = Parameter("gain", value=2.0, scatter=0.0)
    machine = Machine("pair", tuple(
        Block(name, gives=name, reads=("command",), states=(name,), parameters=(common,),
              rate_function=lambda x, u, q, p, name=name: p.gain * u.command - getattr(x, name))
        for name in ("left", "right")), (Sensor("left"), Sensor("right")), commands=(Command("command"),))
    time = np.linspace(0, 5, 101)
    driven = Profile(np.tile([0.0, 5.0], (6, 1)), np.tile([0.0, 1.0], (6, 1)))
    ideal = simulate(machine, time, {"command": driven}, {"gain": 2.0})
    rng = np.random.default_rng(0)
    runs = Runs(time, {name: signal + 0.01 * rng.normal(size=signal.shape) for name, signal in ideal.items()},
                {"command": driven}, {}, {}, None, {}, "pair", "")
    gain, = study(machine, runs).parameters
    assert gain.mean == pytest.approx(2.0, abs=4 * gain.error)
