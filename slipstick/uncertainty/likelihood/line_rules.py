"""Where to lay the lines along which a likelihood is integrated (lines.py).

In one or two inputs of a model that is linear between knots, such as a table: along the input that moves the times
most, broken at the knots, and so is the Gauss rule across the lines. The integral is then that of the table as it
stands, and smooth in mean and std. For any other model along the direction in which the times change most, all
conditions together.
"""

from itertools import pairwise

import numpy as np
from scipy.special import roots_legendre

from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.likelihood.lines import Lines
from slipstick.uncertainty.sampling import standard_normals

WINDOW = 5.5
"""Lines end so many stds from the centre, unless a measured time draws them further."""
STEP = 0.5
"""Stds between the points of `ACROSS` lines that no knots break."""
ACROSS = 64
"""Lines quadrature in three inputs and more by default, a power of two."""
_PIECE = 1.0  # longest piece of the rule across the lines, in stds
_FEWEST_NODES, _MOST_NODES = 2, 10  # Gauss nodes of a piece
_NODES_A_WIDTH = 1.5  # for each width over which a density rises or falls where the time does not depend on z
_SCORES = np.arange(-WINDOW, WINDOW + 0.0625, 0.125)
"""Where lines are broken besides the knots for inputs that are not linear in their score. A uniform input then adds
0.0002 decades a condition on average and 0.002 at most, a beta one with its peaks at the ends of its support five times
that; at twice the step it is up to four times as much."""
Knots = tuple[np.ndarray, ...]
"""Rising values of each input between which a model is linear."""


def knotted(inputs: Inputs, knots: Knots, slopes: np.ndarray, noise: float, reach: float) -> Lines:
    """Lines for a model of one or two inputs that is linear between `knots`; neither input fixes the other.

    `slopes` (d, n) are the changes of the times in s with each normal score, `noise` the output std in s, and `reach`
    how many stds from the centre a measured time may draw the inputs.
    """
    inner = int(np.argmax(np.median(np.abs(slopes), axis=1)))
    if inputs.dimension == 1:
        across, log_weight, shift, scale = np.zeros((1, 0)), np.zeros(1), np.zeros(1), 1.0
        factor = np.ones((1, 1))
    else:
        correlation = float(inputs.factor[0] @ inputs.factor[1])
        scale = np.sqrt(1.0 - correlation**2)
        width = noise / max(noise, float(np.nanmax(np.abs(slopes[1 - inner]))))
        nodes, log_weight = _composite(_breaks(inputs, knots, 1 - inner, 0.0, 1.0, reach), width)
        across, shift = nodes[:, None], correlation * nodes
        factor = np.array([[scale, correlation], [0.0, 1.0]])[[inner, 1 - inner]]
    rows = [_breaks(inputs, knots, inner, each, scale, reach) for each in shift]
    if inputs.families[inner] != "normal":  # a linear model is then not linear in the score
        rows = [np.union1d(row, _SCORES) for row in rows]
    longest = max(len(row) for row in rows)
    breakpoints = np.array([np.pad(row, (0, longest - len(row)), mode="edge") for row in rows])
    return Lines(breakpoints, across, log_weight, factor)


def along(direction: np.ndarray, factor: np.ndarray, reach: float = WINDOW, count: int = ACROSS,
          seed: int = 1) -> Lines:
    """Lines along `direction` (d,) in standard normals whose scores are `factor` times them, for any model.

    Across them lies an even rule in two dimensions, and `count` seeded samples in more. `count` also sets how finely
    the lines are broken: half a std at 64, a quarter at 256.
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


def _breaks(inputs: Inputs, knots: Knots, axis: int, shift: float, scale: float, reach: float) -> np.ndarray:
    """The knots of one input as standard normals, given the other, and the ends of the window around them."""
    if inputs.marginal_std[axis] == 0:
        return np.array([-WINDOW, WINDOW])
    at = (inputs.scores(axis, knots[axis]) - shift) / scale
    low, high = min(-WINDOW, max(-reach, at[0])), max(WINDOW, min(reach, at[-1]))
    return np.concatenate([[low], at[(at > low) & (at < high)], [high]])


def _composite(breaks: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and log weights of Gauss rules between the breaks, times the normal density."""
    nodes, weights = [], []
    for low, high in pairwise(breaks):
        pieces = int(np.ceil((high - low) / _PIECE))
        half = (high - low) / pieces / 2
        count = min(_MOST_NODES, _FEWEST_NODES + int(np.ceil(_NODES_A_WIDTH * 2 * half / width)))
        roots, shares = roots_legendre(count)
        centres = low + half * (2 * np.arange(pieces) + 1)
        nodes.append((centres[:, None] + half * roots).ravel())
        weights.append(np.tile(half * shares, pieces))
    at = np.concatenate(nodes)
    return at, np.log(np.concatenate(weights)) + _log_normal(at)


def _log_normal(at: np.ndarray) -> np.ndarray:
    density: np.ndarray = -0.5 * at * at - 0.5 * np.log(2 * np.pi)
    return density
