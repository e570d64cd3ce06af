"""The strength of an effect: the residual that the best fit of the parameters of each run leaves, over the noise."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import takewhile

import numpy as np
from scipy.optimize import lsq_linear

from .effects import CONSTANT_IN_A_RUN, largest_amplitude
from .recordings import MACHINES, Reading, simulate
from .runs import Change, Runs
from .world import World

LANES = 6  # most runs that are simulated
STEP = 0.01  # of differences, relative to nominal values
ROUNDS = 2  # of the fit, before a last linear step
MOST = 1e6  # signal over noise, of runs that are not sound
FITTED = (-0.5, 1.0)  # relative changes of parameters within which they are fitted, and the coarse steps are stable
LOOSE = 0.2  # relative std of the prior of the parameters of each run
LEAST_LEVEL, MOST_LEVEL = 0.02, 3.0  # m, of the tanks
_GRID = np.geomspace(1e-3, 1.0, 9)  # amplitudes that are tried at once, over the largest plausible one


@dataclass(frozen=True, eq=False)
class Measured:
    """The `strength` of an amplitude, and the `signal` that shows it most."""

    strength: float
    signal: str


@dataclass(frozen=True, eq=False)
class Scale:
    """Measures effects on some of the `nominal` runs, with the noise and the scatter of a world.

    The fit has all parameters in each run and a delay of up to a sample of each sensor. The strength is the RMS over
    runs and samples of the residual, in units of the noise, in the signal that shows it most. An effect that is
    constant in a run, and that parameters make up for, changes these from run to run: its strength is the RMS over runs
    of that change of the parameter that shows it most, less the mean, in units of the scatter, if that is more.
    """

    nominal: Runs
    world: World

    @cached_property
    def _base(self) -> Runs:
        """Some runs, evenly through the test sequence."""
        n = len(self.nominal.order)
        places = np.unique(np.linspace(0, n - 1, min(n, LANES)).astype(int))
        return self.nominal.take(np.argsort(self.nominal.order)[places])

    @property
    def _names(self) -> list[str]:
        return list(self.nominal.values)

    def _whiten(self, reading: Reading) -> np.ndarray:
        """Return the signals (n, s, k) in units of the noise."""
        return np.stack([rows / self.world.noise[name] for name, rows in reading.signals.items()], axis=1)

    def _simulate(self, runs: Runs) -> np.ndarray:
        return self._whiten(simulate(runs, MACHINES[runs.machine].COARSE))

    def _repeat(self, times: int) -> Runs:
        return self._base.take(np.tile(np.arange(len(self._base.order)), times))

    @cached_property
    def _moved(self) -> np.ndarray:
        """Signals (p + 1, n, s, k) of the nominal parameters, and where one of them is moved by a step."""
        n, names = len(self._base.order), self._names
        factors = {name: 1.0 + STEP * np.repeat(np.arange(len(names) + 1) == index, n)
                   for index, name in enumerate(names, start=1)}
        signals = self._simulate(self._repeat(len(names) + 1).times_factors(factors))
        return signals.reshape(len(names) + 1, n, *signals.shape[1:])

    @property
    def _start(self) -> np.ndarray:
        return self._moved[0]

    @cached_property
    def _jacobian(self) -> np.ndarray:
        """Derivatives (n, s k, p) with respect to relative changes of the parameters."""
        changed = (self._moved[1:] - self._start) / STEP
        return np.moveaxis(changed.reshape(*changed.shape[:2], -1), 0, -1)

    @cached_property
    def _inverse(self) -> np.ndarray:
        """Fits (n, p, s k) of the parameters to residuals, with their prior."""
        turned = self._jacobian.swapaxes(1, 2)
        return np.linalg.solve(turned @ self._jacobian + np.eye(len(self._names)) / LOOSE**2, turned)

    @cached_property
    def _delays(self) -> np.ndarray:
        """Changes (n, s k, s) by a delay of each sensor of one sample, less what parameters make up for."""
        late = np.concatenate([self._start[..., :1], self._start[..., :-1]], axis=2) - self._start
        n, s, k = late.shape
        columns = np.einsum("nsk,sj->nskj", late, np.eye(s)).reshape(n, s * k, s)
        return columns - self._jacobian @ (self._inverse @ columns)

    @cached_property
    def _triangle(self) -> tuple[np.ndarray, np.ndarray]:
        """The delays of all runs as an orthogonal matrix (n s k, s) times a triangular one (s, s)."""
        return np.linalg.qr(self._delays.reshape(-1, self._delays.shape[-1]))

    def _fit(self, index: np.ndarray, left: np.ndarray) -> np.ndarray:
        """Return the relative changes (a, p) of parameters that fit residuals (a, s, k) of the runs `index` (a,)."""
        return np.einsum("apk,ak->ap", self._inverse[index], left.reshape(len(index), -1))

    def measure(self, change: Change, amplitudes: np.ndarray) -> list[Measured | None]:
        """Return what each of some amplitudes (a,) leaves after Gauss-Newton steps; None where a run is not sound."""
        with np.errstate(over="ignore", invalid="ignore"):  # of runs that are not sound
            return self._measure(change, amplitudes)

    def _measure(self, change: Change, amplitudes: np.ndarray) -> list[Measured | None]:
        n, tried = len(self._base.order), len(amplitudes)
        repeated = self._repeat(tried)
        amplitude = np.repeat(amplitudes, n)
        reading = simulate(repeated.with_change(change, amplitude), MACHINES[repeated.machine].COARSE)
        target, index = np.clip(np.nan_to_num(self._whiten(reading)), -MOST, MOST), np.tile(np.arange(n), tried)
        values, left = np.zeros((len(index), len(self._names))), target - self._start[index]
        for _ in range(ROUNDS):
            ahead = np.clip(values + self._fit(index, left), *FITTED)
            factors = {name: 1.0 + ahead[:, column] for column, name in enumerate(self._names)}
            rest = target - self._simulate(repeated.times_factors(factors))
            better = np.sum(rest**2, axis=(1, 2)) < np.sum(left**2, axis=(1, 2))
            values, left = np.where(better[:, None], ahead, values), np.where(better[:, None, None], rest, left)
        last = self._fit(index, left)
        left = left - np.einsum("akp,ap->ak", self._jacobian[index], last).reshape(left.shape)
        measured: list[Measured | None] = []
        for lanes in np.arange(tried * n).reshape(tried, n):
            sound = self._is_sound({name: rows[lanes] for name, rows in reading.abscissas.items()})
            measured.append(self._summarize(change, left[lanes], (values + last)[lanes]) if sound else None)
        return measured

    def _summarize(self, change: Change, left: np.ndarray, step: np.ndarray) -> Measured:
        """Return the strength of residuals (n, s, k) that remain after a step (n, p) of the parameters."""
        turn, triangle = self._triangle
        delays = lsq_linear(triangle, turn.T @ left.ravel(), (0.0, 1.0)).x
        rms = np.sqrt(np.mean((left - (self._delays @ delays).reshape(left.shape)) ** 2, axis=(0, 2)))
        strength, signal = float(rms.max()), list(self.world.noise)[int(rms.argmax())]
        if change.abscissa in CONSTANT_IN_A_RUN:
            scatter = np.array([self.world.scatter.get(name, np.inf) for name in self._names])
            strength = max(strength, float(np.max(np.std(step, axis=0) / scatter)))
        return Measured(strength, signal)

    def _is_sound(self, abscissas: Mapping[str, np.ndarray]) -> bool:
        """Return whether all is finite, and the tanks neither run empty nor over."""
        levels = [abscissas[name] for name in ("level 1", "level 2") if name in abscissas]
        return all(np.isfinite(rows).all() for rows in abscissas.values()) and all(
            rows.min() > LEAST_LEVEL and rows.max() < MOST_LEVEL for rows in levels)

    def find_amplitude(self, change: Change, wanted: float, reading: Reading) -> tuple[float, Measured] | None:
        """Return the amplitude of a `wanted` strength, or the largest plausible one, and its strength.

        Strengths are interpolated between those of some amplitudes; None where none of these is plausible.
        """
        amplitudes = _GRID * largest_amplitude(change, self.nominal, reading)
        sound = list(takewhile(lambda each: each is not None, self.measure(change, amplitudes)))
        measured = [each for each in sound if each is not None]
        if not measured:
            return None
        most = max(range(len(measured)), key=lambda index: measured[index].strength)
        if measured[most].strength <= wanted:
            return float(amplitudes[most]), measured[most]
        strengths = np.array([each.strength for each in measured])
        beyond = int(np.argmax(strengths >= wanted))
        signal = measured[beyond].signal
        if beyond == 0:
            return float(amplitudes[0] * wanted / strengths[0]), Measured(wanted, signal)
        pair = slice(beyond - 1, beyond + 1)
        amplitude = np.exp(np.interp(np.log(wanted), np.log(strengths[pair]), np.log(amplitudes[pair])))
        return float(amplitude), Measured(wanted, signal)
