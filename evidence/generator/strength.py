"""The strength of an effect: the residual that the best fit of the model without it leaves, over the noise."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .bench import SENSORS
from .case import with_plays
from .effect import Acting, Effect
from .engagements import Engagements
from .run import Run, observe
from .temptations import oil_temperature

LANES = 18  # most runs that are simulated
STEP = 0.03  # of differences, relative to nominal values: large enough to move lock-up by several samples
SCATTER = {"aa": 0.05, "x30": 0.08}  # relative std of the parameters that are fitted for each run
RELATIVE = 1e-5  # tolerance of the integrator
ROUNDS = 3  # of the fit


@dataclass(frozen=True, eq=False)
class Scale:
    """Measures effects on a bench with the noise std of each sensor, by some of its `nominal` runs.

    The fit without the effect has the calibrated parameters of the bench in common and two of them in each run as well,
    with a normal prior, as a calibration does. Its residual is the RMS over runs and samples, in units of the noise, of
    the signal that shows it most.
    """

    nominal: Run
    noise: Mapping[str, float]

    @cached_property
    def _lanes(self) -> np.ndarray:
        n = len(self.nominal.conditions)
        return np.unique(np.linspace(0, n - 1, min(n, LANES)).astype(int))

    @cached_property
    def _base(self) -> Engagements:
        """The engagements, in a random order."""
        n = len(self._lanes)
        order = np.random.default_rng(0).permutation(n)
        return replace(self.nominal.engagements.take(self._lanes), sequence=order / max(n - 1, 1), channels={
            "oil_temperature": oil_temperature(order, np.random.default_rng(1))})

    def _whiten(self, run: Run) -> np.ndarray:
        """Return the signals (n, s, k) in units of the noise."""
        return np.stack([run.readings[name] / self.noise[name] for name in SENSORS], axis=1)

    def _simulate(self, engagements: Engagements) -> np.ndarray:
        n = np.arange(len(engagements.motor_speed))
        return self._whiten(observe(engagements, n, n, RELATIVE, locked_only=False))

    @cached_property
    def _start(self) -> np.ndarray:
        return self._simulate(self._base)

    @cached_property
    def _jacobian(self) -> np.ndarray:
        """Derivatives (n, s, k, p) with respect to relative changes of the calibrated parameters."""
        names, n = self.nominal.engagements.bench.uncertain, len(self._lanes)
        moved = self._simulate(self._with_factors(1 + STEP * np.repeat(np.eye(len(names)), n, axis=0)))
        return np.moveaxis(moved.reshape(len(names), n, *moved.shape[1:]) - self._start, 0, -1) / STEP

    def _with_factors(self, factors: np.ndarray) -> Engagements:
        """Return the engagements, as often as needed, with factors (m, p) of the calibrated parameters."""
        names, n = self.nominal.engagements.bench.uncertain, len(self._lanes)
        lanes = self._base.take(np.tile(np.arange(n), len(factors) // n))
        columns = zip(names, factors.T, strict=True)
        values = {name: lanes.values[name] * column for name, column in columns}
        return replace(lanes, values={**lanes.values, **values})

    def _target(self, effect: Effect, amplitude: float) -> np.ndarray:
        acting = (Acting(effect, amplitude, np.ones(len(self._lanes), bool)),)
        knots = with_plays(acting, self._base.knot_time, self._base.knot_current)
        return self._simulate(replace(self._base, effects=acting, knot_time=knots[0], knot_current=knots[1]))

    def measure(self, effect: Effect, amplitude: float) -> float:
        """Return the strength after a nonlinear fit; raises `RuntimeError` where the integrator does not get through.

        Derivatives are those at the nominal parameters; after a step that does not improve the fit, steps are shorter.
        """
        target = self._target(effect, amplitude)
        names = self.nominal.engagements.bench.uncertain
        common, per_run = np.zeros(len(names)), np.zeros((len(self._lanes), len(SCATTER)))
        residual, share = target - self._start, 1.0
        cost = np.sum(residual**2)
        for _ in range(ROUNDS):
            steps = [share * step for step in self._step(residual, per_run)]
            tried = common + steps[0], per_run + steps[1]
            factors = 1 + np.tile(tried[0], (len(self._lanes), 1))
            factors[:, [names.index(name) for name in SCATTER]] += tried[1] * list(SCATTER.values())
            left = target - self._simulate(self._with_factors(np.clip(factors, 0.2, 3)))
            if np.sum(left**2) + np.sum(tried[1] ** 2) < cost:
                (common, per_run), residual = tried, left
                cost = np.sum(left**2) + np.sum(per_run**2)
            else:
                share *= 0.3
        return _size(residual)

    @cached_property
    def _per_run(self) -> np.ndarray:
        names = self.nominal.engagements.bench.uncertain
        return self._jacobian[..., [names.index(name) for name in SCATTER]] * list(SCATTER.values())

    def _step(self, residual: np.ndarray, per_run: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the Gauss-Newton steps of the common parameters (p,) and of those of each run (n, 2), in their std.

        The parameters of the runs, now `per_run`, are eliminated from the normal equations (Schur complement).
        """
        n, left = len(residual), residual.reshape(len(residual), -1)
        jacobian, run_jacobian = (columns.reshape(n, -1, columns.shape[-1]) for columns in (
            self._jacobian, self._per_run))
        coupling = run_jacobian.swapaxes(1, 2) @ jacobian
        run_matrix = run_jacobian.swapaxes(1, 2) @ run_jacobian + np.eye(len(SCATTER))
        run_gradient = np.einsum("nkj,nk->nj", run_jacobian, left) - per_run
        solved = np.linalg.solve(run_matrix, np.concatenate([coupling, run_gradient[..., None]], axis=2))
        matrix = np.einsum("nki,nkj->ij", jacobian, jacobian, optimize=True)
        matrix += 1e-6 * np.diag(np.diag(matrix))
        eliminated = np.einsum("nji,njk->ik", coupling, solved)
        gradient = np.einsum("nki,nk->i", jacobian, left)
        common = np.linalg.lstsq(matrix - eliminated[:, :-1], gradient - eliminated[:, -1], rcond=None)[0]
        return common, solved[..., -1] - solved[..., :-1] @ common


def _size(residual: np.ndarray) -> float:
    """Return the RMS of the signal of residuals (n, s, k) whose RMS is largest."""
    return float(np.sqrt(np.mean(residual**2, axis=(0, 2)).max()))
