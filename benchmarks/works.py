"""The work that `make bench` measures: what this project and its peers do, and the errors of each."""

import functools
from collections.abc import Callable, Iterator
from importlib.util import find_spec

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from benchmarks import scalar_cpp, scalar_dopri, simulator
from benchmarks.benches import AXES, HEAVY, make_grid
from benchmarks.expansion_peers import BASIS, Peers
from benchmarks.likelihood import CASES, FITTED, reference
from benchmarks.peers import FASTEST, Code, Work
from benchmarks.whole_fit import whole_fit
from slipstick.inference.problems import table_problem
from slipstick.numerics.matrix_product import multiply
from slipstick.numerics.register_tile import ROW_BYTES, ROWS
from slipstick.recordings import Recordings
from slipstick.table import Grid
from slipstick.table.axis import Axis
from slipstick.uncertainty import Inputs, log10_mean_density
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, converged

SAMPLES = 10_000
EXPANDED = Inputs(np.ones(2), np.array([0.05, 0.08]))


def works() -> Iterator[Work]:
    """All work, on the default table, which is simulated here."""
    table = default_table()
    problem = table_problem(table, Recordings.open("tables/measured.h5"), "clip")
    interpolator = RegularGridInterpolator([axis.values for axis in table.axes], table.times)
    yield likelihood(table, interpolator, problem)
    for noise in (0.003, 0.005, 0.010, 0.020):
        for std in (0.03, 0.06, 0.12):
            yield visited_likelihood(table, interpolator, problem, Candidate(Inputs([1.0, 1.0], [std, std]), noise))
    yield expansion(table)
    yield interpolation(table, interpolator)
    yield shifting_times()
    yield from effects()
    yield whole_fit(problem)


def default_table() -> Grid:
    """The table of the README: 50 x 50 points, 216 conditions."""
    grid = make_grid(50)
    axes = tuple(Axis(name, np.unique(grid[:, 0]), 1.0, "1") for name in AXES)
    times = simulator.ensemble.shifting_times(simulator.MODEL, HEAVY.conditions, AXES, grid)[0].reshape(50, 50, -1)
    return Grid(axes, times, np.zeros(times.shape, np.uint8), HEAVY.conditions, simulator.MODEL)


def likelihood(table: Grid, interpolator: RegularGridInterpolator, problem: InferenceProblem) -> Work:
    """The log10 likelihood of the shipped recordings at their fit."""
    candidate, measured_time = CASES[FITTED], problem.measured_time
    inputs, noise = candidate.inputs, candidate.output_std
    exact = reference(problem, candidate)
    normals = np.random.default_rng(1).standard_normal((SAMPLES, 2))
    values_of_basis = BASIS.at(normals)

    def ours() -> np.ndarray:
        return converged(problem, candidate)[0]

    def monte_carlo() -> np.ndarray:
        samples = np.clip(inputs.mean + inputs.marginal_std * normals, table.lower, table.upper)
        return log10_mean_density(interpolator(samples), measured_time, noise)

    def expansion_and_samples() -> np.ndarray:
        nodes = np.clip(inputs.mean + inputs.marginal_std * BASIS.nodes, table.lower, table.upper)
        times = values_of_basis @ (BASIS.projection @ interpolator(nodes))
        return log10_mean_density(times, measured_time, noise)

    def code(function) -> Code:
        return Code(function, lambda: abs(float(function().sum()) - exact))

    return Work("log10 likelihood of 216 conditions", code(ours),
                {"10,000 samples by scipy's RegularGridInterpolator, numpy": code(monte_carlo),
                 "expansion of order 8 and 10,000 samples, numpy": code(expansion_and_samples)},
                "decades", {FASTEST: 10.0}, limit=2.0)


def visited_likelihood(table: Grid, interpolator: RegularGridInterpolator, problem: InferenceProblem,
                       candidate: Candidate) -> Work:
    """The log10 likelihood of a candidate as a fit visits them: the shipped recordings are far from some of them."""
    inputs, noise = candidate.inputs, candidate.output_std
    exact = reference(problem, candidate)
    normals = np.random.default_rng(1).standard_normal((SAMPLES, 2))

    def monte_carlo() -> np.ndarray:
        samples = np.clip(inputs.mean + inputs.marginal_std * normals, table.lower, table.upper)
        return log10_mean_density(interpolator(samples), problem.measured_time, noise)

    def code(function) -> Code:
        return Code(function, lambda: abs(float(function().sum()) - exact))

    return Work(f"log10 likelihood, output std {1e3 * noise:g} ms, inputs {100 * inputs.marginal_std[0]:g} %",
                code(lambda: converged(problem, candidate).density),
                {"10,000 samples by scipy's RegularGridInterpolator, numpy": code(monte_carlo)}, "decades",
                {FASTEST: 10.0})


def expansion(table: Grid) -> Work:
    """Projection on the polynomials of order 8, and 10,000 x 216 values of the expansion."""
    germs = np.random.default_rng(1).standard_normal((SAMPLES, 2))
    peers = Peers(table.interpolate(EXPANDED.at_germs(BASIS.nodes)), germs)
    basis, projection, times = (array.astype(np.longdouble) for array in (
        peers.values_of_basis, BASIS.projection, peers.times))
    extended = basis @ (projection @ times)

    def code(function) -> Code:
        return Code(function, lambda: float(np.abs(function() - extended).max()))

    return Work("expansion of order 8: projection, and 10,000 x 216 values", code(peers.ours),
                {"chaospy": code(peers.chaospy), "OpenTURNS": code(peers.openturns),
                 "numpy, basis at the samples made in advance": code(peers.numpy)},
                "s", {"chaospy": 40.0, "OpenTURNS": 60.0, "numpy, basis at the samples made in advance": 1.5},
                floors={"the fused operations of the values, in double precision": _fused_operations(
                    len(germs) * times.shape[1] * len(projection))})


def interpolation(table: Grid, interpolator: RegularGridInterpolator) -> Work:
    """10,000 points in the table, 216 conditions each."""
    samples = np.random.default_rng(1).uniform(0.5, 1.5, (SAMPLES, 2))

    def gather(kind: type = np.float64) -> np.ndarray:
        (first, p), (second, q) = (_cells(axis.values.astype(kind), x) for axis, x in zip(
            table.axes, samples.T.astype(kind), strict=True))
        times = table.times
        return ((1 - p) * ((1 - q) * times[first, second] + q * times[first, second + 1])
                + p * ((1 - q) * times[first + 1, second] + q * times[first + 1, second + 1]))

    extended = functools.cache(lambda: gather(np.longdouble))

    def code(function) -> Code:
        return Code(function, lambda: float(np.abs(function() - extended()).max()))

    return Work("interpolation of 10,000 points x 216", code(lambda: table.interpolate(samples)),
                {"scipy's RegularGridInterpolator": code(lambda: interpolator(samples)),
                 "numpy, gathered": code(gather)},
                "s", {FASTEST: 3.0},
                floors={"filling an array of this size": Code(lambda: np.full((SAMPLES, 216), 0.5))})


def shifting_times() -> Work:
    """Shifting times of 21,600 engagements."""
    script, jitted, compiled, vectorized = (
        "scipy solve_ivp, Python (12 engagements, scaled)", "scalar Dormand-Prince 5(4), numba",
        "scalar Dormand-Prince 5(4), C++", "diffrax, Dormand-Prince 5(4), 216 conditions at a time")
    peers = {jitted: _simulate(scalar_dopri.shifting_times, simulator.DOPRI_TOLERANCE)}
    left_out = {}
    if missing := scalar_cpp.missing():
        left_out[compiled] = missing
    else:
        peers[compiled] = _simulate(scalar_cpp.shifting_times, simulator.DOPRI_TOLERANCE)
    if find_spec("diffrax"):
        from benchmarks import diffrax_peer
        peers[vectorized] = _simulate(diffrax_peer.shifting_times, simulator.DIFFRAX_TOLERANCE)
    else:
        left_out[vectorized] = "diffrax is not installed"
    peers[script] = Code(simulator.script, simulator.script_error,
                         len(simulator.SUBSET) * len(HEAVY.conditions) / len(simulator.SCIPY_RUNS))
    return Work("shifting times of 21,600 engagements, one core",
                Code(simulator.one_core, simulator.ensemble_error), peers, "s",
                {jitted: 12.0, compiled: 12.0, script: 5000.0}, repeats=1, left_out=left_out)


def _simulate(code: Callable[..., np.ndarray], tolerance: float) -> Code:
    return Code(lambda: simulator.simulate(code, tolerance), lambda: simulator.simulated_error(code, tolerance))


def effects() -> Iterator[Work]:
    """The ensemble with all effects compiled in, neutral or three active, beside itself without any.

    The targets are times of 1.1 and 2.
    """
    bare, without = Code(simulator.CatalogueProcess("bare").run), "itself without effects"
    for catalogue, words, target in (("full", "all effects compiled in and neutral", 1 / 1.1),
                                     ("three", "three effects active", 0.5)):
        ours = Code(simulator.CatalogueProcess(catalogue).run)
        yield Work(f"shifting times, {words}, one core", ours, {without: bare}, "s", {without: target}, repeats=1)


def _fused_operations(count: int) -> Code:
    """So many fused operations on operands that stay in the first cache: one tile of a product with itself again."""
    columns = ROW_BYTES // 8
    repeated = count // (ROWS * columns)
    left = np.broadcast_to(np.array([0.5]), (ROWS, repeated))
    right, result = np.broadcast_to(np.ones(columns), (repeated, columns)), np.empty((ROWS, columns))
    return Code(lambda: multiply(left, right, result))


def _cells(grid: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    cell = np.clip(np.searchsorted(grid, x, side="right") - 1, 0, len(grid) - 2)
    return cell, ((x - grid[cell]) / (grid[cell + 1] - grid[cell]))[:, None]
