"""Placement of the lines along which a likelihood is integrated (lines.py).

For a model of one or two inputs that is linear between knots, such as a table, the lines run along the input with the
largest effect on the times. Breakpoints are placed at the knots, both along the lines and in the Gauss rule across
them. The integral is then that of the interpolated table, and smooth in mean and std. For any other model, the lines
run along the direction in which the times of all conditions together change most.
"""

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np
import scipy

from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.likelihood.lines import Lines
from slipstick.uncertainty.sampling import standard_normals

WINDOW = 5.5
"""Half length of a line in stds; longer if a measured time requires it."""
_TAIL = math.sqrt(2 * math.log(1e5))
"""Beyond an edge of the knots at e stds, where a clipped model is constant, the normal density is 1e-5 of that at the
edge at sqrt(e^2 + _TAIL^2) stds. A measured time beyond all times of a table has its likelihood there."""
STEP = 0.5
"""Distance in stds of the breakpoints of a line without knots, if `ACROSS` lines are used."""
ACROSS = 64
"""Default number of lines for three or more inputs, a power of two."""
_PIECE = 1.0  # largest length of a piece of the rule across the lines, in stds
_FEWEST_NODES, _MOST_NODES = 2, 10  # Gauss nodes per piece
_NODES_PER_WIDTH = 1.5  # Gauss nodes per width over which the density changes if the time does not depend on z
_SCORES = np.arange(-WINDOW, WINDOW + 0.0625, 0.125)
"""Additional breakpoints for inputs that are not linear in their normal scores. The remaining error for a uniform input
is 0.0002 decades per condition on average and 0.002 at most; for a beta input with peaks at the ends of its support it
is five times as large. Twice the step multiplies the error by up to four."""
Knots = tuple[np.ndarray, ...]
"""Increasing values of each input between which a model is linear."""


def knotted_lines(inputs: Inputs, knots: Knots, slopes: np.ndarray, noise: float, reach: float, more: int = 0) -> Lines:
    """Lines for a model of one or two inputs, not perfectly correlated, that is linear between `knots`.

    `slopes` (d, n) are the derivatives of the times in s with respect to each normal score, `noise` is the output std
    in s, `reach` is the largest half length of a line in stds, and `more` the number of additional Gauss nodes per
    piece of the rule across the lines.
    """
    inner = int(np.argmax(np.median(np.abs(slopes), axis=1)))  # the input along the lines
    if inputs.dimension == 1:
        across, log_weight, shift, scale = np.zeros((1, 0)), np.zeros(1), np.zeros(1), 1.0
        factor = np.ones((1, 1))
    else:
        correlation = float(inputs.factor[0] @ inputs.factor[1])
        scale = np.sqrt(1.0 - correlation**2)
        width = noise / max(noise, float(np.nanmax(np.abs(slopes[1 - inner]))))
        nodes, log_weight = _composite(_breaks(inputs, knots, 1 - inner, np.zeros(1), 1.0, reach)[0], width, more)
        across, shift = nodes[:, None], correlation * nodes
        factor = np.array([[scale, correlation], [0.0, 1.0]])[[inner, 1 - inner]]
    breakpoints = _breaks(inputs, knots, inner, shift, scale, reach)
    if inputs.families[inner] != "normal":  # the model is linear in the input, but not in the score
        scores = np.tile(_SCORES, (len(breakpoints), 1))
        breakpoints = np.sort(np.concatenate([breakpoints, scores], axis=1), axis=1)
    return Lines(breakpoints, across, log_weight, factor)


def along(direction: np.ndarray, factor: np.ndarray, reach: float = WINDOW, count: int = ACROSS,
          seed: int = 1) -> Lines:
    """Lines along `direction` (d,) in the space of the standard normals u, whose scores are `factor` u, for any model.

    The rule across the lines is equidistant for two inputs, and consists of `count` seeded samples for more. `count`
    also determines the distance of the breakpoints: half a std for 64 lines, a quarter for 256.
    """
    step = STEP * np.sqrt(ACROSS / count)
    d = len(direction)
    first = int(np.argmax(np.abs(direction)))
    others = np.delete(np.eye(d), first, axis=1)
    rotation = np.linalg.qr(np.column_stack([direction, others]))[0]
    end = np.ceil(reach / step) * step
    if d == 1:
        across, log_weight = np.zeros((1, 0)), np.zeros(1)
    elif d == 2:
        steps = np.arange(-WINDOW, WINDOW + step / 2, step)
        across, log_weight = steps[:, None], _log_normal(steps) + np.log(step)
    else:
        across, log_weight = standard_normals(d - 1, count, seed), np.full(count, -np.log(count))
    return Lines(np.tile(np.arange(-end, end + step / 2, step), (len(across), 1)), across, log_weight,
                 factor @ rotation)


def domain(inputs: Inputs, knots: Knots, axis: int, reach: float) -> tuple[float, float]:
    """The range of normal scores of one input that is integrated; beyond its outermost knots as far as they matter."""
    if inputs.marginal_std[axis] == 0:
        return -reach, reach
    return _ends(inputs.scores(axis, knots[axis][[0, -1]]), reach)


def _ends(normals: np.ndarray, reach: float) -> tuple[float, float]:
    low, high = _scores_beyond(normals[[0, -1]])
    return min(-WINDOW, max(-reach, float(low))), max(WINDOW, min(reach, float(high)))


def _scores_beyond(edges: np.ndarray) -> np.ndarray:
    """Normal scores (..., 2) that lie beyond the first and the last knot by as much as matters."""
    return np.asarray(np.hypot(edges, _TAIL) * [-1, 1])


def _breaks(inputs: Inputs, knots: Knots, axis: int, shift: np.ndarray, scale: float, reach: float) -> np.ndarray:
    """The knots of one input as standard normals, conditional on the other input, and the two ends of each line.

    Shape (m, g) for the shifts (m,) of the lines. Knots beyond an end of a line coincide with it.
    """
    if inputs.marginal_std[axis] == 0:
        return np.tile([-WINDOW, WINDOW], (len(shift), 1))
    normals = (inputs.scores(axis, knots[axis]) - shift[:, None]) / scale
    ends = _scores_beyond(normals[:, [0, -1]])
    low = np.minimum(-WINDOW, np.maximum(-reach, ends[:, :1]))
    high = np.maximum(WINDOW, np.minimum(reach, ends[:, 1:]))
    inside = normals[:, np.any((normals > low) & (normals < high), axis=0)]
    # In C order, whatever that of the parts: the kernels are compiled for one order.
    return np.ascontiguousarray(np.concatenate([low, np.clip(inside, low, high), high], axis=1))


def _composite(breaks: np.ndarray, width: float, more: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and log weights of composite Gauss rules between the breakpoints; the weights include the density."""
    nodes, weights = [], []
    for low, high in pairwise(breaks):
        pieces = int(np.ceil((high - low) / _PIECE))
        half = (high - low) / pieces / 2
        count = min(_MOST_NODES, _FEWEST_NODES + int(np.ceil(_NODES_PER_WIDTH * 2 * half / width))) + more
        roots, root_weights = _gauss_legendre(count)
        centres = low + half * (2 * np.arange(pieces) + 1)
        nodes.append((centres[:, None] + half * roots).ravel())
        weights.append(np.tile(half * root_weights, pieces))
    normals = np.concatenate(nodes)
    return normals, np.log(np.concatenate(weights)) + _log_normal(normals)


@lru_cache(maxsize=_MOST_NODES)
def _gauss_legendre(count: int) -> tuple[np.ndarray, np.ndarray]:
    roots, weights = scipy.special.roots_legendre(count)
    return roots, weights


def _log_normal(normals: np.ndarray) -> np.ndarray:
    return np.asarray(-0.5 * normals * normals - 0.5 * np.log(2 * np.pi))
