import re

import numpy as np
import pytest

from slipstick.clutch.ensemble import TIGHT, Simulator
from slipstick.table import Surrogate, Table
from tests.benches import NOMINAL
from worker.__main__ import main
from worker.surrogate import HELD_OUT, build, read_span
from worker.training import WIDTHS, _gradient, _initial_layers, train

SPANS = ("pressure_bias=0.8:1.2", "initial_position=0.8:1.2", "friction_coefficient=0.9:1.1")
SMALL = ("--runs", "1000", "--steps", "1000")


@pytest.fixture(scope="module")
def recordings(six_conditions, tmp_path_factory):
    """The six conditions as a recordings file."""
    path = tmp_path_factory.mktemp("recordings") / "few.csv"
    columns = np.column_stack([six_conditions.current_profile, six_conditions.motor_speed, six_conditions.load_inertia,
                               six_conditions.brake_torque, np.ones(len(six_conditions))])
    rows = [",".join([str(int(row[0])), *(repr(float(value)) for value in row[1:])]) for row in columns]
    path.write_text("\n".join(["current_profile,motor_speed [rad/s],load_inertia [kg m^2],brake_torque [N m],"
                               "shifting_time [s]", *rows]) + "\n")
    return path


def run_command(recordings, out, *options, spans=SPANS):
    axes = [part for span in spans for part in ("--axis", span)]
    return main(["surrogate", *axes, "--conditions", str(recordings), "--out", str(out), *options])


def number(pattern, output):
    return float(re.search(pattern, output)[1].replace(",", ""))


@pytest.fixture(scope="module")
def path(recordings, tmp_path_factory):
    path = tmp_path_factory.mktemp("built") / "a.h5"
    assert run_command(recordings, path, *SMALL, "--threads", "2") == 0
    return path


def test_the_stated_error_is_confirmed_at_other_points(path, six_conditions):
    surrogate = Table.open(path)
    assert isinstance(surrogate, Surrogate)
    points = np.random.default_rng(99).uniform(surrogate.lower, surrogate.upper, (1000, 3))
    direct = Simulator(NOMINAL, tuple(axis.name for axis in surrogate.axes), TIGHT)(points, six_conditions)
    difference = surrogate.interpolate(points, "error") - direct
    rms = np.sqrt(np.mean(difference**2, axis=0))
    assert direct.std(axis=0).max() > 50 * rms.max()  # the surrogate explains the variation
    np.testing.assert_allclose(rms, surrogate.error.rms, rtol=0.15)
    assert np.all(np.abs(difference).max(axis=0) < 2 * surrogate.error.worst)
    assert surrogate.error.points == HELD_OUT


def test_the_same_seed_gives_the_same_surrogate_on_any_number_of_threads(path, recordings, tmp_path, six_conditions):
    assert run_command(recordings, tmp_path / "b.h5", *SMALL, "--threads", "1") == 0
    assert Table.open(tmp_path / "b.h5").digest == Table.open(path).digest
    axes = tuple(read_span(span, NOMINAL) for span in SPANS)
    first, second = (build(NOMINAL, six_conditions, axes, 100, 1, seed) for seed in (1, 2))
    assert first.digest != second.digest


def test_verify_accepts_a_surrogate(path, capsys):
    assert main(["verify", str(path), "--points", "500"]) == 0
    output, surrogate = capsys.readouterr().out, Table.open(path)
    stated = number(r"held-out points: ([\d.]+) ms RMS", output)
    assert stated == pytest.approx(1e3 * surrogate.error.overall_rms, abs=1e-4)
    assert number(r"error: ([\d.]+) ms RMS", output) == pytest.approx(stated, rel=0.15)
    for part in (surrogate.digest, "kind: surrogate over 3 axes from 1,000 runs;", "pressure_bias: 0.8 to 1.2 of 1.6"):
        assert part in output


@pytest.mark.parametrize(("spans", "options", "message"), [
    (("pressure_bias=0.8:1.2:5",), (),
     r"'pressure_bias=0\.8:1\.2:5' is not a valid axis of a surrogate\. Write NAME=LOW:HIGH"),
    (("pressure_bias=1.2:0.8",), (), "do not increase"),
    (("pressure_bias=0.8:1.2",) * 2, (), "Give each parameter one --axis"),
    (SPANS, ("--runs", "99"), "Give 100 or more runs"), (SPANS, ("--steps", "0"), "one or more steps"),
    (SPANS, ("--seed", "-1"), "a seed from 0"), (SPANS, ("--threads", "0"), "Give --threads 1 or more"),
])
def test_invalid_options_are_refused_with_a_remedy(recordings, tmp_path, capsys, spans, options, message):
    assert run_command(recordings, tmp_path / "a.h5", *options, spans=spans) == 1
    assert re.search(message, capsys.readouterr().err)
    assert not list(tmp_path.iterdir())


def test_a_box_that_does_not_lock_is_refused_and_the_suggested_one_works(recordings, tmp_path, capsys):
    spans = ("pressure_bias=0.8:6", "friction_coefficient=0.9:1.1")
    assert run_command(recordings, tmp_path / "a.h5", "--runs", "300", "--steps", "1", spans=spans) == 1
    error = capsys.readouterr().err
    assert number(r"([\d,]+) of 1,800 engagements in the box do not lock", error) > 0
    narrower = re.search(r"--axis (pressure_bias=0\.8:[\d.]+) excludes them", error)[1]
    assert 1.5 < float(narrower.split(":")[1]) < 6
    assert not list(tmp_path.iterdir())
    assert run_command(recordings, tmp_path / "a.h5", "--runs", "300", "--steps", "1", spans=(narrower, spans[1])) == 0


def test_recordings_are_not_overwritten(recordings, capsys):
    before = recordings.read_bytes()
    assert run_command(recordings, recordings, *SMALL) == 1
    assert recordings.read_bytes() == before


def test_gradients_agree_with_finite_differences():
    rng = np.random.default_rng(3)
    layers = [layer.astype(float) for layer in _initial_layers((2, 5, 4, 3), rng)]
    x, y = rng.normal(size=(20, 2)), rng.normal(size=(20, 3))

    def loss():
        values = x
        for weight, bias in zip(layers[:-2:2], layers[1:-2:2], strict=True):
            argument = values @ weight + bias
            values = argument / (1 + np.exp(-argument))
        return np.mean(np.sum((values @ layers[-2] + layers[-1] - y) ** 2, axis=1))

    for layer, gradient in zip(layers, _gradient(layers, x, y), strict=True):
        for index in np.ndindex(layer.shape):
            value, losses = layer[index], []
            for step in (1e-6, -1e-6):
                layer[index] = value + step
                losses.append(loss())
            layer[index] = value
            assert gradient[index] == pytest.approx((losses[0] - losses[1]) / 2e-6, abs=1e-7)


def test_a_network_follows_a_kink_better_than_polynomials():
    rng, steps = np.random.default_rng(4), []
    x = rng.uniform(-1.7, 1.7, (2000, 2))
    kink = np.maximum(x @ [0.6, 0.8], 0.2)[:, None]
    network = train(x, kink, 1500, rng, steps.append)
    held_out = rng.uniform(-1.7, 1.7, (1000, 2))
    error = network(held_out)[:, 0] - np.maximum(held_out @ [0.6, 0.8], 0.2)
    powers = [(i, j) for i in range(9) for j in range(9 - i)]
    terms, held_out_terms = ([at[:, 0]**i * at[:, 1]**j for i, j in powers] for at in (x, held_out))
    coefficients = np.linalg.lstsq(np.column_stack(terms), kink[:, 0], rcond=None)[0]
    polynomial_error = np.column_stack(held_out_terms) @ coefficients - np.maximum(held_out @ [0.6, 0.8], 0.2)
    assert np.sqrt(np.mean(error**2)) < 0.5 * np.sqrt(np.mean(polynomial_error**2))
    assert steps == list(range(1, 1501))
    assert tuple(len(bias) for bias in network.biases) == (*WIDTHS, 1)
