"""`slipstick.likelihood`: the closed form of a linear model, its methods, what it refuses, and a saved result."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

import slipstick
from slipstick.black_box import BlackBoxDescription, Cases, Measurements, Quantity
from slipstick.black_box.description import Input
from slipstick.errors import InvalidValue, OutsideTable, SlipstickError, UnknownName
from slipstick.interface.likelihood import Likelihood, likelihood
from slipstick.recordings import Recordings
from slipstick.table import Axis, Grid
from tests.benches import COMPACT, HEAVY, NOMINAL

SLOPES = np.array([[0.1, -0.05], [0.2, 0.1], [0.05, 0.3]])
MEAN, STD, NOISE = np.array([1.0, 1.1]), np.array([0.05, 0.04]), 0.006
EDGES = np.array([0.2, 1.0, 1.8])
CENTRE = 0.4 + SLOPES @ MEAN
SPREAD = np.sqrt(((SLOPES * STD) ** 2).sum(axis=1) + NOISE**2)
MEASURED = Recordings(HEAVY.conditions.take([0, 100, 215]), CENTRE + np.array([-1.0, 0.5, 2.5]) * SPREAD)


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """Shifting times that are linear in both axes, as the interpolation between its points is."""
    axes = (Axis("pressure_bias", EDGES, 1.6, "bar"), Axis("initial_position", EDGES, 5e-4, "m"))
    times = 0.4 + EDGES[:, None, None] * SLOPES[:, 0] + EDGES[None, :, None] * SLOPES[:, 1]
    grid = Grid(axes, times, np.zeros(times.shape, np.uint8), MEASURED.conditions, NOMINAL, "tests")
    return grid.save(tmp_path / "mine.h5")


@pytest.mark.parametrize("changes", [{}, {"method": "exact"}, {"method": "expansion", "order": 2},
                                     {"method": "sampling", "order": 2, "samples": 1 << 15}])
def test_a_linear_model_has_the_densities_of_its_closed_form(table: Path, changes: dict[str, Any]) -> None:
    result = likelihood(table, MEASURED, MEAN, STD, NOISE, **changes)
    expected = norm.logpdf(MEASURED.measured_time, CENTRE, SPREAD) / np.log(10) - 3  # per ms
    np.testing.assert_allclose(result.log10_density, expected, atol=0.02)
    assert result.log10_likelihood == pytest.approx(expected.sum(), abs=0.02)
    assert result.error is not None
    assert abs(result.log10_likelihood - expected.sum()) <= result.error
    wrong = likelihood(table, MEASURED, MEAN - 0.05, STD, NOISE, **changes)
    assert wrong.log10_likelihood < result.log10_likelihood - 0.1


def test_the_seed_is_that_of_the_runs_of_a_regression(table: Path) -> None:
    """Whose clipped model has kinks, so that the expansion depends on where it is run."""
    first, same, other = (likelihood(table, MEASURED, MEAN, [0.5, 0.5], NOISE, method="expansion", rule="regression",
                                     seed=seed).log10_likelihood for seed in (1, 1, 2))
    assert first == same != other


def test_dependent_inputs_have_the_spread_of_their_covariance(table: Path) -> None:
    mixing = np.array([[0.05, 0.0], [0.03, 0.02]])
    spread = np.sqrt(((SLOPES @ mixing) ** 2).sum(axis=1) + NOISE**2)
    result = likelihood(table, MEASURED, MEAN, mixing=mixing, output_std=NOISE)
    expected = norm.logpdf(MEASURED.measured_time, CENTRE, spread) / np.log(10) - 3
    np.testing.assert_allclose(result.log10_density, expected, atol=5e-3)


def test_measurements_of_another_machine_are_taken_in_their_unit(tmp_path: Path) -> None:
    machine = BlackBoxDescription("Spring", (Input("stiffness", "N/m", 100.0, 0.5, 1.5),), (Quantity("load", "N"),),
                                  Quantity("travel", "mm"), "")
    cases = Cases(machine.columns, np.array([[1.0], [2.0]]))
    grid = Grid((Axis("stiffness", np.array([0.5, 1.5]), 100.0, "N/m"),), np.array([[3.0, 6.0], [1.0, 2.0]]),
                np.zeros((2, 2), np.uint8), cases, machine, "tests")
    measured = Measurements(cases, np.array([2.1, 3.9]), machine.output)
    result = likelihood(grid, measured, 1.0, 0.1, 0.05)
    expected = norm.logpdf([2.1, 3.9], [2, 4], np.hypot([0.2, 0.4], 0.05)) / np.log(10) - 3
    np.testing.assert_allclose(result.log10_density, expected, atol=5e-3)
    assert list(result.columns) == ["condition", "load [N]", "travel [mm]", "log10_density"]
    assert "per 0.001 mm" in result.summary()[0]
    for name, content in (("a.csv", b"load [N],travel [m]\n1,0.0021\n2,0.0039\n"), ("a.h5", measured.to_bytes())):
        (tmp_path / name).write_bytes(content)
        assert likelihood(grid, tmp_path / name, 1.0, 0.1, 0.05).log10_likelihood == pytest.approx(
            result.log10_likelihood, rel=1e-12)
    with pytest.raises(UnknownName, match=r"There is no file of measurements 'b.csv'\. .*Known: a.csv, a.h5"):
        likelihood(grid, str(tmp_path / "b.csv"), 1.0, 0.1, 0.05)
    with pytest.raises(InvalidValue, match=r"The measurements are of way \[m\]"):
        likelihood(grid, Measurements(cases, measured.measured_time, Quantity("way", "m")), 1.0, 0.1, 0.05)
    with pytest.raises(InvalidValue, match=r"travel is 3900 mm in the median .*Check the unit of the measured travel"):
        likelihood(grid, Measurements(cases, 1e3 * measured.measured_time, machine.output), 1.0, 0.1, 0.05)


@pytest.mark.parametrize(("given", "message"), [
    ({"output_std": None}, "The output noise is not given. Give as `output_std`"),
    ({"output_std": 0.0}, "The output std is 0.0"),
    ({"output_std": 1e300}, r"The output std is 1e\+300\. Give a number from 1e-100 to 1e\+100"),
    ({"output_std": 1e-20}, "less than the rounding errors"),
    ({"mean": [1.0]}, "`mean` has 1 entries, but the table has 2 axes"), ({"std": None}, "either the std or"),
    ({"method": "cake"}, "no method 'cake'.*Known: auto, exact, expansion, sampling"),
    ({"outside": "cake"}, "Known: clip, error, nan"), ({"lines": 100}, "number of lines, 100, is not a power of two"),
    ({"lines": 8}, "The number of lines is 8. Give 16 to 1024"), ({"samples": 1000}, "not a power of two"),
    ({"method": "sampling", "samples": 1 << 46}, "70368744177664 samples are too many. Take at most"),
    ({"seed": -1}, "The seed is -1"), ({"method": "expansion", "order": 99}, "no expansion of order 99"),
    ({"recordings": HEAVY}, "The Bench is not recordings"),
    ({"recordings": Recordings(COMPACT.conditions.take([0]), np.array([0.4]))},
     "Condition 0 .* is not in the table. Build a table under the conditions of these recordings"),
    ({"recordings": Recordings(MEASURED.conditions, 1e-3 * MEASURED.measured_time)},
     "shifting time is .* s in the median of 3 conditions, and still .*Check the unit of the measured shifting time"),
    ({"table": HEAVY}, "The Bench is not a table"),
])
def test_what_has_no_likelihood_is_refused(table: Path, given: dict[str, Any], message: str) -> None:
    complete: dict[str, Any] = {"table": table, "recordings": MEASURED, "mean": MEAN, "std": STD, "output_std": NOISE}
    assert np.isfinite(likelihood(**complete).log10_likelihood)
    with pytest.raises(SlipstickError, match=message):
        likelihood(**{**complete, **given})


def test_what_is_outside_the_table_is_clipped_missing_or_refused(table: Path) -> None:
    beyond = {"mean": [1.7, 1.0], "std": [0.1, 0.05], "output_std": 0.05}
    clipped, missing = (likelihood(table, MEASURED, **beyond, outside=outside) for outside in ("clip", "nan"))
    assert missing.log10_likelihood < clipped.log10_likelihood
    assert clipped.mass_outside == pytest.approx(norm.sf(1), abs=1e-4)
    assert "15.9 % of the inputs lie outside the table" in clipped.summary()[-1]
    assert "outside" not in likelihood(table, MEASURED, MEAN, STD, NOISE).summary()[-1]
    with pytest.raises(OutsideTable, match="pressure_bias"):
        likelihood(table, MEASURED, **beyond, outside="error")


def test_the_result_is_saved_opened_and_tabulated(table: Path, tmp_path: Path) -> None:
    result = likelihood(table, MEASURED, MEAN, STD, NOISE, name="mine")
    again = slipstick.open_result(result.save(tmp_path / "result.json"))
    assert isinstance(again, Likelihood)
    assert again.to_dict() == result.to_dict()
    assert repr(again) == repr(result)
    frame = result.to_frame()
    assert list(frame)[-2:] == ["shifting_time [s]", "log10_density"]
    assert frame["log10_density"].sum() == pytest.approx(result.log10_likelihood)
    assert frame["shifting_time [s]"].tolist() == MEASURED.measured_time.tolist()
    least = result.summary()[2]
    assert least.startswith("Least likely: measurement 2 (profile 5, motor 199 rad/s")
    assert f"{result.log10_density[2]:.2f}".replace("-", "−") in least
    with pytest.raises(InvalidValue, match="There is no picture of this likelihood"):
        result.plot()
    assert result._repr_html_().startswith("<p>")
    partial = {name: value for name, value in result.to_dict().items() if name != "measured_time"}
    with pytest.raises(InvalidValue, match="has no `measured_time`"):
        Likelihood.from_dict(partial)
