"""What the public functions take: names and paths, texts with units, mappings; and what they refuse with a remedy."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import slipstick
from slipstick.errors import InvalidValue, SlipstickError, UnknownName
from slipstick.table import Grid


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small table of the conditions of the sample."""
    path = tmp_path_factory.mktemp("table") / "small.h5"
    slipstick.build("heavy", {"initial_position": (0.5, 2, 9)}, out=path, progress=False,
                    conditions=slipstick.Recordings.open("sample"))
    return path


def test_names_and_paths_stand_for_benches_recordings_and_tables(table: Path) -> None:
    simulated = slipstick.simulate("compact", "stribeck_friction", engagements=4)
    assert len(simulated) == 4
    by_name = slipstick.likelihood(table, "sample", 1.3, 0.1, 0.01)
    runs = slipstick.Recordings.open("sample")
    by_value = slipstick.likelihood(slipstick.Table.open(table), runs, [1.3], [0.1], 0.01)
    assert by_name.log10_likelihood == by_value.log10_likelihood
    fit = slipstick.fit(table, "sample", "initial_position", families="gamma", generations=2, population=6,
                        intervals=False, progress=False, settings={"seed": 2})
    assert fit.inputs == ("initial_position",)
    assert (fit.request["settings"]["families"], fit.request["settings"]["seed"]) == (["gamma"], 2)
    assert slipstick.fit.__module__ == "slipstick.interface.fit"


def test_a_csv_file_of_recordings_numbers_the_profiles_of_the_bench_that_is_fitted(tmp_path: Path) -> None:
    runs = slipstick.simulate("compact", engagements=4)
    columns = [getattr(runs.conditions, name) for name in ("current_profile", "motor_speed", "load_inertia",
                                                           "brake_torque")]
    rows = [",".join(f"{value}" for value in row) for row in zip(*columns, runs.measured_time, strict=True)]
    (tmp_path / "runs.csv").write_text("\n".join([
        "current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m],shifting_time [s]", *rows]))
    first, second = (slipstick.fit(
        slipstick.Bench.open("compact"), given, "initial_position", generations=1, population=4, refine=False,
        intervals=False, progress=False).log10_likelihood for given in (runs, tmp_path / "runs.csv"))
    assert first == pytest.approx(second, rel=1e-12)


def test_texts_with_units_are_numbers_in_the_unit_of_the_output(table: Path) -> None:
    assert slipstick.likelihood(table, "sample", 1.3, 0.1, "10 ms").log10_likelihood == \
        slipstick.likelihood(table, "sample", 1.3, 0.1, 0.01).log10_likelihood
    text = slipstick.propagate(table, 1.3, 0.1, output_std="3 ms", tolerance="1 ms", conditions=[0])
    number = slipstick.propagate(table, 1.3, 0.1, output_std=0.003, tolerance=0.001, conditions=[0])
    assert text.to_dict() == number.to_dict()
    for wrong in ("3", "3 bar", "few ms", float("nan")):
        with pytest.raises(InvalidValue, match="`output_std` is"):
            slipstick.propagate(table, 1.3, 0.1, output_std=wrong)


def test_an_input_that_does_not_scatter_is_propagated(table: Path) -> None:
    result = slipstick.propagate(table, 1.3, 0.0, conditions=[0, 1], output_std=0.002)
    np.testing.assert_allclose(result.std, 0.002)
    assert "Standard deviations of" in result.summary()[0] or result.plot().title


Call = Callable[[Path], Any]
WRONG: dict[str, tuple[Call, str]] = {
    "bench": (lambda table: slipstick.study(3, "sample"), "The int 3 is not a bench"),  # type: ignore[arg-type]
    "bench name": (lambda table: slipstick.calibrate("heavi", "sample"), "heavy"),
    "recordings": (lambda table: slipstick.study("heavy", [1, 2]), "is not recordings"),  # type: ignore[arg-type]
    "recordings name": (lambda table: slipstick.fit(table, "sampel"), "sample"),
    "table": (lambda table: slipstick.propagate(3, 1, 0.1), "The int 3 is not a table"),  # type: ignore[arg-type]
    "settings": (lambda table: slipstick.study("heavy", "sample", settings=3), "The settings are 3"),  # type: ignore[arg-type]
    "fit settings": (lambda table: slipstick.fit(table, "sample", mean_bounds=3), "cannot be read"),
    "outside": (lambda table: slipstick.fit(table, "sample", outside="x"), "policy"),  # type: ignore[arg-type]
    "order": (lambda table: slipstick.propagate(table, 1, 0.1, order=2.5), "`order` is 2.5"),  # type: ignore[arg-type]
    "lines": (lambda table: slipstick.likelihood(table, "sample", 1, 0.1, 0.01, lines=64.0), "`lines` is 64.0"),  # type: ignore[arg-type]
    "engagements": (lambda table: slipstick.simulate("heavy", engagements=1.5), "`engagements` is 1.5"),  # type: ignore[call-overload]
    "seed": (lambda table: slipstick.simulate("heavy", seed="x"), "`seed` is 'x'"),  # type: ignore[call-overload]
    "threads": (lambda table: slipstick.build("heavy", threads=True), "`threads` is True"),
    "population": (lambda table: slipstick.fit(table, "sample", population=8.5), "`population` is 8.5"),
    "axes": (lambda table: slipstick.build("heavy", ["pressure_bias"]), "The axes are"),  # type: ignore[arg-type]
    "model": (lambda table: slipstick.build("heavy", model=3), "is not a model"),  # type: ignore[arg-type]
    "out": (lambda table: slipstick.build("heavy", {"pressure_bias": (0.9, 1.1, 2)}, out=table.with_suffix(".csv"),
                                          progress=False), "ends in .h5"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_does_not_fit_is_refused_with_a_remedy(name: str, table: Path) -> None:
    call, cause = WRONG[name]
    with pytest.raises(SlipstickError, match=cause) as refused:
        call(table)
    assert refused.value.remedy


def test_a_table_never_replaces_another_file(table: Path, tmp_path: Path) -> None:
    picture = tmp_path / "law.json"
    picture.write_text("{}")
    with pytest.raises(InvalidValue, match=r"End it in \.h5"):
        Grid.open(table).save(picture)
    assert picture.read_text() == "{}"


def test_a_model_is_no_result(tmp_path: Path) -> None:
    file = tmp_path / "extended.json"
    file.write_text('{"parameters": {}, "effects": {}, "bench": {}}')
    with pytest.raises(InvalidValue, match=r"Give a model to `slipstick\.build`"):
        slipstick.open_result(file)
    with pytest.raises(UnknownName):
        slipstick.open_result(tmp_path / "other.json")
