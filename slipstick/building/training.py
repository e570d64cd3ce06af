"""Train a network on simulations: all layers with Adam, then the last layer by least squares.

    m <- 0.9 m + 0.1 g,   v <- 0.999 v + 0.001 g^2,   w <- w - rate m / (sqrt(v) + 1e-8), m and v bias-corrected

All matrix products are those of slipstick/numerics/matrix_product.py, so that the network does not depend on the number
of threads. Source: Kingma, Ba: Adam: a method for stochastic optimization, ICLR 2015; the rate decays as a cosine
(Loshchilov, Hutter: SGDR: stochastic gradient descent with warm restarts, ICLR 2017).
"""

import math
from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np

from slipstick.numerics.matrix_product import matrix_product
from slipstick.table.network import Network, sigmoid
from slipstick.uncertainty.chaos.least_squares import projection

WIDTHS = (64, 64, 64)
"""Units of the hidden layers. Networks 50 % wider or deeper were no better after the same training time."""
BATCH = 250
"""Points per step."""
RATE = 0.01
"""Learning rate at the start of the cosine decay; the warm-up raises the rate to it linearly."""
_WARM_UP = 200  # steps until Adam's moment estimates are settled
_DECAY, _SQUARE_DECAY = 0.9, 0.999  # of the first and second moments
_RIDGE = 1e-10  # makes the least-squares problem well-posed if hidden units are nearly collinear

Layers = list[np.ndarray]


def train(inputs: np.ndarray, times: np.ndarray, steps: int, rng: np.random.Generator,
          report: Callable[[int], None]) -> Network:
    """Fit a network to `times` (m, n) in s at `inputs` (m, d) of mean 0 and variance 1.

    All conditions share one scale, so that an error of 1 s has the same weight in each. The hidden layers are trained
    in single precision, the last layer is solved in double precision. `report` is called with the number of every step.
    """
    mean, scale = times.mean(axis=0), float(times.std(axis=0).mean()) or 1.0
    x, y = inputs.astype(np.float32), ((times - mean) / scale).astype(np.float32)
    layers = _initial_layers((x.shape[1], *WIDTHS, y.shape[1]), rng)
    first_moments = [np.zeros_like(layer) for layer in layers]
    second_moments = [np.zeros_like(layer) for layer in layers]
    for step, rows in enumerate(_batches(len(x), steps, rng), start=1):
        rate = RATE * min(1.0, step / _WARM_UP) * (1 + math.cos(math.pi * step / steps)) / 2
        gradients = _gradient(layers, x[rows], y[rows])
        for layer, gradient, first, second in zip(layers, gradients, first_moments, second_moments, strict=True):
            first += (1 - _DECAY) * (gradient - first)
            second += (1 - _SQUARE_DECAY) * (gradient * gradient - second)
            root = np.sqrt(second / (1 - _SQUARE_DECAY**step)) + 1e-8
            layer -= rate / (1 - _DECAY**step) * first / root
        report(step)
    double = [layer.astype(float) for layer in layers]
    trained = Network(tuple(double[::2]), tuple(double[1::2]))
    weight, bias = _last_layer(trained.hidden(inputs), times - mean)
    return Network((*trained.weights[:-1], weight), (*trained.biases[:-1], bias + mean))


def _initial_layers(sizes: tuple[int, ...], rng: np.random.Generator) -> Layers:
    """Random weights and biases in alternation, scaled so that the values of every layer are of order one."""
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


def _gradient(layers: Layers, inputs: np.ndarray, targets: np.ndarray) -> Layers:
    """Gradient of the sum of squared errors, averaged over the batch, in the order of `layers`."""
    values, derivatives = [inputs], []
    for weight, bias in zip(layers[:-2:2], layers[1:-2:2], strict=True):
        argument = matrix_product(values[-1], weight) + bias
        gate = sigmoid(argument)
        values.append(argument * gate)
        derivatives.append(gate * (1 + argument * (1 - gate)))
    error = (2 / len(inputs)) * (matrix_product(values[-1], layers[-2]) + layers[-1] - targets)
    gradients: Layers = []
    for number in range(len(values) - 1, -1, -1):
        gradients = [matrix_product(values[number].T, error), error.sum(axis=0), *gradients]
        if number:
            error = matrix_product(error, layers[2 * number].T) * derivatives[number - 1]
    return gradients


def _last_layer(hidden: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weights (t, n) and biases (n,) by ridge regression of `times` (m, n) on the last hidden layer `hidden` (m, t)."""
    m, t = len(hidden), hidden.shape[1] + 1
    rows = np.vstack([np.column_stack([hidden, np.ones(m)]), np.eye(t)])
    solution_matrix = projection(rows, np.concatenate([np.full(m, 1 / m), np.full(t, _RIDGE)]))
    coefficients = matrix_product(np.ascontiguousarray(solution_matrix[:, :m]), times)
    return coefficients[:-1], coefficients[-1]
