"""Calibration: the uncertain parameters of a bench, and their scatter from run to run, from recordings."""

from slipstick.calibration.calibrate import calibrate, require_signals
from slipstick.calibration.result import Calibration

__all__ = ["Calibration", "calibrate", "require_signals"]
