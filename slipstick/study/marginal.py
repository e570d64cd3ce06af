"""The scatter integrated out of linearised experiments: what it leaves to say of what all of them have in common.

Of experiment i the model is f(theta + b_i, c), b_i ~ N(0, covariance) on the scattering parameters. The marginal
likelihood is taken with f linearised about the conditional mode of b_i (first-order conditional estimation: Lindstrom
and Bates, Biometrics 46, 673, 1990).
"""

from dataclasses import dataclass

import numpy as np

from slipstick.study.comparison import Comparison
from slipstick.study.linearised import Linearised


@dataclass(frozen=True, eq=False)
class State:
    """`theta` (p,) common, `modes` (n, q) of the scattering entries of it, their `covariance` (q, q), and `noise`.

    `noise` (channels,) is the variance of each channel's residuals over that of its sensor.
    """

    theta: np.ndarray
    modes: np.ndarray
    covariance: np.ndarray
    noise: np.ndarray


@dataclass(frozen=True, eq=False)
class Marginal:
    """Products under the covariance V_i of an experiment: `products` (n, p + 1, p + 1) of J_i and r_i + G_i b_i.

    `logdet` (n,) is that of V_i over the noise's; `gain` (n, q, q) the posterior covariance of the modes.
    """

    products: np.ndarray
    logdet: np.ndarray
    gain: np.ndarray

    @property
    def information(self) -> np.ndarray:
        """J_i' V_i^-1 J_i, (n, p, p)."""
        return self.products[:, :-1, :-1]

    @property
    def score(self) -> np.ndarray:
        """J_i' V_i^-1 (r_i + G_i b_i), (n, p)."""
        return self.products[:, :-1, -1]


def spread(state: State, scattering: tuple[int, ...]) -> np.ndarray:
    """The point of each experiment, (n, p)."""
    points = np.tile(state.theta, (len(state.modes), 1))
    points[:, list(scattering)] += state.modes
    return points


def shifted(gram: np.ndarray, modes: np.ndarray, scattering: tuple[int, ...]) -> np.ndarray:
    """The products with the residual r_i replaced by r_i + G_i b_i: what theta and new modes together explain."""
    moved, places = gram.copy(), list(scattering)
    onto = (gram[..., places] @ modes[..., None])[..., 0]
    moved[..., :, -1] += onto
    moved[..., -1, :-1] += onto[..., :-1]
    moved[..., -1, -1] += onto[..., -1] + (onto[..., places] * modes).sum(axis=-1)
    return moved


def marginal(about: Linearised, state: State, scattering: tuple[int, ...]) -> Marginal:
    """Integrate the scatter out of products whose residual was taken at the modes of `state`."""
    places, q = list(scattering), len(scattering)
    gram = about.weighted(state.noise)
    moved = shifted(gram, state.modes, scattering)
    root = np.linalg.cholesky(state.covariance)
    inner = np.eye(q) + root.T @ gram[:, places][:, :, places] @ root
    gain = root @ np.linalg.inv(inner) @ root.T
    onto = moved[:, places, :]
    products = moved - onto.transpose(0, 2, 1) @ gain @ onto
    return Marginal(products, determinant(gram[:, places][:, :, places], state.covariance), gain)


def determinant(inner: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Logarithm of that of V_i over the noise's, (n,), from G_i' G_i (n, q, q)."""
    root = np.linalg.cholesky(covariance)
    return np.asarray(np.linalg.slogdet(np.eye(len(root)) + root.T @ inner @ root)[1])


def rarity(modes: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """b_i' covariance^-1 b_i of modes (n, q): (n,)."""
    return np.asarray((modes @ np.linalg.inv(covariance) * modes).sum(axis=1))


def log_likelihood(comparison: Comparison, integrated: Marginal, noise: np.ndarray) -> np.ndarray:
    """Natural log-likelihood of each experiment, (n,), marginal over the scatter."""
    scale = comparison.scale
    for factor, columns in zip(noise, comparison.channels.values(), strict=True):
        scale[columns] *= np.sqrt(factor)
    constant = ((comparison.weights > 0) * np.log(2 * np.pi * scale**2)).sum(axis=1)
    return np.asarray(-0.5 * (integrated.products[:, -1, -1] + integrated.logdet + constant))
