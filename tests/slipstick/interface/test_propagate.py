"""`slipstick.propagate`: closed forms, plain Monte Carlo, what it refuses, and a result that is saved and drawn."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

import slipstick
from slipstick.bench import parameters
from slipstick.black_box import BlackBoxDescription, Cases, Quantity
from slipstick.black_box.description import Input
from slipstick.errors import InvalidValue, OutsideTable, SlipstickError
from slipstick.interface.propagate import Propagation, propagate
from slipstick.pictures.propagation import MOST
from slipstick.table import Axis, Grid, Table
from slipstick.uncertainty.chaos import ORDER, default_order
from tests.benches import HEAVY, NOMINAL

SLOPES = np.array([[0.2, -0.1], [0.3, 0.4], [0.0, 0.5]])
"""Of the times of three conditions in both axes, in s."""
MEAN, STD, NOISE = np.array([1.0, 1.1]), np.array([0.05, 0.04]), 0.004


def linear_table(conditions: int = 3) -> Grid:
    """Shifting times that are linear in both axes, as the interpolation between its points is."""
    edges = np.array([0.5, 1.0, 1.5])
    axes = (Axis("pressure_bias", edges, 1.6, "bar"), Axis("initial_position", edges, 5e-4, "m"))
    slopes = np.resize(SLOPES, (conditions, 2))
    times = 1.0 + edges[:, None, None] * slopes[:, 0] + edges[None, :, None] * slopes[:, 1]
    taken = HEAVY.conditions.take(range(conditions))
    return Grid(axes, times, np.zeros(times.shape, np.uint8), taken, NOMINAL, "tests")


def linear(**changes: Any) -> Propagation:
    return propagate(linear_table(), **{"mean": MEAN, "std": STD, "output_std": NOISE, **changes})


def test_a_linear_model_has_the_moments_quantiles_and_shares_of_its_closed_form() -> None:
    result = linear(order=2, samples=1 << 14)
    variances = (SLOPES * STD) ** 2
    std = np.sqrt(variances.sum(axis=1) + NOISE**2)
    mean = 1.0 + SLOPES @ MEAN
    np.testing.assert_allclose(result.mean, mean, rtol=1e-12)
    np.testing.assert_allclose(result.std, std, rtol=1e-10)
    assert result.first_order is not None
    np.testing.assert_allclose(result.first_order, variances / variances.sum(axis=1)[:, None], atol=1e-9)
    np.testing.assert_allclose(result.total, result.first_order, atol=1e-9)
    np.testing.assert_allclose(result.quantiles, mean[:, None] + std[:, None] * norm.ppf([0.05, 0.5, 0.95]),
                               atol=0.02 * std.max())
    assert result.density is not None
    assert result.density_time is not None
    np.testing.assert_allclose(result.density, norm.pdf(result.density_time, mean[:, None], std[:, None]) / 1e3,
                               atol=2e-3 * result.density.max())
    np.testing.assert_allclose(result.error, 0, atol=1e-12)
    assert (result.order, result.runs, result.reached) == (2, 9 + 16, None)
    assert result.inputs == ("pressure_bias", "initial_position")


def test_one_axis_takes_plain_numbers() -> None:
    axis = Axis("pressure_bias", np.array([0.5, 1.5]), 1.6, "bar")
    times, condition = np.array([[1.0], [2.0]]), HEAVY.conditions.take([0])
    table = Grid((axis,), times, np.zeros((2, 1), np.uint8), condition, NOMINAL, "tests")
    result = propagate(table, 1.1, 0.05, families="uniform")
    np.testing.assert_allclose((result.mean, result.std), ([1.6], [np.hypot(0.05, 0.003)]), rtol=1e-9)
    assert propagate(table, 1.1, mixing=0.05).std == pytest.approx(result.std)


def test_it_agrees_with_plain_monte_carlo(shelf: Path) -> None:
    """Of a simulated table, with samples of NumPy; the same samples do not agree with narrower inputs."""
    result = propagate(shelf / "nominal.h5", [1.0, 1.05], [0.08, 0.06], families=["gamma", "normal"],
                       conditions=[0, 100, 215], output_std=0.005)
    narrower = propagate(shelf / "nominal.h5", [1.0, 1.05], [0.07, 0.06], families=["gamma", "normal"],
                         conditions=[0, 100, 215], output_std=0.005)
    rng, count = np.random.default_rng(5), 100_000
    points = np.column_stack([rng.gamma((1 / 0.08) ** 2, 0.08**2, count), rng.normal(1.05, 0.06, count)])
    table = Table.open(shelf / "nominal.h5")
    times = table.restricted(table.conditions.take([0, 100, 215])).interpolate(points)
    times += rng.normal(0, 0.005, times.shape)
    np.testing.assert_allclose(result.mean, times.mean(axis=0), atol=3e-4)
    np.testing.assert_allclose(result.std, times.std(axis=0), rtol=0.02)
    np.testing.assert_allclose(result.quantiles.T, np.quantile(times, [0.05, 0.5, 0.95], axis=0), atol=2e-3)
    assert not np.allclose(narrower.std, times.std(axis=0), rtol=0.02)


def test_seven_inputs_have_an_expansion_that_is_not_too_large_by_default() -> None:
    """As many as the paper leaves uncertain: linear, so that the closed form holds."""
    axes = tuple(Axis(name, np.array([0.0, 2.0]), 1.0, "1") for name in parameters.NAMES[:7])
    slopes = np.arange(1.0, 8.0) / 10
    times = 1.0 + sum(slope * axis for slope, axis in zip(
        slopes, np.meshgrid(*(axis.values for axis in axes), indexing="ij"), strict=True))[..., None]
    table = Grid(axes, times, np.zeros(times.shape, np.uint8), HEAVY.conditions.take([0]), NOMINAL, "tests")
    result = propagate(table, [1.0] * 7, [0.05] * 7)
    assert result.std[0] == pytest.approx(np.sqrt(0.05**2 * (slopes**2).sum() + 0.003**2), rel=1e-6)
    assert result.first_order is not None
    np.testing.assert_allclose(result.first_order[0], slopes**2 / (slopes**2).sum(), atol=1e-6)
    assert result.order == default_order(7) < default_order(5) == default_order(1) == ORDER
    with pytest.raises(InvalidValue, match="more than 2000 terms"):
        propagate(table, [1.0] * 7, [0.05] * 7, order=ORDER)


def test_dependent_inputs_have_no_sobol_indices() -> None:
    by_correlation = linear(correlation=[[1, 0.5], [0.5, 1]])
    mixing = STD[:, None] * np.linalg.cholesky([[1, 0.5], [0.5, 1]])
    by_mixing = linear(std=None, mixing=mixing)
    covariance = mixing @ mixing.T
    np.testing.assert_allclose(by_mixing.std**2, np.einsum("ni,ij,nj->n", SLOPES, covariance, SLOPES) + NOISE**2)
    np.testing.assert_allclose(by_correlation.std, by_mixing.std)
    assert by_mixing.first_order is by_mixing.total is None
    assert "dependent" in str(by_mixing.plot().spec["title"]["subtitle"])


def test_dependent_inputs_are_stated_with_their_spread_and_correlation(tmp_path: Path) -> None:
    mixing = [[0.05, 0.0], [-0.024, 0.032]]
    stated = "Correlation of their normal scores: pressure bias and initial position −0.6"
    for result in (linear(std=None, mixing=mixing), linear(correlation=[[1, -0.6], [-0.6, 1]])):
        assert "pressure bias 1 ± 0.05 (normal), initial position 1.1 ± 0.04 (normal)" in result.text
        assert stated in result.text
        assert stated in result.report(tmp_path / "report.html").read_text()
    assert "Correlation" not in linear().text
    assert "Correlation" not in linear(std=None, mixing=[[0.0, 0.0], [0.0, 0.04]]).text


def test_a_tolerance_raises_the_order_until_it_is_reached(shelf: Path) -> None:
    coarse, fine = (propagate(shelf / "nominal.h5", [1, 1], [0.1, 0.1], conditions=[0], tolerance=tolerance)
                    for tolerance in (5e-3, 2e-4))
    assert coarse.reached
    assert fine.order > coarse.order
    assert coarse.error[0] <= 5e-3
    missed = propagate(shelf / "nominal.h5", [1, 1], [0.1, 0.1], conditions=[0], tolerance=1e-9)
    assert missed.reached is False
    assert any("The tolerance is not reached" in line for line in missed.summary())


def test_the_coefficients_are_those_of_the_polynomials() -> None:
    result = linear(order=1, coefficients=True)
    assert result.degrees is not None
    assert result.coefficients is not None
    assert result.degrees.tolist() == [[0, 0], [1, 0], [0, 1]]
    np.testing.assert_allclose(result.coefficients[:, 1:], SLOPES * STD, atol=1e-12)
    assert linear().coefficients is None


def test_the_text_states_the_error_of_the_expansions() -> None:
    wide = linear(std=[0.3, 0.3], order=4)
    assert wide.error.max() > 1e-3
    assert (f"Polynomials of order 4, from 41 model runs for each condition; largest estimated error (RMS over the "
            f"inputs): {1e3 * wide.error.max():.4g} ms.") in wide.text
    assert wide.summary()[2] in wide.text


def test_an_output_without_a_unit_is_a_number_alone() -> None:
    machine = BlackBoxDescription("Pair", (Input("stiffness", "N/m", 100.0, 0.5, 1.5),), (Quantity("load", "N"),),
                                  Quantity("ratio", "1"), "")
    axis = Axis("stiffness", np.array([0.5, 1.5]), 100.0, "N/m")
    table = Grid((axis,), np.array([[3.0], [1.0]]), np.zeros((2, 1), np.uint8),
                 Cases(machine.columns, np.array([[1.0]])), machine, "tests")
    result = propagate(table, 1.0, 0.1, output_std=0.1)
    assert result.summary()[0].endswith("Condition 0 has a ratio of 2.000, with a standard deviation of 0.224.")
    assert "Output noise: 0.1." in result.summary()[1]


def test_another_machine_keeps_its_unit_and_has_no_noise_by_default() -> None:
    machine = BlackBoxDescription("Spring", (Input("stiffness", "N/m", 100.0, 0.5, 1.5),), (Quantity("load", "N"),),
                                  Quantity("travel", "mm"), "")
    axis = Axis("stiffness", np.array([0.5, 1.5]), 100.0, "N/m")
    table = Grid((axis,), np.array([[3.0, 6.0], [1.0, 2.0]]), np.zeros((2, 2), np.uint8),
                 Cases(machine.columns, np.array([[1.0], [2.0]])), machine, "tests")
    result = propagate(table, 1.0, 0.1)
    np.testing.assert_allclose(result.std, [0.2, 0.4])
    assert result.density is None
    assert list(result.columns)[:3] == ["condition", "load [N]", "mean [mm]"]
    assert "Output noise: 0 mm" in result.text
    assert "1: load 2 N" in str(result.plot().spec)


@pytest.mark.parametrize(("given", "message"), [
    ({"mean": [1.0], "std": [0.1]}, "`mean` has 1 entries, but the table has 2 axes"),
    ({"std": [0.1]}, r"The std has shape \(1,\)"), ({"std": None}, "either the std or the mixing"),
    ({"mixing": [[0.1, 0], [0, 0.1]]}, "either the std or the mixing"),
    ({"std": None, "mixing": [[0.1, 0], [0.1]]}, "`mixing` is no list of numbers, or has rows of different"),
    ({"mean": ["one", 1]}, "`mean` is no list of numbers"), ({"std": [0.1, -0.1]}, "std of input 1 is -0.1"),
    ({"families": ["gamma"]}, "1 families for 2 inputs"), ({"families": ["cake", "gamma"]}, "no family 'cake'"),
    ({"conditions": [0, 3]}, "no condition 3. Give indices from 0 to 2"), ({"conditions": [1, 1]}, "more than once"),
    ({"conditions": []}, "No condition is selected"), ({"conditions": [0.5]}, "whole numbers"),
    ({"conditions": 1}, "Give a list of indices"), ({"output_std": -1.0}, "The output std is -1.0"),
    ({"samples": 1 << 46}, "70368744177664 samples are too many. Take at most"),
    ({"density_points": 1 << 46}, "takes more memory than there is .*Give smaller numbers, such as of samples"),
    ({"output_std": float("nan")}, "`output_std` is nan"), ({"order": 99}, "no expansion of order 99"),
    ({"norm": 0.0}, "norm of the truncation"), ({"rule": "cake"}, "no rule 'cake'"),
    ({"nodes": 2}, "2 nodes per axis do not resolve"), ({"tolerance": 0.0}, "The tolerance is 0"),
    ({"quantiles": [1.5]}, "no quantile 1.5"), ({"quantiles": 0.95}, "`quantiles` is 0.95. Give a list"),
    ({"quantiles": [1e-6]}, "quantile 1e-06 is not known from 4096 samples. Give more samples, or probabilities at"),
    ({"quantiles": [1.0]}, "quantile 1 is not known"), ({"samples": 16}, "quantile 0.05 is not known from 16 samples"),
    ({"samples": 1000}, "not a power of two"),
    ({"density_points": -1}, "no densities at -1 points"), ({"seed": -1}, "The seed is -1"),
    ({"outside": "cake"}, "Known: clip, error, nan"),
])
def test_what_cannot_be_propagated_is_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(SlipstickError, match=message):
        linear(**given)


def test_what_is_outside_the_table_is_clipped_missing_or_refused() -> None:
    beyond = {"mean": [1.4, 1.0], "std": [0.1, 0.1]}
    clipped, missing = linear(**beyond), linear(**beyond, outside="nan")
    with pytest.raises(OutsideTable, match="pressure_bias"):
        linear(**beyond, outside="error")
    assert linear(outside="error", order=1).mass_outside < 1e-6
    assert clipped.mass_outside == pytest.approx(norm.sf(1), abs=1e-4)
    assert np.isfinite(clipped.mean).all()
    assert np.isnan(missing.mean).all()
    assert np.isnan(missing.quantiles).all()
    assert "15.9 % of the inputs lie outside the table" in missing.summary()[3]
    runs = ("are model runs, at nodes of the expansion or to check its error, that may never lock, or lie outside the "
            "table")
    assert missing.summary()[4] == f"3 of 3 conditions have no distribution: there {runs}."
    assert set(missing.columns["reason"]) == {f"There {runs}"}
    only_checks = linear(mean=[1.0, 1.0], std=[0.3, 0.3], order=1, outside="nan")  # whose nodes are at one std
    assert set(only_checks.columns["reason"]) == {f"There {runs}"}
    assert missing.columns["mean [s]"] == [None] * 3
    assert missing.plot().title == "No condition has a distribution"
    assert Propagation.from_dict(json.loads(json.dumps(missing.to_dict(), allow_nan=False))).text == missing.text


def test_only_tables_are_taken(tmp_path: Path) -> None:
    with pytest.raises(InvalidValue, match=r"The Bench is not a table\. Give a table, such as `slipstick"):
        propagate(HEAVY, 1, 0.1)  # type: ignore[arg-type]
    with pytest.raises(SlipstickError, match="missing"):
        propagate(tmp_path / "missing.h5", 1, 0.1)


def test_the_result_is_saved_opened_tabulated_and_reported(tmp_path: Path) -> None:
    result = propagate(linear_table().save(tmp_path / "mine.h5"), MEAN, STD)
    again = slipstick.open_result(result.save(tmp_path / "result.json"))
    assert isinstance(again, Propagation)
    assert again.to_dict() == result.to_dict()
    assert again.plot().spec == result.plot().spec
    np.testing.assert_array_equal(again.density, result.density)
    frame = result.to_frame()
    assert list(frame)[-12:] == ["brake_torque [N m]", "mean [s]", "std [s]", "error [s]", "quantile 0.05 [s]",
                                 "quantile 0.5 [s]", "quantile 0.95 [s]", "first_order of pressure_bias",
                                 "first_order of initial_position", "total of pressure_bias",
                                 "total of initial_position", "reason"]
    assert frame["mean [s]"].tolist() == result.mean.tolist()
    assert result.summary()[0].startswith("Pressure bias and initial position propagated to 3 conditions of “mine”.")
    page = result.report(tmp_path / "new" / "report.html").read_text()
    assert page.startswith("<!doctype html>")
    assert f"{1e3 * result.mean[0]:.1f}" in page
    assert f"{1e3 * result.mean[0]:.1f}" in result.text
    with pytest.raises(InvalidValue, match=r"ends in \.html"):
        result.report(tmp_path / "report.pdf")
    partial = {name: value for name, value in result.to_dict().items() if name != "request"}
    with pytest.raises(InvalidValue, match="has no `request`"):
        Propagation.from_dict(partial)


def test_a_picture_of_many_conditions_shows_the_first_and_says_so() -> None:
    many = propagate(linear_table(MOST + 6), MEAN, STD, density_points=11)
    (spec, caption), = many.pictures().values()
    assert len(spec["vconcat"]) == MOST
    assert caption.endswith(f"The first {MOST} of {MOST + 6} conditions are shown.")
    assert f"in {MOST + 6} conditions" in many.plot().title
    assert f"and {6} more conditions" in many.text
    assert len(many.to_frame()) == len(many.mean) == MOST + 6
    few, = linear().pictures().values()
    assert "are shown" not in few[1]
