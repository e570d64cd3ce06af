"""The filter that turns residuals, and columns of a linear model, into independent values of unit variance.

The residual of an output contains the noise v of its sensor and, through the states x of a system and directly, the
noise u of measured inputs, all first-order autoregressive:

    y_t = C_t x_t + E_t u_t + v_t,   x_{t+1} = A_t x_t + F_t u_t + G_t u_{t+1},   x_0 = 0

The innovations of its Kalman filter, divided by their standard deviations, are independent with unit variance: products
of whitened columns are products under the inverse covariance of y (Durbin and Koopman, Time Series Analysis by State
Space Methods, section 4.3). The outputs of an instant are taken one after the other, as their sensors are independent.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

from slipstick.engine.noise import Noise
from slipstick.numerics.linking import linked

_LANES = 64
"""Columns that are filtered at a time: each step waits for the one before, and those of other columns do not."""


@dataclass(frozen=True, eq=False)
class CarriedNoise:
    """How the noise of r measured inputs reaches the o outputs through d states, at the k samples of n runs.

    `A` (n, k - 1, d, d) and `F` (n, k - 1, d, r) are those of a step from its begin, `G` those from its end, `C` (n, o,
    k, d) and `E` (n, o, k, r) of outputs. The standard deviations of a run are `loudness` (n, r) times those of the
    `inputs`.
    """

    inputs: tuple[Noise, ...]
    loudness: np.ndarray
    A: np.ndarray
    F: np.ndarray
    G: np.ndarray
    C: np.ndarray
    E: np.ndarray

    def __post_init__(self) -> None:
        """Arrange the arrays for the filter."""
        for name in ("A", "F", "G", "C", "E"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name)))

    @property
    def rho(self) -> np.ndarray:
        """Autocorrelation (r,) of the inputs."""
        return np.array([each.correlation for each in self.inputs])


@dataclass(frozen=True, eq=False)
class Whitening:
    """The filter of n runs with o outputs at k samples, of which some are `counted` (n, o, k).

    `std` (n, o) and `rho` (o,) are those of the noise of sensors. With `carried` noise, the r inputs have `input_std`
    (n, r), and what is new at a sample changes the estimates of states and noise by `gains` (n, k, o, d + r + o), and
    has the inverse standard deviation `roots` (n, k, o).
    """

    counted: np.ndarray
    std: np.ndarray
    rho: np.ndarray
    carried: CarriedNoise | None
    gains: np.ndarray
    roots: np.ndarray

    @classmethod
    def of(cls, counted: np.ndarray, sensors: Sequence[Noise], loudness: np.ndarray,
           carried: CarriedNoise | None = None) -> "Whitening":
        """Return the filter for noise of `sensors`, whose standard deviations in a run are multiplied by `loudness` (n,
        o)."""
        counted = np.ascontiguousarray(counted)
        std, rho = (np.array([getattr(each, name) for each in sensors]) for name in ("std", "correlation"))
        if carried is None:
            return cls(counted, std * loudness, rho, None, np.empty(0), np.empty(0))
        (n, o, k), d, r = counted.shape, carried.A.shape[2], len(carried.inputs)
        gains, roots = np.zeros((n, k, o, d + r + o)), np.zeros((n, k, o))
        input_std = np.array([each.std for each in carried.inputs]) * carried.loudness
        _find_gains(counted, std * loudness, rho, input_std, carried.rho, carried.A, carried.F, carried.G, carried.C,
                    carried.E, gains, roots)
        return cls(counted, std * loudness, rho, carried, gains, roots)

    def apply(self, columns: np.ndarray) -> np.ndarray:
        """Return columns (n, c, o, k) after the filter, (n, c, o k), 0 at samples that are not counted.

        These are missing, not zero: the noise goes on over them.
        """
        n, c, o, k = columns.shape
        out, columns = np.zeros((n, c, o, k)), np.ascontiguousarray(columns)
        if self.carried is None:
            _whiten_autoregressive(columns, self.counted, self.std, self.rho, out)
        else:
            noise = self.carried
            _filter(columns, self.counted, self.rho, noise.rho, noise.A, noise.F, noise.G, noise.C, noise.E, self.gains,
                    self.roots, out)
        return out.reshape(n, c, o * k)

    def estimate_inputs(self, left: np.ndarray) -> np.ndarray:
        """Return the mean of the noise of inputs (n, r, k), given all of the residuals (n, o, k), with carried noise.

        By the fast state smoother (Durbin and Koopman, section 4.6.2).
        """
        assert self.carried is not None
        noise, (n, o, k) = self.carried, left.shape
        variance = (np.array([each.std for each in noise.inputs]) * noise.loudness) ** 2
        white, out = self.apply(left[:, None]).reshape(n, o, k), np.zeros((n, len(noise.inputs), k))
        _smooth_inputs(white, self.counted, self.rho, noise.rho, variance, noise.A, noise.F, noise.G, noise.C, noise.E,
                       self.gains, self.roots, out)
        return out

    def log_likelihood(self, left: np.ndarray) -> float:
        """Return the log likelihood of residuals (n, o, k) in nats, up to a constant, with noise that is carried."""
        known = self.roots[self.roots > 0]  # those of samples that are counted
        return float(np.log(known).sum() - 0.5 * (self.apply(left[:, None]) ** 2).sum())


def join_steps(A: np.ndarray, B: np.ndarray, passed: np.ndarray, fine: int) -> tuple[np.ndarray, ...]:
    """Return how the states are carried over a sample of `fine` steps (n, k - 1, d, d), and noise of r sources from the
    begin and from the end of it (n, k - 1, d, r), between which it is linear.

    A (n, K - 1, d, d) and B (r, n, K - 1, 2, d) are the derivatives of the steps with states and with the sources, of
    whose noise (r, n, K) is `passed`.
    """
    n, steps, d, _ = A.shape
    A_joined = np.empty((n, steps // fine, d, d))
    F, G = (np.empty((n, steps // fine, d, len(B))) for _ in range(2))
    _join_steps(A, B, passed, fine, A_joined, F, G)
    return A_joined, F, G


@njit(nogil=True, cache=True, error_model="numpy")
def _join_steps(A, B, passed, fine, A_joined, F, G):  # type: ignore[no-untyped-def]
    n, samples, d, r = F.shape
    x, moved = np.empty((d, d + 2 * r)), np.empty((d, d + 2 * r))  # of states, and of noise at the begin and at the end
    for i in range(n):
        for t in range(samples):
            x[:] = 0.0
            for a in range(d):
                x[a, a] = 1.0
            for sub in range(fine):
                j = t * fine + sub
                for a in range(d):
                    for g in range(d + 2 * r):
                        moved[a, g] = 0.0
                    for b in range(d):
                        for g in range(d + 2 * r):
                            moved[a, g] += A[i, j, a, b] * x[b, g]
                    for source in range(r):
                        before = B[source, i, j, 0, a] * passed[source, i, j]
                        after = B[source, i, j, 1, a] * passed[source, i, j + 1]
                        share, following = sub / fine, (sub + 1) / fine  # of the end of the sample in its noise
                        moved[a, d + source] += (1 - share) * before + (1 - following) * after
                        moved[a, d + r + source] += share * before + following * after
                x, moved = moved, x
            for a in range(d):
                for b in range(d):
                    A_joined[i, t, a, b] = x[a, b]
                for source in range(r):
                    F[i, t, a, source], G[i, t, a, source] = x[a, d + source], x[a, d + r + source]


@njit(nogil=True, cache=True, error_model="numpy")
def _whiten_autoregressive(columns, counted, std, rho, out):  # type: ignore[no-untyped-def]
    """The filter without carried noise: the noise of a sensor is known at every sample that is counted."""
    n, c, outputs, k = columns.shape
    for i in range(n):
        for o in range(outputs):
            following = 1 / (std[i, o] * np.sqrt(1 - rho[o] * rho[o]))
            start, last, known = 0, 0, 0.0  # `known` is the share of the noise at the `last` counted sample
            while start < k:
                if not counted[i, o, start]:
                    known *= rho[o]
                    start += 1
                    continue
                end = start + 1
                while end < k and counted[i, o, end]:
                    end += 1
                weight = 1 / (std[i, o] * np.sqrt(1 - known * known))
                for j in range(c):
                    out[i, j, o, start] = (columns[i, j, o, start] - known * columns[i, j, o, last]) * weight
                    for t in range(start + 1, end):
                        out[i, j, o, t] = (columns[i, j, o, t] - rho[o] * columns[i, j, o, t - 1]) * following
                start, last, known = end, end - 1, rho[o]


@linked
def _find_last(counted):  # type: ignore[no-untyped-def]
    """Return the number of samples (o, k) up to the last one that is counted."""
    last = 0
    for o in range(counted.shape[0]):
        for t in range(counted.shape[1]):
            if counted[o, t] and t + 1 > last:
                last = t + 1
    return last


@njit(nogil=True, cache=True, error_model="numpy")
def _find_gains(counted, std, rho, input_std, input_rho, A, F, G, C, E, gains, roots):  # type: ignore[no-untyped-def]
    n, outputs, _ = counted.shape
    d, r = A.shape[2], len(input_rho)
    size = d + r + outputs  # states, noise of inputs, noise of sensors
    P, moved, T, H = np.empty((size, size)), np.empty((size, size)), np.zeros((size, size)), np.empty(size)
    covariance = np.empty(size)
    for i in range(n):
        last = _find_last(counted[i])
        P[:] = 0.0
        for b in range(r):
            P[d + b, d + b] = input_std[i, b] ** 2
        for o in range(outputs):
            P[d + r + o, d + r + o] = std[i, o] ** 2
        for t in range(last):
            for o in range(outputs):
                if not counted[i, o, t]:
                    continue
                H[:] = 0.0
                for a in range(d):
                    H[a] = C[i, o, t, a]
                for b in range(r):
                    H[d + b] = E[i, o, t, b]
                H[d + r + o] = 1.0
                variance = 0.0
                for a in range(size):
                    total = 0.0
                    for b in range(size):
                        total += P[a, b] * H[b]
                    covariance[a] = total
                for a in range(size):
                    variance += H[a] * covariance[a]
                roots[i, t, o] = 1 / np.sqrt(variance)
                for a in range(size):
                    gains[i, t, o, a] = covariance[a] / variance
                for a in range(size):
                    for b in range(size):
                        P[a, b] -= gains[i, t, o, a] * covariance[b]
            if t + 1 < last:
                T[:] = 0.0
                for a in range(d):
                    for b in range(d):
                        T[a, b] = A[i, t, a, b]
                    for b in range(r):
                        T[a, d + b] = F[i, t, a, b] + input_rho[b] * G[i, t, a, b]
                for b in range(r):
                    T[d + b, d + b] = input_rho[b]
                for o in range(outputs):
                    T[d + r + o, d + r + o] = rho[o]
                for a in range(size):
                    for b in range(size):
                        total = 0.0
                        for e in range(size):
                            total += T[a, e] * P[e, b]
                        moved[a, b] = total
                for a in range(size):
                    for b in range(size):
                        total = 0.0
                        for e in range(size):
                            total += moved[a, e] * T[b, e]
                        P[a, b] = total
                for b in range(r):  # what is new in an input acts at the end of the step already
                    fresh = input_std[i, b] ** 2 * (1 - input_rho[b] ** 2)
                    P[d + b, d + b] += fresh
                    for a in range(d):
                        P[a, d + b] += fresh * G[i, t, a, b]
                        P[d + b, a] += fresh * G[i, t, a, b]
                        for e in range(d):
                            P[a, e] += fresh * G[i, t, a, b] * G[i, t, e, b]
                for o in range(outputs):
                    P[d + r + o, d + r + o] += std[i, o] ** 2 * (1 - rho[o] ** 2)


@njit(nogil=True, cache=True, error_model="numpy")
def _filter(columns, counted, rho, input_rho, A, F, G, C, E, gains, roots, out):  # type: ignore[no-untyped-def]
    n, c, outputs, _ = columns.shape
    d, r = A.shape[2], len(input_rho)
    size = d + r + outputs
    state, following, innovation = np.zeros((size, _LANES)), np.zeros((size, _LANES)), np.zeros(_LANES)
    for i in range(n):
        last = _find_last(counted[i])
        for first in range(0, c, _LANES):
            count = min(_LANES, c - first)
            state[:] = 0.0
            for t in range(last):
                for o in range(outputs):
                    if not counted[i, o, t]:
                        continue
                    for g in range(count):
                        innovation[g] = columns[i, first + g, o, t]
                    for a in range(d):
                        for g in range(count):
                            innovation[g] -= C[i, o, t, a] * state[a, g]
                    for b in range(r):
                        if E[i, o, t, b] != 0.0:
                            for g in range(count):
                                innovation[g] -= E[i, o, t, b] * state[d + b, g]
                    for g in range(count):
                        innovation[g] -= state[d + r + o, g]
                    for g in range(count):
                        out[i, first + g, o, t] = innovation[g] * roots[i, t, o]
                    for a in range(size):
                        gain = gains[i, t, o, a]
                        for g in range(count):
                            state[a, g] += gain * innovation[g]
                if t + 1 < last:
                    for a in range(d):
                        for g in range(count):
                            following[a, g] = 0.0
                        for b in range(d):
                            for g in range(count):
                                following[a, g] += A[i, t, a, b] * state[b, g]
                        for b in range(r):
                            through = F[i, t, a, b] + input_rho[b] * G[i, t, a, b]
                            for g in range(count):
                                following[a, g] += through * state[d + b, g]
                    for a in range(d):
                        for g in range(count):
                            state[a, g] = following[a, g]
                    for b in range(r):
                        for g in range(count):
                            state[d + b, g] *= input_rho[b]
                    for o in range(outputs):
                        for g in range(count):
                            state[d + r + o, g] *= rho[o]


@njit(nogil=True, cache=True, error_model="numpy")
def _smooth_inputs(white, counted, rho, input_rho, variance, A, F, G, C, E, gains, roots, out):  # type: ignore[no-untyped-def]
    n, outputs, k = white.shape
    d, r = A.shape[2], len(input_rho)
    size = d + r + outputs
    pull, before = np.empty(size), np.empty(size)  # what all samples from here on say of states and noise
    for i in range(n):
        last = _find_last(counted[i])
        pull[:] = 0.0
        for t in range(last - 1, -1, -1):
            if t + 1 < last:
                for b in range(r):  # of what is new in an input, which acts at the end of the step already
                    total = pull[d + b]
                    for a in range(d):
                        total += G[i, t, a, b] * pull[a]
                    out[i, b, t + 1] = total
                for b in range(d):
                    before[b] = 0.0
                    for a in range(d):
                        before[b] += A[i, t, a, b] * pull[a]
                for b in range(r):
                    before[d + b] = input_rho[b] * pull[d + b]
                    for a in range(d):
                        before[d + b] += (F[i, t, a, b] + input_rho[b] * G[i, t, a, b]) * pull[a]
                for o in range(outputs):
                    before[d + r + o] = rho[o] * pull[d + r + o]
                pull[:] = before
            for o in range(outputs - 1, -1, -1):
                if not counted[i, o, t]:
                    continue
                told = white[i, o, t] * roots[i, t, o]
                for a in range(size):
                    told -= gains[i, t, o, a] * pull[a]
                for a in range(d):
                    pull[a] += C[i, o, t, a] * told
                for b in range(r):
                    pull[d + b] += E[i, o, t, b] * told
                pull[d + r + o] += told
        for b in range(r):
            out[i, b, 0] = variance[i, b] * pull[d + b]
            for t in range(1, k):
                out[i, b, t] = input_rho[b] * out[i, b, t - 1] + variance[i, b] * (1 - input_rho[b] ** 2) * out[i, b, t]
