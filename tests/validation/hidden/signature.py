"""What an effect leaves in noiseless recordings after the best refit of a model that lacks it, in units of noise."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from . import nominal
from .case import SCATTER, TIME_NOISE, Case, simulate
from .run import SIGNALS, Run, observe

STEP = 0.03  # of a derivative, relative to the nominal value: long enough that lock-up moves by several samples
RELATIVE = 1e-6
SCATTERED = [nominal.UNCERTAIN.index(name) for name in ("aa", "x30")]  # free from run to run, within their scatter
STD = np.array([SCATTER[nominal.UNCERTAIN[column]] for column in SCATTERED])


def remaining(effects: Mapping[str, float], noise: float = 0.01, count: int = 54, rounds: int = 6) -> dict[str, float]:
    """Return the RMS residual over its noise of each signal and of the `shifting_time`, and `all` of the samples.

    Least squares on the seven uncertain parameters and on the two scattered ones of each run, from their true
    values: Levenberg-Marquardt, at most `rounds` steps. `scatter` is the RMS of the latter over their std.
    """
    target = simulate(Case(effects, count=count, shift="none", scatter=0), RELATIVE)
    plain = simulate(Case(count=count, shift="none", scatter=0), RELATIVE)
    stds = {name: noise * np.ptp(target.readings[name]) for name in SIGNALS}
    bench = plain.bench.take(np.flatnonzero(np.isin(plain.conditions, target.conditions)))

    def simulated(common: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Return the whitened recordings (p, n, k) at the common parameters (p, 7)."""
        factor = np.repeat(1 + common[:, None], len(own), axis=1)
        factor[..., SCATTERED] += STD * own
        lanes = np.tile(np.arange(len(own)), len(common))
        columns = zip(nominal.UNCERTAIN, factor.reshape(-1, len(nominal.UNCERTAIN)).T, strict=True)
        values = {name: nominal.PARAMETERS[name] * column for name, column in columns}
        moved = bench.take(lanes)
        moved = replace(moved, values={**moved.values, **values})
        run = observe(moved, target.conditions[lanes], target.order[lanes], RELATIVE)
        return _whitened(run, stds, noise).reshape(len(common), len(own), -1)

    measured = _whitened(target, stds, noise)
    common, own, damping = np.zeros((1, len(nominal.UNCERTAIN))), np.zeros((len(measured), 2)), 1e-4
    base = simulated(common, own)[0]
    for _ in range(rounds):
        cost = np.sum((measured - base) ** 2) + np.sum(own**2)
        slopes = (simulated(common + STEP * np.eye(common.size), own) - base).transpose(1, 2, 0) / STEP
        new_cost = np.inf
        while new_cost > cost and damping < 1e3:
            step, own_step = _solved(measured - base, slopes, own, damping)
            new = simulated(common + step, own + own_step)[0]
            new_cost = np.sum((measured - new) ** 2) + np.sum((own + own_step) ** 2)
            damping *= 0.03 if new_cost <= cost else 10
        if new_cost <= cost:
            common, own, base = common + step, own + own_step, new
        if new_cost > 0.999 * cost:
            break
    parts = dict(zip(SIGNALS, np.split((measured - base)[:, :-1], len(SIGNALS), axis=1), strict=True))
    parts |= {"shifting_time": (measured - base)[:, -1:], "all": measured - base, "scatter": own}
    return {name: float(np.sqrt(np.mean(part**2))) for name, part in parts.items()}


def _solved(residual: np.ndarray, slopes: np.ndarray, own: np.ndarray, damping: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the steps of the common parameters (7,) and of those of each run (n, 2), in stds, now at `own`."""
    local = slopes[..., SCATTERED] * STD
    shared = local.swapaxes(1, 2) @ slopes
    inner = local.swapaxes(1, 2) @ local * (1 + damping * np.eye(2)) + (1 + damping) * np.eye(2)
    pull = np.einsum("nkj,nk->nj", local, residual) - own
    alone = np.linalg.solve(inner, np.concatenate([shared, pull[..., None]], axis=2))
    normal = np.einsum("nki,nkj->ij", slopes, slopes, optimize=True)
    normal += damping * np.diag(np.diag(normal))
    seen = np.einsum("nji,njk->ik", shared, alone)
    common = np.linalg.solve(normal - seen[:, :-1], np.einsum("nki,nk->i", slopes, residual) - seen[:, -1])
    return common, alone[..., -1] - alone[..., :-1] @ common


def _whitened(run: Run, stds: Mapping[str, float], noise: float) -> np.ndarray:
    signals = [run.readings[name] / stds[name] for name in SIGNALS]
    return np.concatenate([*signals, run.lock_time[:, None] / (TIME_NOISE * noise)], axis=1)
