"""Train a network on simulations: Adam on its layers, then the last layer by least squares.

    m <- 0.9 m + 0.1 g,   v <- 0.999 v + 0.001 g^2,   w <- w - rate m / (sqrt(v) + 1e-8), both without their bias

Every product is the one of slipstick/uncertainty/product.py, so the network does not depend on the number of threads.
Source: Kingma, Ba: Adam: a method for stochastic optimization, ICLR 2015; the rate falls like a cosine (Loshchilov,
Hutter: SGDR: stochastic gradient descent with warm restarts, ICLR 2017).
"""

import math
from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np

from slipstick.matrix_product import matrix_product
from slipstick.table.network import Network, sigmoid
from slipstick.uncertainty.chaos.least_squares import projection

WIDTHS = (64, 64, 64)
"""Terms of the hidden layers. Wider or deeper by half was no better in the same time."""
BATCH = 250
RATE = 0.01
"""Of the first steps, once warm."""
_WARM = 200  # steps, in which Adam's averages fill
_DECAY, _SQUARE_DECAY = 0.9, 0.999
_RIDGE = 1e-10  # terms that are nearly the same share what they explain

Layers = list[np.ndarray]


def train(inputs: np.ndarray, times: np.ndarray, steps: int, rng: np.random.Generator,
          report: Callable[[int], None]) -> Network:
    """Fit a network to `times` (m, n) at `inputs` (m, d) of mean 0 and variance 1; `report` hears of every step.

    An error of a second counts the same in every condition. Single precision does for the hidden layers.
    """
    mean, scale = times.mean(axis=0), float(times.std(axis=0).mean()) or 1.0
    x, y = inputs.astype(np.float32), ((times - mean) / scale).astype(np.float32)
    layers = _start((x.shape[1], *WIDTHS, y.shape[1]), rng)
    averages, squares = [np.zeros_like(one) for one in layers], [np.zeros_like(one) for one in layers]
    for step, rows in enumerate(_batches(len(x), steps, rng), start=1):
        rate = RATE * min(1.0, step / _WARM) * (1 + math.cos(math.pi * step / steps)) / 2
        for value, slope, average, square in zip(layers, _gradient(layers, x[rows], y[rows]), averages, squares,
                                                 strict=True):
            average += (1 - _DECAY) * (slope - average)
            square += (1 - _SQUARE_DECAY) * (slope * slope - square)
            root = np.sqrt(square / (1 - _SQUARE_DECAY**step)) + 1e-8
            value -= rate / (1 - _DECAY**step) * average / root
        report(step)
    double = [one.astype(float) for one in layers]
    rough = Network(tuple(double[::2]), tuple(double[1::2]))
    weight, bias = _last_layer(rough.hidden(inputs), times - mean)
    return Network((*rough.weights[:-1], weight), (*rough.biases[:-1], bias + mean))


def _start(sizes: tuple[int, ...], rng: np.random.Generator) -> Layers:
    """Weights and biases in turn, such that every layer begins with values of about one."""
    layers: Layers = []
    for inputs, outputs in pairwise(sizes):
        layers.append((rng.normal(size=(inputs, outputs)) / math.sqrt(inputs)).astype(np.float32))
        layers.append(rng.uniform(-1, 1, outputs).astype(np.float32))
    return layers


def _batches(count: int, steps: int, rng: np.random.Generator) -> Iterator[np.ndarray]:
    size = min(BATCH, count)
    done = 0
    while True:
        order = rng.permutation(count)
        for first in range(0, count - size + 1, size):
            if done == steps:
                return
            yield order[first:first + size]
            done += 1


def _gradient(layers: Layers, inputs: np.ndarray, wanted: np.ndarray) -> Layers:
    """Slopes of the mean over the batch of the sum of squared errors, in the order of `layers`."""
    values, rises = [inputs], []
    for weight, bias in zip(layers[:-2:2], layers[1:-2:2], strict=True):
        before = matrix_product(values[-1], weight) + bias
        share = sigmoid(before)
        values.append(before * share)
        rises.append(share * (1 + before * (1 - share)))
    error = (2 / len(inputs)) * (matrix_product(values[-1], layers[-2]) + layers[-1] - wanted)
    slopes: Layers = []
    for number in range(len(values) - 1, -1, -1):
        slopes = [matrix_product(values[number].T, error), error.sum(axis=0), *slopes]
        if number:
            error = matrix_product(error, layers[2 * number].T) * rises[number - 1]
    return slopes


def _last_layer(terms: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weights (t, n) and biases (n,) of least squares on `terms` (m, t), with a ridge."""
    m, t = len(terms), terms.shape[1] + 1
    rows = np.vstack([np.column_stack([terms, np.ones(m)]), np.eye(t)])
    solve = projection(rows, np.concatenate([np.full(m, 1 / m), np.full(t, _RIDGE)]))
    solved = matrix_product(np.ascontiguousarray(solve[:, :m]), times)
    return solved[:-1], solved[-1]
