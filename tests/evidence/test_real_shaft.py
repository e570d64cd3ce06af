"""Recordings of a shaft at a controlled speed: an irregular clock, pauses and a motor that stands, on made-up files."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from evidence.real import shaft_with_disturbances as shaft
from evidence.real.measured import fit_form
from evidence.real.picture import Band
from slipstick.engine.laws import list_candidates
from slipstick.engine.model import nominal_own_values

HEAD = ("time [ms],desired speed [rpm],speed [rpm],effort [%],lateral force [1],damper resistance [ohm],"
        "temperature [degC]")


def write(path: Path, rng: np.random.Generator, seconds: float = 20.0, pause: float = 0.0) -> None:
    """A file of a shaft with a ramp of the speed, a ripple at 3.67 Hz, and a pause after 9 s."""
    time = np.cumsum(rng.uniform(0.012, 0.020, int(seconds / 0.016)))
    time[time > 9] += pause
    speed = 200 + 2 * time + 10 * np.sin(2 * np.pi * 3.67 * time + 1) + 0.5 * rng.standard_normal(len(time))
    columns = [1e3 * time + 5000, np.full(len(time), 200.0), speed, 8 + 0.06 * speed, np.sin(time) ** 2,
               np.where(time > 5, 7.0, 15.0), np.full(len(time), 26.0 + rng.integers(2))]
    with gzip.open(path, "wt") as file:
        np.savetxt(file, np.array(columns).T, fmt="%.6g", delimiter=",", header=HEAD, comments="")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    rng = np.random.default_rng(2)
    for kind, numbers in (("force", (200, 201)), ("damper", (400, 401)), ("healthy", (36, 100, 101))):
        for number in numbers:
            write(tmp_path / f"{kind}-{number}.csv.gz", rng)
    return tmp_path


def test_all_studies_have_their_channels_and_many_candidates(folder: Path) -> None:
    studies = shaft.read(folder)

    assert len(studies) == 7
    assert set(studies["force, with the lateral force"].runs.channels) == {"temperature", "lateral force"}
    assert set(studies["damper, without it"].runs.channels) == {"temperature"}
    np.testing.assert_array_equal(studies["healthy, part 1"].runs.order, [36.0, 36.0])
    for recorded in studies.values():
        own = {part.name: nominal_own_values(part) for part in recorded.parts}
        assert len(list_candidates(recorded, own)) >= 24
    pairs = {each.pair for each in list_candidates(studies["force, with the lateral force"], {
        part.name: nominal_own_values(part) for part in studies["force, with the lateral force"].parts})}
    assert {("friction torque", "lateral force"), ("drag", "lateral force"), ("motor torque", "run order")} <= pairs
    assert not any(quantity == "effort sensor" for quantity, _ in pairs)


def test_means_over_the_period_leave_the_ramp_without_the_ripple(folder: Path) -> None:
    runs = shaft.read(folder)["force, with the lateral force"].runs

    speed = runs.signals["speed"]
    slope = np.polyfit(runs.time, speed.T, 1)[0]
    left = speed - np.array([np.polyval(np.polyfit(runs.time, row, 1), runs.time) for row in speed])
    np.testing.assert_allclose(slope, 2.0, atol=0.05)
    assert left.std() < 0.3  # of 7 in the file
    np.testing.assert_allclose(runs.signals["effort"], 8 + 0.06 * speed, atol=1e-3)
    np.testing.assert_array_equal(runs.order, [200, 200, 201, 201])


def test_pieces_in_which_nothing_was_recorded_are_left_out(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    write(tmp_path / "force-200.csv.gz", rng, 60.0)
    write(tmp_path / "force-201.csv.gz", rng, 60.0, pause=30.0)

    pieces = shaft._cut(sorted(tmp_path.glob("*.csv.gz")))

    numbers = [number for number, _ in pieces]
    assert numbers.count(200) > numbers.count(201) > 0
    assert all(np.abs(np.diff(values[:, 1])).min() > 0 for _, values in pieces)


def test_the_form_of_a_drag_is_known_but_for_two_parameters() -> None:
    law = shaft._LAWS["damper"]
    resistance = np.array(law.places)
    drag = Band("drag", resistance, 4 / (resistance + 9) - 4 / (resistance[0] + 9))

    [closest], parameters = fit_form(law, drag)

    assert parameters["w"][0] == pytest.approx(4, rel=1e-4)
    assert parameters["r"][0] == pytest.approx(9, rel=1e-4)
    np.testing.assert_allclose(closest.value, drag.value, atol=1e-6)
    assert fit_form(shaft._LAWS["force"], drag) == ([], {})
