"""Recordings of a band brake: how runs are cut, and what is said of a build-up and of delays that are known."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from evidence.real import band_brake
from evidence.real.measured import list_signals
from evidence.real.signals import average_strokes, find_delay
from slipstick.engine.laws import list_candidates
from slipstick.engine.model import nominal_own_values
from slipstick.engine.recordings import Recorded
from slipstick.engine.selection import identify
from slipstick.engine.settings import EngineSettings
from slipstick.machine import Runs
from slipstick.numerics.memory import play

HEAD = "time [s],displacement [in],friction force [kip],velocity [in/s],band force 1 [lb],band force 2 [lb]"
PLAY = 0.15
"""Half of the travel in in, in which the force of the brake turns."""


def write(path: Path, hertz: float, size: float, rng: np.random.Generator) -> None:
    """A file of an elastic brake, 14 s long: its force is 80 % of its size in kip after 0.9 of twice the play."""
    time = np.arange(0, 14, 1 / 1024)
    displacement, velocity = np.sin(2 * np.pi * hertz * time), 2 * np.pi * hertz * np.cos(2 * np.pi * hertz * time)
    force = size * (displacement - play(displacement[None], PLAY)[0]) / PLAY
    columns = [time, displacement, force, velocity, 10 + np.maximum(-500 * force, 0), 10 + np.maximum(500 * force, 0)]
    noise = [0, 1e-4, 1e-2, 1e-2, 1.0, 1.0]
    rows = np.array([column + std * rng.standard_normal(len(time))
                     for column, std in zip(columns, noise, strict=True)]).T
    with gzip.open(path, "wt") as file:
        np.savetxt(file, rows, fmt="%.7g", delimiter=",", header=HEAD, comments="")


@pytest.fixture(scope="module")
def variants(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Recorded]:
    folder, rng = tmp_path_factory.mktemp("band_brake"), np.random.default_rng(4)
    for name, hertz, size in (("dataset-1-0.5Hz20lbtension", 0.5, 1.0), ("dataset-1-1Hz70lbtension", 1.0, 4.0),
                              ("dataset-2-0.25Hz0lbtension0.5amplitude", 0.25, 0.5),
                              ("dataset-2-1Hz36lbtension1amplitude", 1.0, 2.0)):
        write(folder / f"{name}.csv.gz", hertz, size, rng)
    return band_brake.read(folder)


def test_runs_begin_at_a_reversal_and_count_from_the_next_one_on(variants: dict[str, Recorded]) -> None:
    runs = variants[band_brake.BUILD_UP].runs

    np.testing.assert_allclose(np.abs(runs.signals["displacement"][:, 0]), 1.0, atol=0.02)
    for hertz, counted in zip(runs.channels["frequency"], runs.channels["counted"], strict=True):
        assert int(np.argmax(counted)) == round(32 / hertz)
    assert set(runs.channels["tension"]) == {0.0, 20.0, 36.0, 70.0}
    np.testing.assert_allclose(runs.channels["amplitude"], 1.0, atol=0.01)


def test_blocks_are_those_of_what_each_variant_has_recorded(variants: dict[str, Recorded]) -> None:
    blocks = {name: [part.name for part in recorded.parts] for name, recorded in variants.items()}
    assert blocks.pop(band_brake.BUILD_UP) == ["friction"]
    assert set(map(tuple, blocks.values())) == {("band",)}
    first, second, few = (len(variants[name]) for name in blocks)
    assert len(variants[band_brake.BUILD_UP]) == first + second
    assert 0 < few < second
    for recorded in variants.values():
        own = {part.name: nominal_own_values(part) for part in recorded.parts}
        assert len(list_candidates(recorded, own)) >= 30


@pytest.mark.slow
def test_a_build_up_over_the_travel_is_named_measured_and_drawn(variants: dict[str, Recorded]) -> None:
    answer = identify(variants[band_brake.BUILD_UP], EngineSettings(most=1))

    assert answer.findings[0].pair == ("share of the friction", "past displacement")
    rows = {row.what: row for row in band_brake.compare(band_brake.BUILD_UP, answer)}
    for what in ("recorded", "explained"):
        assert rows[f"travel to 80 % of the force, {what}"].value == pytest.approx(0.9 * 2 * PLAY, abs=0.03)
    recorded, explained = list_signals(answer).values()
    counted = answer.fits[0].models["friction"].part.counted
    np.testing.assert_allclose(((recorded - explained) * counted).sum(axis=2), 0.0, atol=1e-9)
    assert band_brake.draw({band_brake.BUILD_UP: answer}).startswith(b"<svg")


def test_strokes_are_shares_of_what_the_force_becomes_in_each_test() -> None:
    time = np.arange(0, 4, 1 / 64)
    displacement = np.cos(np.pi * time)[None] * np.ones((3, 1))
    force = np.array([[2.0], [2.0], [5.0]]) * (displacement - play(displacement, PLAY)) / PLAY
    tests, counted = np.array([0.0, 0.0, 7.0]), np.tile(time > 1.5, (3, 1)).astype(float)
    runs = Runs(time, {"displacement": displacement}, channels={"test": tests, "counted": counted})
    travel = np.linspace(0.0, 0.8, 9)

    shares = average_strokes(runs, force, travel)

    np.testing.assert_allclose(shares, np.tile(np.minimum(-1 + travel / PLAY, 1), (2, 1)), atol=0.15)
    assert len(average_strokes(runs, force, 5 * travel)) == 0


def test_a_delay_is_measured_between_samples() -> None:
    time = np.arange(300) / 64
    signals = np.array([np.sin(2 * np.pi * hertz * time) for hertz in (0.5, 1.0)])
    late = np.array([np.sin(2 * np.pi * hertz * (time - 0.045)) for hertz in (0.5, 1.0)])

    assert find_delay(signals, late, 8) == pytest.approx(0.045 * 64, abs=0.05)
    assert find_delay(late, signals, 8) == pytest.approx(-0.045 * 64, abs=0.05)
