"""A small neural network: layers y = silu(x W + b), the last one linear.

    silu(a) = a / (1 + exp(-a))

It is smooth, and follows a kink along any plane through its inputs with a few terms, where polynomials need thousands.
Source: Elfwing, Uchibe, Doya: Sigmoid-weighted linear units for neural network function approximation in reinforcement
learning, Neural Networks 107 (2018), 3-11.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from slipstick.errors import InvalidValue
from slipstick.matrix_product import matrix_product


@dataclass(frozen=True, eq=False)
class Network:
    """`weights` (inputs, outputs) and `biases` (outputs,) of each layer in turn.

    Raises `InvalidValue` where one layer does not fit the next, or a number is not finite.
    """

    weights: tuple[np.ndarray, ...]
    biases: tuple[np.ndarray, ...]

    def __post_init__(self) -> None:
        """Check the shapes once."""
        paired = len(self.weights) == len(self.biases) > 0 and all(
            weight.ndim == 2 and bias.shape == weight.shape[1:]
            for weight, bias in zip(self.weights, self.biases, strict=True))
        if not paired or any(first.shape[1] != second.shape[0] for first, second in pairwise(self.weights)):
            raise InvalidValue("The layers of the network do not fit together", "Give (inputs, outputs) and (outputs,)")
        if not all(np.isfinite(array).all() for array in (*self.weights, *self.biases)):
            raise InvalidValue("The network has weights that are not finite", "Train it with smaller steps")

    def hidden(self, inputs: np.ndarray) -> np.ndarray:
        """What the last layer combines, at `inputs` (m, d): shape (m, t)."""
        values = inputs
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            values = silu(matrix_product(values, weight) + bias)
        return values

    def __call__(self, inputs: np.ndarray) -> np.ndarray:
        """The outputs at `inputs` (m, d): shape (m, n). The same bits on any number of threads."""
        outputs: np.ndarray = matrix_product(self.hidden(inputs), self.weights[-1]) + self.biases[-1]
        return outputs

    def take(self, rows: np.ndarray) -> "Network":
        """The network of only these outputs."""
        return Network((*self.weights[:-1], np.ascontiguousarray(self.weights[-1][:, rows])),
                       (*self.biases[:-1], self.biases[-1][rows]))


def sigmoid(values: np.ndarray) -> np.ndarray:
    """1 / (1 + exp(-a)), by tanh, which does not overflow."""
    squashed: np.ndarray = 0.5 * (1 + np.tanh(0.5 * values))
    return squashed


def silu(values: np.ndarray) -> np.ndarray:
    """The activation a / (1 + exp(-a))."""
    activated: np.ndarray = values * sigmoid(values)
    return activated
