"""The residual of an effect in noiseless recordings after the best refit of a model without it, in units of noise."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .case import SCATTER, TIME_NOISE, Case, simulate
from .nominal import HEAVY, SETUPS
from .run import SIGNALS, Run, observe

STEP = 0.03  # of the differences, relative to nominal values: large enough to move lock-up by several samples
RELATIVE = 1e-6
SCATTERED = [HEAVY.uncertain.index(name) for name in ("aa", "x30")]  # fitted for each run, with a normal prior
STD = np.array([SCATTER[HEAVY.uncertain[column]] for column in SCATTERED])


def remaining(effects: Mapping[str, float], noise: float = 0.01, count: int = 54, rounds: int = 6,
              bench: str = "heavy") -> dict[str, float]:
    """Return the RMS residual of each signal, of the `shifting_time`, and of `all` samples, in units of the noise std.

    The refit is a least-squares fit of the seven uncertain parameters and of the two scattered parameters of each run,
    starting at their true values: Levenberg-Marquardt, at most `rounds` steps. `scatter` is the RMS deviation of the
    scattered parameters in units of their std.
    """
    target = simulate(Case(effects, count=count, shift="none", scatter=0, bench=bench), RELATIVE)
    nominal_run = simulate(Case(count=count, shift="none", scatter=0, bench=bench), RELATIVE)
    parameters = SETUPS[bench].parameters
    stds = {name: noise * np.ptp(target.readings[name]) for name in SIGNALS}
    nominal_bench = nominal_run.bench.take(np.flatnonzero(np.isin(nominal_run.conditions, target.conditions)))

    def simulated(common: np.ndarray, per_run: np.ndarray) -> np.ndarray:
        """Return the whitened recordings (p, n, k) at the common parameters (p, 7)."""
        factor = np.repeat(1 + common[:, None], len(per_run), axis=1)
        factor[..., SCATTERED] += STD * per_run
        lanes = np.tile(np.arange(len(per_run)), len(common))
        columns = zip(HEAVY.uncertain, factor.reshape(-1, len(HEAVY.uncertain)).T, strict=True)
        values = {name: parameters[name] * column for name, column in columns}
        perturbed = nominal_bench.take(lanes)
        perturbed = replace(perturbed, values={**perturbed.values, **values})
        run = observe(perturbed, target.conditions[lanes], target.order[lanes], RELATIVE)
        return _whitened(run, stds, noise).reshape(len(common), len(per_run), -1)

    measured = _whitened(target, stds, noise)
    common, per_run, damping = np.zeros((1, len(HEAVY.uncertain))), np.zeros((len(measured), 2)), 1e-4
    base = simulated(common, per_run)[0]
    for _ in range(rounds):
        cost = np.sum((measured - base) ** 2) + np.sum(per_run**2)
        jacobian = (simulated(common + STEP * np.eye(common.size), per_run) - base).transpose(1, 2, 0) / STEP
        new_cost = np.inf
        while new_cost > cost and damping < 1e3:
            common_step, run_step = _steps(measured - base, jacobian, per_run, damping)
            new = simulated(common + common_step, per_run + run_step)[0]
            new_cost = np.sum((measured - new) ** 2) + np.sum((per_run + run_step) ** 2)
            damping *= 0.03 if new_cost <= cost else 10
        if new_cost <= cost:
            common, per_run, base = common + common_step, per_run + run_step, new
        if new_cost > 0.999 * cost:
            break
    parts = dict(zip(SIGNALS, np.split((measured - base)[:, :-1], len(SIGNALS), axis=1), strict=True))
    parts |= {"shifting_time": (measured - base)[:, -1:], "all": measured - base, "scatter": per_run}
    return {name: float(np.sqrt(np.mean(part**2))) for name, part in parts.items()}


def _steps(residual: np.ndarray, jacobian: np.ndarray, per_run: np.ndarray,
           damping: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the damped Gauss-Newton steps of the common parameters (7,) and of those of each run (n, 2), in stds.

    The parameters of the runs, now `per_run` (n, 2), are eliminated from the normal equations (Schur complement).
    """
    run_jacobian = jacobian[..., SCATTERED] * STD
    coupling = run_jacobian.swapaxes(1, 2) @ jacobian
    run_matrix = run_jacobian.swapaxes(1, 2) @ run_jacobian * (1 + damping * np.eye(2)) + (1 + damping) * np.eye(2)
    run_gradient = np.einsum("nkj,nk->nj", run_jacobian, residual) - per_run
    solved = np.linalg.solve(run_matrix, np.concatenate([coupling, run_gradient[..., None]], axis=2))
    matrix = np.einsum("nki,nkj->ij", jacobian, jacobian, optimize=True)
    matrix += damping * np.diag(np.diag(matrix))
    eliminated = np.einsum("nji,njk->ik", coupling, solved)
    gradient = np.einsum("nki,nk->i", jacobian, residual)
    common = np.linalg.solve(matrix - eliminated[:, :-1], gradient - eliminated[:, -1])
    return common, solved[..., -1] - solved[..., :-1] @ common


def _whitened(run: Run, stds: Mapping[str, float], noise: float) -> np.ndarray:
    signals = [run.readings[name] / stds[name] for name in SIGNALS]
    return np.concatenate([*signals, run.lock_time[:, None] / (TIME_NOISE * noise)], axis=1)
