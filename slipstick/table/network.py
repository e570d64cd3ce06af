"""A small feed-forward neural network with layers y = silu(x W + b); the last layer is linear.

    silu(a) = a / (1 + exp(-a))

The network is smooth. It approximates a kink along any hyperplane of its inputs with a few units, where a polynomial
needs thousands of terms. Source: Elfwing, Uchibe, Doya: Sigmoid-weighted linear units for neural network function
approximation in reinforcement learning, Neural Networks 107 (2018), 3-11.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.numerics.matrix_product import matrix_product
from slipstick.table.derivatives import Derivatives


@dataclass(frozen=True, eq=False)
class Network:
    """`weights` (inputs, outputs) and `biases` (outputs,) of each layer, from input to output.

    Raises `InvalidValue` if the shapes of the layers are inconsistent or a number is not finite.
    """

    weights: tuple[np.ndarray, ...]
    biases: tuple[np.ndarray, ...]

    def __post_init__(self) -> None:
        """Check shapes and finiteness."""
        consistent = len(self.weights) == len(self.biases) > 0 and all(
            weight.ndim == 2 and bias.shape == weight.shape[1:]
            for weight, bias in zip(self.weights, self.biases, strict=True))
        if not consistent or any(first.shape[1] != second.shape[0] for first, second in pairwise(self.weights)):
            raise InvalidValue("The shapes of the layers of the network are inconsistent",
                               "Give weights (inputs, outputs) and biases (outputs,) for each layer")
        if not all(np.isfinite(array).all() for array in (*self.weights, *self.biases)):
            raise InvalidValue("The network has weights that are not finite", "Train it with a smaller learning rate")

    def hidden(self, inputs: np.ndarray) -> np.ndarray:
        """Activations of the last hidden layer at `inputs` (m, d): shape (m, t)."""
        values = inputs
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            values = silu(matrix_product(values, weight) + bias)
        return values

    def __call__(self, inputs: np.ndarray) -> np.ndarray:
        """Outputs at `inputs` (m, d): shape (m, n), bit-identical on any number of threads."""
        outputs: np.ndarray = matrix_product(self.hidden(inputs), self.weights[-1]) + self.biases[-1]
        return outputs

    def derivatives(self, inputs: np.ndarray) -> Derivatives:
        """Outputs (n,) at `inputs` (d,), and their derivatives, carried forward through the layers."""
        values, first = inputs, np.eye(len(inputs))  # the derivatives with respect to the inputs are rows
        second = np.zeros((len(inputs), len(inputs), len(inputs)))
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            values, first, second = values @ weight + bias, first @ weight, second @ weight
            gate = sigmoid(values)
            slope = gate * (1 + values * (1 - gate))
            curvature = gate * (1 - gate) * (2 + values * (1 - 2 * gate))
            second = second * slope + curvature * first[:, None] * first
            values, first = values * gate, first * slope
        weight = self.weights[-1]
        return Derivatives(values @ weight + self.biases[-1], (first @ weight).T, np.moveaxis(second @ weight, -1, 0))

    def take(self, outputs: np.ndarray) -> "Network":
        """The network with only the outputs at these indices."""
        return Network((*self.weights[:-1], np.ascontiguousarray(self.weights[-1][:, outputs])),
                       (*self.biases[:-1], self.biases[-1][outputs]))


def sigmoid(values: np.ndarray) -> np.ndarray:
    """Logistic function 1 / (1 + exp(-a)), computed from tanh, which does not overflow."""
    result: np.ndarray = 0.5 * (1 + np.tanh(0.5 * values))
    return result


def silu(values: np.ndarray) -> np.ndarray:
    """Activation function a / (1 + exp(-a))."""
    result: np.ndarray = values * sigmoid(values)
    return result
