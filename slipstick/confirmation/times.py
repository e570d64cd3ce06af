"""How shifting times depend on the conditions beyond what the parameters of the bench explain.

Without signals an engagement is one number, which the scatter of any parameter explains. What is missing shows only
between engagements: as a change of the shifting time over a condition that no mean of the parameters makes good.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from slipstick.confirmation.fit import SimulationFit
from slipstick.confirmation.schema import DOCUMENTED
from slipstick.confirmation.starts import About
from slipstick.engine.linear_model import estimate
from slipstick.naming.bases import between, between_knots
from slipstick.naming.evidence import FOLDS, hold_out
from slipstick.naming.selection import in_errors, is_enough
from slipstick.naming.settings import NamingSettings
from slipstick.numerics.piecewise import hats

_LARGE = 0.1
"""A large change of the shifting time, as a share of the mean: the unit of the coefficients."""
_EXACT = 1e-9
"""Least standard error in ms by which a change is divided."""
_UNITS = {"motor_speed": "rad/s", "load_inertia": "kg m^2", "brake_torque": "N m", "current_profile": "1",
          "run_order": "1"}
"""Conditions over which the shifting time may change -> unit."""


@dataclass(frozen=True)
class TimesOver:
    """The change of the shifting time over a condition that the parameters of the bench do not explain."""

    __pydantic_config__: ClassVar[dict[str, Any]] = DOCUMENTED

    condition: str
    """Name of the condition."""
    unit: str
    """Unit of the condition."""
    levels: list[float]
    """Its levels, or quantiles where it has many values."""
    change: list[float]
    """Measured minus predicted shifting time at the levels in ms, with mean 0 over the engagements."""
    error: list[float]
    """Standard errors of the changes in ms: large where parameters of the bench have a similar effect."""
    nats: float
    """Gain of the natural log-likelihood of engagements that did not determine the change."""
    errors: float
    """Standard errors over engagements in which they gain."""
    shown: bool
    """Whether the gain is more than noise and single engagements give."""

    @property
    def furthest(self) -> int:
        """Place of the level whose change is most standard errors from zero."""
        return int(np.argmax(self._distances))

    @property
    def distance(self) -> float:
        """Standard errors by which that change is from zero."""
        return float(self._distances.max())

    @property
    def _distances(self) -> np.ndarray:
        return np.abs(self.change) / np.maximum(self.error, _EXACT)


def times_over(fit: SimulationFit, settings: NamingSettings, seed: int) -> list[TimesOver]:
    """The changes over all conditions with more than one level, each without the others."""
    about, scene = About(fit.block, fit.fitted), fit.block.scene
    n = len(scene)
    folds = np.random.default_rng(seed).permutation(np.arange(n) % FOLDS)
    bare = estimate(about.beside(np.zeros((n, 0, fit.block.measured.shape[1]))), fit.fitted.variance)
    reference, _ = hold_out(bare, folds)
    unit = 1e3 * _LARGE * float(scene.recordings.measured_time.mean())
    changes = []
    for name, values, count in _conditions(fit, settings):
        knots, basis = between_knots(values, count), between(values, count)
        columns = np.zeros((n, basis.shape[1], fit.block.measured.shape[1]))
        columns[:, :, -1] = 1e-3 * unit / fit.block.traces.time_noise * basis
        fitted = estimate(about.beside(columns), fit.fitted.variance)
        gain = hold_out(fitted, folds)[0] - reference
        onto = unit * (np.eye(len(knots)) - hats(values, knots).mean(axis=0))[:, 1:]
        added = slice(-basis.shape[1], None)
        change, covariance = onto @ fitted.coefficients[added], onto @ fitted.covariance[added, added] @ onto.T
        changes.append(TimesOver(name, _UNITS[name], knots.tolist(), change.tolist(),
                                np.sqrt(np.diag(covariance)).tolist(), float(gain.sum()), in_errors(gain),
                                is_enough(gain, settings)))
    return changes


def _conditions(fit: SimulationFit, settings: NamingSettings) -> Iterator[tuple[str, np.ndarray, int]]:
    """Name, values (n,) and number of knots of each condition that varies."""
    given = fit.block.scene.recordings.conditions
    for name in _UNITS:
        values = fit.block.scene.run if name == "run_order" else np.asarray(getattr(given, name), float)
        levels = len(np.unique(values))
        if levels > 1:
            yield name, values, levels if name == "current_profile" else settings.knots
