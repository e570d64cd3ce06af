"""The result of a calibration."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from slipstick.bench import parameters
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.time_budget import Partial


@dataclass(frozen=True, eq=False)
class Calibration:
    """The fitted `model`, with standard errors and correlation of its d `free` parameters.

    `standard_error` (d,) and `interval` (d, 2), of probability `level`, are in the units of the parameters, as is
    `scatter` (d,), the standard deviation of each parameter from run to run, with `scatter_error` (d,). A scatter of 0
    means that the recordings do not ask for one; its error is then the scatter that they do not exclude. All of them,
    and `correlation` (d, d), assume that the model is right: they do not describe a bias due to missing physics.

    `noise` and `noise_correlation` are the standard deviation of the sensor noise of each channel and its correlation
    from sample to sample. `chi_square` is the reduced chi-square of each channel, 1 if only sensor noise remains, with
    the parameters of each engagement at their own values: scatter from run to run does not raise it. `rms_before` and
    `rms_after` are RMS residuals of the shifting time in s, at the start and at the fitted common values. `at_bound`
    names the parameters at a bound: their values are those of the bound, not estimates. `signals` names the signals
    that were compared. `undetermined` names the parameters of which more than half of the variance stems from the
    bounds of the bench file, `bounds` (d, 2): the recordings determine some of their combinations at most, and their
    values are those near the start that fit. `bench` is the name of the bench, `bench_digest` and `sensing_digest` are
    its digests. `evaluations` counts the iterations of the mixed-effects fit; it is `partial` if the time budget ended
    before they converged.
    """

    model: Model
    free: tuple[str, ...]
    standard_error: np.ndarray
    interval: np.ndarray
    level: float
    correlation: np.ndarray
    scatter: np.ndarray
    scatter_error: np.ndarray
    chi_square: dict[str, float]
    noise: dict[str, float]
    noise_correlation: dict[str, float]
    rms_before: float
    rms_after: float
    at_bound: tuple[str, ...]
    signals: tuple[str, ...]
    undetermined: tuple[str, ...]
    evaluations: int
    converged: bool
    bench: str
    bench_digest: str
    sensing_digest: str
    bounds: np.ndarray
    partial: Partial | None = None

    def spec(self) -> dict[str, Any]:
        """Return the calibration as JSON; `Model.from_spec` reads the entry "model"."""
        values = dict(zip(parameters.NAMES, self.model.parameters, strict=True))
        units = {parameter.name: parameter.unit for parameter in parameters.PARAMETERS}
        fitted = {
            name: {"value": values[name], "unit": units[name], "standard_error": float(self.standard_error[place]),
                   "interval": self.interval[place].tolist(), "scatter": float(self.scatter[place]),
                   "scatter_error": float(self.scatter_error[place]),
                   "bounds": self.bounds[place].tolist()}
            for place, name in enumerate(self.free)
        }
        return {"model": self.model.spec(), "bench": self.bench, "bench_digest": self.bench_digest,
                "sensing_digest": self.sensing_digest, "parameters": fitted, "level": self.level,
                "correlation": self.correlation.tolist(), "reduced_chi_square": self.chi_square, "noise": self.noise,
                "noise_correlation": self.noise_correlation, "at_bound": list(self.at_bound),
                "signals": list(self.signals), "undetermined": list(self.undetermined),
                "converged": self.converged, "rms_before_s": self.rms_before, "rms_after_s": self.rms_after,
                "evaluations": self.evaluations, "partial": None if self.partial is None else asdict(self.partial)}

    def require_inside(self) -> None:
        """Raise `InvalidValue` if parameters are at a bound: a model with them is no estimate of the bench."""
        if self.at_bound:
            raise InvalidValue(f"The calibrated model cannot be used, because parameters are at a bound of the bench "
                               f"file: {', '.join(self.at_bound)}",
                               "Look for an effect that the model lacks (`study`), or start from another model")

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> "Calibration":
        """The calibration of a `spec()`; raises `InvalidValue`."""
        try:
            fitted = spec["parameters"].values()
            columns = {name: np.array([entry[name] for entry in fitted])
                       for name in ("standard_error", "interval", "scatter", "scatter_error", "bounds")}
            partial = spec["partial"]
            return cls(
                model=Model.from_spec(spec["model"]), free=tuple(spec["parameters"]), **columns, level=spec["level"],
                correlation=np.array(spec["correlation"]), chi_square=dict(spec["reduced_chi_square"]),
                noise=dict(spec["noise"]), noise_correlation=dict(spec["noise_correlation"]),
                rms_before=spec["rms_before_s"], rms_after=spec["rms_after_s"], at_bound=tuple(spec["at_bound"]),
                signals=tuple(spec["signals"]), undetermined=tuple(spec["undetermined"]),
                evaluations=spec["evaluations"], converged=spec["converged"], bench=spec["bench"],
                bench_digest=spec["bench_digest"], sensing_digest=spec["sensing_digest"],
                partial=None if partial is None else Partial(**partial))
        except (KeyError, TypeError, AttributeError) as error:
            raise InvalidValue(f"The calibration is incomplete ({type(error).__name__}: {error})",
                               "Repeat the calibration: it is that of another version") from error
