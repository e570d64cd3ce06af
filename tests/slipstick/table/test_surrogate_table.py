import math
import pickle
import shutil
from dataclasses import replace
from itertools import pairwise

import h5py
import numpy as np
import pytest

from slipstick.errors import CorruptTable, InvalidValue, OutsideTable, WrongDigest, WrongLayout
from slipstick.table import Axis, Grid, HeldOut, Network, Surrogate, Table
from slipstick.table.surrogate import germs
from slipstick.uncertainty import Inputs
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, exact
from tests.benches import HEAVY, NOMINAL

AXES = (Axis("pressure_bias", np.array([0.8, 1.2]), 1.6, "bar"),
        Axis("initial_position", np.array([0.5, 2.0]), 5e-4, "m"))


def network(sizes=(2, 7, 5, 3), seed=1):
    rng = np.random.default_rng(seed)
    return Network(tuple(rng.normal(size=pair) for pair in pairwise(sizes)),
                   tuple(rng.normal(size=size) for size in sizes[1:]))


@pytest.fixture
def surrogate():
    error = HeldOut(50, np.array([1e-4, 2e-4, 3e-4]), np.array([5e-4, 9e-4, 3e-4]))
    return Surrogate(AXES, network(), error, 1000, 2000, 7, HEAVY.conditions.take([3, 100, 215]), NOMINAL, "a test")


@pytest.fixture
def path(surrogate, tmp_path):
    surrogate.save(tmp_path / "surrogate.h5")
    return tmp_path / "surrogate.h5"


def random_points(count, seed=2):
    return np.random.default_rng(seed).uniform([0.8, 0.5], [1.2, 2.0], (count, 2))


def reference_times(surrogate, point):
    """Shifting times at one point, from a reference implementation of the network in pure Python."""
    values = [math.sqrt(12) * (x - (axis.lower + axis.upper) / 2) / (axis.upper - axis.lower)
              for x, axis in zip(point, surrogate.axes, strict=True)]
    layers = list(zip(surrogate.network.weights, surrogate.network.biases, strict=True))
    for number, (weight, bias) in enumerate(layers):
        sums = [sum(value * row[unit] for value, row in zip(values, weight, strict=True)) + bias[unit]
                for unit in range(len(bias))]
        values = sums if number == len(layers) - 1 else [a / (1 + math.exp(-a)) for a in sums]
    return values


def test_agrees_with_a_reference_implementation(surrogate):
    points = random_points(40)
    times = surrogate.interpolate(points, "error")
    np.testing.assert_allclose(times, [reference_times(surrogate, point) for point in points], rtol=1e-12, atol=1e-12)


def test_stays_finite_where_an_exponential_would_overflow():
    steep = Network((np.array([[1e4]]), np.array([[1.0]])), (np.array([0.0]), np.array([0.0])))
    assert steep(np.array([[-1.0], [1.0]])).tolist() == [[0.0], [1e4]]


def test_germs_of_uniform_points_have_mean_0_and_variance_1():
    standardised = germs(AXES, random_points(200_000))
    assert np.abs(standardised.mean(axis=0)).max() < 0.01
    assert np.abs(standardised.var(axis=0) - 1).max() < 0.01


def test_a_written_surrogate_is_read_back_unchanged(surrogate, path):
    read = Table.open(path)
    assert isinstance(read, Surrogate)
    assert read.digest == surrogate.digest
    assert np.array_equal(read.interpolate(random_points(9)), surrogate.interpolate(random_points(9)))
    assert (read.runs, read.steps, read.seed, read.origin) == (1000, 2000, 7, "a test")
    assert (read.error.points, read.error.rms.tolist(), read.error.worst.tolist()) == (
        50, surrogate.error.rms.tolist(), surrogate.error.worst.tolist())
    assert Surrogate.open(path).digest == surrogate.digest
    with pytest.raises(WrongLayout, match="not a table of the kind grid"):
        Grid.open(path)


def test_the_digest_depends_on_the_content_only(surrogate):
    other_network = network()
    other_network.weights[1][3, 2] = np.nextafter(other_network.weights[1][3, 2], 9)
    other_error = HeldOut(50, surrogate.error.rms, surrogate.error.worst * 2)
    changes = [{"network": other_network}, {"error": other_error}, {"error": replace(surrogate.error, points=51)},
               {"runs": 1001}, {"steps": 2001}, {"seed": 8}, {"model": NOMINAL.with_parameters({"gear_ratio": 3.0})},
               {"axes": (replace(AXES[0], nominal=1.7), AXES[1])}]
    digests = {replace(surrogate, **change).digest for change in changes}
    assert len(digests | {surrogate.digest}) == len(changes) + 1
    assert replace(surrogate, origin="another origin").digest == surrogate.digest


@pytest.mark.parametrize("dataset", ["network/0/weight", "network/2/bias", "error/rms", "error/worst"])
def test_a_flipped_bit_is_detected(path, dataset):
    with h5py.File(path) as file:
        offset = file[dataset].id.get_chunk_info(0).byte_offset
    content = bytearray(path.read_bytes())
    content[offset + 3] ^= 1
    path.write_bytes(content)
    with pytest.raises(CorruptTable, match="damaged"):
        Table.open(path)


def count(name, value):
    return lambda file: file["network"].attrs.__setitem__(name, value)


def entry(path, index, value):
    return lambda file: file[path].__setitem__(index, value)


def change_weight(file):
    file["network/1/weight"][2, 2] += 1e-12  # the checksum is valid, so only the digest detects it


@pytest.mark.parametrize(("damage", "error", "message"), [
    (change_weight, WrongDigest, "The content"), (entry("error/rms", 0, 1e-5), WrongDigest, "The content"),
    (count("runs", 10**6), WrongDigest, "The content"),
    (entry("axes/pressure_bias", 1, 1.3), WrongDigest, "The content"),
    (lambda file: file.__delitem__("network/1"), CorruptTable, "'network/1' is missing"),
    (count("layers", 2), CorruptTable, "is in '1', not in 's'"), (count("layers", 0), CorruptTable, "layers of the"),
    (entry("network/0/bias", 1, np.nan), CorruptTable, "not finite"),
    (count("seed", np.nan), CorruptTable, "'seed' of 'network' is nan"),
    (count("runs", 1e300), CorruptTable, "300, which is not a count"),
    (entry("error/worst", slice(None), 0.0), CorruptTable, "held-out errors are invalid"),
])
def test_errors_name_the_inconsistency(path, damage, error, message):
    broken = path.with_name("broken.h5")
    shutil.copy(path, broken)
    with h5py.File(broken, "r+") as file:
        damage(file)
    with pytest.raises(error, match=message):
        Table.open(broken)


def test_conditions_are_matched_by_value(surrogate):
    points = random_points(20)
    times = surrogate.interpolate(points)
    restricted = surrogate.restricted(HEAVY.conditions.take([215, 3]))
    assert np.array_equal(restricted.interpolate(points), times[:, [2, 0]])
    assert restricted.error.rms.tolist() == surrogate.error.rms[[2, 0]].tolist()
    assert np.array_equal(surrogate(points, HEAVY.conditions.take([100])), times[:, [1]])
    with pytest.raises(InvalidValue, match="is not in the table"):
        surrogate(points[:1], HEAVY.conditions.take([3, 4]))


def test_a_point_outside_is_an_error_clipped_or_nan_as_for_a_grid(surrogate):
    shape = (2, 2, 3)
    grid = Grid(AXES, np.ones(shape), np.zeros(shape, np.uint8), surrogate.conditions, NOMINAL)
    points = np.array([[1.0, 1.0], [0.2, 1.0], [1.0, 2.7], [9.0, -9.0]])
    edge = np.array([[1.0, 1.0], [0.8, 1.0], [1.0, 2.0], [1.2, 0.5]])
    assert np.array_equal(surrogate.interpolate(points, "clip"), surrogate.interpolate(edge, "error"))
    messages = []
    for table in (grid, surrogate):
        assert np.isnan(table.interpolate(points, "nan")).all(axis=1).tolist() == [False, True, True, True]
        with pytest.raises(OutsideTable, match=r"Point 1 has pressure_bias = 0\.2, outside the range") as caught:
            table.interpolate(points, "error")
        messages.append(str(caught.value))
    assert messages[0] == messages[1]
    assert surrogate.interpolate(np.empty((0, 2))).shape == (0, 3)
    with pytest.raises(InvalidValue, match="not finite in initial_position"):
        surrogate.interpolate(np.array([[1.0, np.nan]]))


def test_likelihood_of_a_smooth_surrogate_needs_no_knots(surrogate):
    assert surrogate.knots is None
    measured = surrogate.interpolate(np.array([[1.0, 1.2]]))[0]
    problem = InferenceProblem(surrogate, surrogate.conditions, measured, surrogate.lower, surrogate.upper, ("a", "b"))
    candidate = Candidate(Inputs([1.0, 1.2], [0.01, 0.01]), 0.05)
    normals = np.random.default_rng(3).standard_normal((400_000, 2))
    residual = (surrogate(candidate.inputs.points(normals), surrogate.conditions) - measured) / 0.05
    sampled = np.log10(np.mean(np.exp(-residual**2 / 2), axis=0) / (0.05 * math.sqrt(2 * math.pi))) - 3
    np.testing.assert_allclose(exact(problem, candidate), sampled, atol=5e-3)


def test_inconsistent_fields_are_rejected(surrogate):
    three_values = (replace(AXES[0], values=np.array([0.8, 1.0, 1.2])), AXES[1])
    for change, message in [({"network": network((3, 4, 3))}, "does not map 2 axes to 3 conditions"),
                            ({"network": network((2, 4, 2))}, "does not map 2 axes to 3 conditions"),
                            ({"error": HeldOut(5, np.ones(2), np.ones(2))}, "The number of held-out errors"),
                            ({"axes": three_values}, "more than two values"),
                            ({"axes": AXES[:1] * 2}, "each parameter once")]:
        with pytest.raises(InvalidValue) as caught:
            replace(surrogate, **change)
        assert message in str(caught.value)
    with pytest.raises(InvalidValue, match="held-out errors"):
        HeldOut(0, np.ones(2), np.ones(2))
    valid = network((2, 4, 3))
    with pytest.raises(InvalidValue, match="layers of the network are inconsistent"):
        Network(valid.weights[::-1], valid.biases[::-1])
    with pytest.raises(InvalidValue, match="layers of the network are inconsistent"):
        Network(valid.weights[:1], valid.biases)


def test_held_out_error_is_the_rms_and_the_largest_difference():
    error = HeldOut.of(np.array([[3e-3, -1e-3], [-4e-3, 1e-3]]))
    np.testing.assert_allclose(error.rms, [np.sqrt(12.5) * 1e-3, 1e-3])
    assert (error.points, error.worst.tolist()) == (2, [4e-3, 1e-3])
    assert error.overall_rms == pytest.approx(np.sqrt((12.5 + 1) / 2) * 1e-3)


def test_can_be_pickled(surrogate):
    surrogate(random_points(1), surrogate.conditions.take([1]))
    assert pickle.loads(pickle.dumps(surrogate)).digest == surrogate.digest
