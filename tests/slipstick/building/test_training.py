"""The training of surrogates: gradients, and what a network can follow."""

import numpy as np
import pytest

from slipstick.building.training import WIDTHS, _gradient, _initial_layers, train


def test_gradients_agree_with_finite_differences() -> None:
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


def test_a_network_follows_a_kink_better_than_polynomials() -> None:
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
