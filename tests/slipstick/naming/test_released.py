"""A parameter that is not what the bench states is told as such, and not as a law that resembles it."""

import numpy as np
import pytest

import slipstick
from slipstick.bench import parameters
from slipstick.clutch.model import Model
from slipstick.confirmation.simulated import SimulatedBench
from slipstick.confirmation.terms import Terms
from slipstick.confirmation.traces import Traces
from slipstick.naming.fit import fit
from slipstick.naming.load import LoadBlock
from slipstick.naming.released import VALUE, Released, contest, find_beyond, release
from slipstick.naming.selection import Finding, Rival
from slipstick.naming.settings import NamingSettings
from slipstick.naming.study import name
from slipstick.recordings import Recordings
from slipstick.studies.confidence import confidence, evidence_of
from tests.benches import HEAVY
from tests.slipstick.naming.engagements import scene_of

DRAG = "load torque", "output speed"


def record(count: int = 24, **factors: float) -> Recordings:
    """Recordings of a bench whose parameters are other ones by these factors."""
    model = Model(HEAVY.physics)
    values = {each: model.parameters[parameters.index(each)] * factor for each, factor in factors.items()}
    return scene_of(HEAVY, model.with_parameters(values), count, seed=3).recordings


@pytest.mark.slow
def test_an_inertia_that_is_not_what_is_stated_is_no_law() -> None:
    named = name(HEAVY, record(input_inertia=1.35))
    assert not named.findings
    assert not named.lacking
    (parameter, (change, error)), = named.beyond.items()
    assert parameter == "input_inertia"
    assert change == pytest.approx(0.35, abs=max(4 * error, 0.01))
    assert error < 0.01


@pytest.mark.slow
def test_a_value_that_a_law_does_not_lead_is_its_rival() -> None:
    """A friction that is larger by a factor is a torque over the speed."""
    finding, = name(HEAVY, record(output_viscous=1.5)).findings
    assert finding.pair == DRAG
    assert (finding.rivals[-1].pair[1], finding.rivals[-1].pair[0]) == (
        VALUE, "viscous friction of the output shaft")
    assert confidence(evidence_of(finding, [finding])) < 0.7 < confidence(evidence_of(
        Finding(finding.blocks, finding.pair, finding.gain, expected=finding.expected), [finding]))


@pytest.mark.parametrize(("value", "rivals", "is_named"), [(0.1, 0, True), (1.0, 1, True), (3.0, 0, False)])
def test_what_a_value_gains_decides(value: float, rivals: int, is_named: bool) -> None:
    gain = np.full(24, 5.0)
    finding = Finding(("load",), DRAG, gain, next_best=Rival(("load torque", "time"), 4.0, 9.0))
    bare = fit(LoadBlock(scene_of(HEAVY, Model(HEAVY.physics), 24, seed=3)))
    released = release({"load": bare}, ["load"])
    assert released is not None
    assert not find_beyond(released.fits, NamingSettings())  # it is what is stated
    contested = contest(finding, Released(released.fits, value * gain), NamingSettings())
    assert (contested is not None) == is_named
    if contested is not None:
        assert len(contested.rivals) == rivals
        assert (contested.lead < 1) == bool(rivals)
    assert release(released.fits, ["load"]) is None


def test_the_simulation_frees_what_is_beyond() -> None:
    scene = scene_of(HEAVY, Model(HEAVY.physics), 24, seed=3)
    kept, freed = (SimulatedBench(Traces.of(scene, {}, HEAVY.physics.curves, freed=names), Terms(HEAVY))
                   for names in ((), ("input_inertia",)))
    place = freed.random.index("input_inertia")
    assert kept.random_std[place] < 1 < freed.random_std[place]
    np.testing.assert_array_equal(np.delete(kept.random_std, place), np.delete(freed.random_std, place))


@pytest.mark.slow
def test_a_study_corrects_the_bench() -> None:
    study = slipstick.study(HEAVY, record(36, input_inertia=1.35), progress=False)
    assert study.result.kind == "none"
    assert study.result.sentence.endswith("The inertia of the input shaft is 35.1 % larger than the bench states")
    assert study.result.after is not None
    right = 1.35 * HEAVY.physics.nominal[parameters.index("input_inertia")]
    assert study.result.after.model["parameters"]["input_inertia"] == pytest.approx(right, rel=0.01)
