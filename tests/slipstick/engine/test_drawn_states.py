"""States that may come to rest are drawn to what their sensors read, so that a fit finds its way from afar."""

import numpy as np
import pytest

from slipstick.engine.fit import Fit, begin
from slipstick.engine.model import build_part
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Recorded
from slipstick.engine.settling import fit_bare
from slipstick.machine import Block, Command, Machine, Parameter, Profile, Runs, Sensor

RUNS, TIME, DRY, NOISE = 12, np.linspace(0, 2, 201), 0.5, 2e-3


def declare() -> Machine:
    slide = Block("slide", gives="pace", reads=("force",), states=("pace",), switches=("pace",),
                  parameters=(Parameter("dry", value=1.0, scatter=0.05),))
    slide.rate(lambda x, u, q, p: u.force - p.dry * x.pace_side)
    return Machine("slide", (slide,), (Sensor("pace"),), commands=(Command("force"),))


def record(is_free: bool) -> Recorded:
    """A slide that constant forces move in closed form; with the stated friction it would rest."""
    rng = np.random.default_rng(2)
    force = rng.uniform(0.7, 0.95, RUNS)
    pace = (force - DRY)[:, None] * TIME + NOISE * rng.standard_normal((RUNS, len(TIME)))
    profile = Profile(np.tile(TIME[[0, -1]], (RUNS, 1)), np.repeat(force[:, None], 2, axis=1))
    return prepare(declare(), Runs(TIME, {"pace": pace}, {"force": profile}), is_free=is_free)


def estimate_dry(fitted: Fit) -> float:
    return float(np.exp(fitted.means[0]))


def test_a_slide_that_would_rest_is_drawn_along_and_its_friction_found() -> None:
    fitted = fit_bare(record(is_free=False))
    assert fitted.converged
    assert estimate_dry(fitted) == pytest.approx(DRY, abs=0.01)


def test_a_free_slide_rests_and_has_no_slope_that_would_tell_why() -> None:
    recorded = record(is_free=True)
    model = build_part(recorded, recorded.parts[0], begin(recorded), {})
    assert np.abs(model.predicted).max() == 0
    assert estimate_dry(fit_bare(recorded)) > 0.9


def record_places() -> Recorded:
    """The same slide, of which a sensor reads the place alone."""
    rng = np.random.default_rng(3)
    force = rng.uniform(0.7, 0.95, RUNS)
    place = 0.5 * (force - DRY)[:, None] * TIME**2 + 1e-3 * rng.standard_normal((RUNS, len(TIME)))
    slide = Block("slide", gives="place", reads=("force",), states=("place", "pace"), switches=("pace",),
                  parameters=(Parameter("dry", value=1.0, scatter=0.05),))
    slide.rate(lambda x, u, q, p: (2 * x.pace / 2, u.force - p.dry * x.pace_side))
    machine = Machine("slide", (slide,), (Sensor("place"),), commands=(Command("force"),))
    profile = Profile(np.tile(TIME[[0, -1]], (RUNS, 1)), np.repeat(force[:, None], 2, axis=1))
    return prepare(machine, Runs(TIME, {"place": place}, {"force": profile}))


def test_a_pace_that_is_not_measured_is_drawn_through_the_place() -> None:
    fitted = fit_bare(record_places())
    assert list(fitted.recorded.parts[0].drawn) == ["place"]
    assert fitted.converged
    assert estimate_dry(fitted) == pytest.approx(DRY, abs=0.01)
