"""`slipstick.open_result`: a result that was saved, or fetched from the service."""

import json
from pathlib import Path
from typing import Any

from slipstick.errors import InvalidValue, UnknownName
from slipstick.interface.calibrate import CalibrationResult
from slipstick.interface.fit import Fit
from slipstick.interface.likelihood import Likelihood
from slipstick.interface.machine_study import MachineCalibration, MachineStudy
from slipstick.interface.propagate import Propagation
from slipstick.interface.result import Result
from slipstick.interface.study import Study

KINDS: dict[str, type[Result]] = {kind.kind: kind for kind in (
    CalibrationResult, Fit, Likelihood, MachineCalibration, MachineStudy, Propagation, Study)}
"""What a result is of -> its type."""
_MARKS = {"machine": MachineStudy.kind, "findings": Study.kind, "log10_likelihood": Fit.kind}
"""Field of the result of a job -> what it is of, in files that do not say so themselves."""


def open_result(path: Path | str) -> Result:
    """Open the JSON file of a study, fit, calibration, propagation or likelihood.

    It is one that `save` wrote, the command with `--out`, or the REST service as the result of a fit or a study; the
    last ones have no pictures.

    Parameters
    ----------
    path : Path or str
        The file.

    Returns
    -------
    Study, MachineStudy, Fit, CalibrationResult, Propagation or Likelihood

    Raises
    ------
    InvalidValue
        If the file is not that of a result, or is one of an incompatible version.
    UnknownName
        If there is no such file.

    """
    path = Path(path)
    if not path.is_file():
        raise UnknownName.of("result", path.name, [other.name for other in path.parent.glob("*.json")])
    try:
        values = json.loads(path.read_text("utf-8"))
        return KINDS[_kind_of(values)].from_dict(values)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InvalidValue(f"'{path.name}' is not a result that can be opened ({type(error).__name__}: {error})",
                           "Give a file that `save` or a command with --out wrote, or the JSON result of the service") \
            from error


def _kind_of(values: dict[str, Any]) -> str:
    if "kind" in values:
        return str(values["kind"])
    for mark, kind in _MARKS.items():
        if mark in values.get("result", {}):
            return kind
    if "sensing_digest" in values:
        return CalibrationResult.kind
    raise InvalidValue("The file is that of a model, or of something else, and not of a result",
                       "Give a model to `slipstick.build` as `model`")
