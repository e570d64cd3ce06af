import math
import pickle
import shutil
from dataclasses import replace
from itertools import pairwise

import h5py
import numpy as np
import pytest

from slipstick.clutch.conditions import paper_conditions
from slipstick.clutch.model import Model
from slipstick.errors import CorruptTable, InvalidValue, OutsideTable, WrongDigest, WrongLayout
from slipstick.storage.hdf5 import text
from slipstick.table import Axis, Grid, HeldOut, Network, Surrogate, Table
from slipstick.table.surrogate import germs
from slipstick.uncertainty import Inputs
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, exact

AXES = (Axis("pressure_bias", np.array([0.8, 1.2]), 1.6, "bar"),
        Axis("initial_position", np.array([0.5, 2.0]), 5e-4, "m"))


def network(sizes=(2, 7, 5, 3), seed=1):
    rng = np.random.default_rng(seed)
    return Network(tuple(rng.normal(size=pair) for pair in pairwise(sizes)),
                   tuple(rng.normal(size=size) for size in sizes[1:]))


@pytest.fixture
def surrogate():
    error = HeldOut(50, np.array([1e-4, 2e-4, 3e-4]), np.array([5e-4, 9e-4, 3e-4]))
    return Surrogate(AXES, network(), error, 1000, 2000, 7, paper_conditions().take([3, 100, 215]), Model(), "a test")


@pytest.fixture
def path(surrogate, tmp_path):
    surrogate.write(tmp_path / "surrogate.h5")
    return tmp_path / "surrogate.h5"


def points(count, seed=2):
    return np.random.default_rng(seed).uniform([0.8, 0.5], [1.2, 2.0], (count, 2))


def by_hand(surrogate, point):
    """One point through the network in plain Python, one term after the other."""
    values = [math.sqrt(12) * (x - (axis.lower + axis.upper) / 2) / (axis.upper - axis.lower)
              for x, axis in zip(point, surrogate.axes, strict=True)]
    layers = list(zip(surrogate.network.weights, surrogate.network.biases, strict=True))
    for number, (weight, bias) in enumerate(layers):
        sums = [sum(value * row[term] for value, row in zip(values, weight, strict=True)) + bias[term]
                for term in range(len(bias))]
        values = sums if number == len(layers) - 1 else [a / (1 + math.exp(-a)) for a in sums]
    return values


def test_agrees_with_its_slow_twin(surrogate):
    where = points(40)
    found = surrogate.interpolate(where, "error")
    np.testing.assert_allclose(found, [by_hand(surrogate, point) for point in where], rtol=1e-12, atol=1e-12)


def test_stays_finite_where_an_exponential_would_overflow():
    steep = Network((np.array([[1e4]]), np.array([[1.0]])), (np.array([0.0]), np.array([0.0])))
    assert steep(np.array([[-1.0], [1.0]])).tolist() == [[0.0], [1e4]]


def test_germs_of_uniform_points_have_mean_0_and_variance_1():
    found = germs(AXES, points(200_000))
    assert np.abs(found.mean(axis=0)).max() < 0.01
    assert np.abs(found.var(axis=0) - 1).max() < 0.01


def test_comes_back_as_it_was(surrogate, path):
    back = Table.open(path)
    assert isinstance(back, Surrogate)
    assert back.digest == surrogate.digest
    assert np.array_equal(back.interpolate(points(9)), surrogate.interpolate(points(9)))
    assert (back.runs, back.steps, back.seed, back.origin) == (1000, 2000, 7, "a test")
    assert (back.error.points, back.error.rms.tolist(), back.error.worst.tolist()) == (
        50, surrogate.error.rms.tolist(), surrogate.error.worst.tolist())
    assert Surrogate.open(path).digest == surrogate.digest
    with pytest.raises(WrongLayout, match="not a table of the kind grid"):
        Grid.open(path)


def test_the_digest_covers_all_that_matters_and_nothing_else(surrogate):
    later = network()
    later.weights[1][3, 2] = np.nextafter(later.weights[1][3, 2], 9)
    worse = HeldOut(50, surrogate.error.rms, surrogate.error.worst * 2)
    changes = [{"network": later}, {"error": worse}, {"error": replace(surrogate.error, points=51)}, {"runs": 1001},
               {"steps": 2001}, {"seed": 8}, {"model": Model().with_parameters({"gear_ratio": 3.0})},
               {"axes": (replace(AXES[0], nominal=1.7), AXES[1])}]
    others = {replace(surrogate, **change).digest for change in changes}
    assert len(others | {surrogate.digest}) == len(changes) + 1
    assert replace(surrogate, origin="other hands").digest == surrogate.digest


@pytest.mark.parametrize("dataset", ["network/0/weight", "network/2/bias", "error/rms", "error/worst"])
def test_a_flipped_bit_is_refused(path, dataset):
    with h5py.File(path) as file:
        offset = file[dataset].id.get_chunk_info(0).byte_offset
    content = bytearray(path.read_bytes())
    content[offset + 3] ^= 1
    path.write_bytes(content)
    with pytest.raises(CorruptTable, match="damaged"):
        Table.open(path)


def change_weight(file):
    file["network/1/weight"][2, 2] += 1e-12  # with a valid checksum: only the digest can tell


def flatter_error(file):
    file["error/rms"][:] *= 0.1


def claim_more_runs(file):
    file["network"].attrs["runs"] = 10**6


def lose_a_layer(file):
    del file["network/1"]


def skip_a_layer(file):
    file["network"].attrs["layers"] = 2


def claim_no_layers(file):
    file["network"].attrs["layers"] = 0


def claim_no_number(file):
    file["network"].attrs["seed"] = np.nan


def claim_too_much(file):
    file["network"].attrs["runs"] = 1e300


def spoil_a_weight(file):
    file["network/0/bias"][1] = np.nan


def turn_the_error_round(file):
    file["error/worst"][:] = 0.0


def change_unit(file):
    file["error/rms"].attrs["units"] = text("ms")


def widen_the_box(file):
    file["axes/pressure_bias"][1] = 1.3


@pytest.mark.parametrize(("damage", "error", "says"), [
    (change_weight, WrongDigest, "The content"), (flatter_error, WrongDigest, "The content"),
    (claim_more_runs, WrongDigest, "The content"), (widen_the_box, WrongDigest, "The content"),
    (lose_a_layer, CorruptTable, "'network/1' is missing"), (skip_a_layer, CorruptTable, "is in '1', not in 's'"),
    (claim_no_layers, CorruptTable, "layers of the network"), (spoil_a_weight, CorruptTable, "not finite"),
    (claim_no_number, CorruptTable, "'seed' of 'network' is nan"), (claim_too_much, CorruptTable, "300, no count"),
    (turn_the_error_round, CorruptTable, "held-out errors are none"),
    (change_unit, CorruptTable, "'error/rms' is in 'ms', not in 's'"),
], ids=lambda value: getattr(value, "__name__", ""))
def test_what_does_not_match_is_refused_and_said(path, damage, error, says):
    broken = path.with_name("broken.h5")
    shutil.copy(path, broken)
    with h5py.File(broken, "r+") as file:
        damage(file)
    with pytest.raises(error, match=says):
        Table.open(broken)


def test_conditions_are_matched_by_what_they_are(surrogate):
    whole = surrogate.interpolate(points(20))
    few = surrogate.restricted(paper_conditions().take([215, 3]))
    assert np.array_equal(few.interpolate(points(20)), whole[:, [2, 0]])
    assert few.error.rms.tolist() == surrogate.error.rms[[2, 0]].tolist()
    assert np.array_equal(surrogate(points(20), paper_conditions().take([100])), whole[:, [1]])
    with pytest.raises(InvalidValue, match="is not in the table"):
        surrogate(points(1), paper_conditions().take([3, 4]))


def test_what_lies_outside_is_an_error_the_edge_or_nan_as_for_a_grid(surrogate):
    shape = (2, 2, 3)
    grid = Grid(AXES, np.ones(shape), np.zeros(shape, np.uint8), surrogate.conditions, Model())
    where = np.array([[1.0, 1.0], [0.2, 1.0], [1.0, 2.7], [9.0, -9.0]])
    edge = np.array([[1.0, 1.0], [0.8, 1.0], [1.0, 2.0], [1.2, 0.5]])
    assert np.array_equal(surrogate.interpolate(where, "clip"), surrogate.interpolate(edge, "error"))
    said = []
    for table in (grid, surrogate):
        assert np.isnan(table.interpolate(where, "nan")).all(axis=1).tolist() == [False, True, True, True]
        with pytest.raises(OutsideTable, match=r"Point 1 has pressure_bias = 0\.2, outside the table's 0\.8") as caught:
            table.interpolate(where, "error")
        said.append(str(caught.value))
    assert said[0] == said[1]
    assert surrogate.interpolate(np.empty((0, 2))).shape == (0, 3)
    with pytest.raises(InvalidValue, match="not finite in initial_position"):
        surrogate.interpolate(np.array([[1.0, np.nan]]))


def test_is_smooth_so_likelihoods_take_it_without_knots(surrogate):
    assert surrogate.knots is None
    measured = surrogate.interpolate(np.array([[1.0, 1.2]]))[0]
    problem = InferenceProblem(surrogate, surrogate.conditions, measured, surrogate.lower, surrogate.upper, ("a", "b"))
    candidate = Candidate(Inputs([1.0, 1.2], [0.01, 0.01]), 0.05)
    normals = np.random.default_rng(3).standard_normal((400_000, 2))
    residual = (surrogate(candidate.inputs.points(normals), surrogate.conditions) - measured) / 0.05
    sampled = np.log10(np.mean(np.exp(-residual**2 / 2), axis=0) / (0.05 * math.sqrt(2 * math.pi))) - 3
    np.testing.assert_allclose(exact(problem, candidate), sampled, atol=5e-3)


def test_contradictions_are_refused(surrogate):
    wide = (replace(AXES[0], values=np.array([0.8, 1.0, 1.2])), AXES[1])
    for change, says in [({"network": network((3, 4, 3))}, "does not take 2 axes to 3 conditions"),
                         ({"network": network((2, 4, 2))}, "does not take 2 axes to 3 conditions"),
                         ({"error": HeldOut(5, np.ones(2), np.ones(2))}, "not one a condition"),
                         ({"axes": wide}, "more than its two ends"), ({"axes": AXES[:1] * 2}, "each parameter once")]:
        with pytest.raises(InvalidValue) as caught:
            replace(surrogate, **change)
        assert says in str(caught.value)
    with pytest.raises(InvalidValue, match="held-out errors"):
        HeldOut(0, np.ones(2), np.ones(2))
    one = network((2, 4, 3))
    with pytest.raises(InvalidValue, match="do not fit together"):
        Network(one.weights[::-1], one.biases[::-1])
    with pytest.raises(InvalidValue, match="do not fit together"):
        Network(one.weights[:1], one.biases)


def test_an_error_is_its_rms_and_its_worst():
    error = HeldOut.of(np.array([[3e-3, -1e-3], [-4e-3, 1e-3]]))
    np.testing.assert_allclose(error.rms, [np.sqrt(12.5) * 1e-3, 1e-3])
    assert (error.points, error.worst.tolist()) == (2, [4e-3, 1e-3])
    assert error.overall_rms == pytest.approx(np.sqrt((12.5 + 1) / 2) * 1e-3)


def test_travels_to_another_process(surrogate):
    surrogate(points(1), surrogate.conditions.take([1]))
    assert pickle.loads(pickle.dumps(surrogate)).digest == surrogate.digest
