"""A calibration as plain text: parameters with intervals and scatter, noise of the sensors, and what is left."""

from slipstick.bench import parameters
from slipstick.calibration import Calibration
from slipstick.recordings.signals import SIGNAL_UNITS

_LARGE_CHI_SQUARE = 2.0
"""Reduced chi-square above which the text speaks of a missing effect: the residuals have twice the variance of the
noise. The fit does not depend on it."""


def calibration_text(calibration: Calibration) -> str:
    """The calibration as plain text."""
    nominal = dict(zip(parameters.NAMES, calibration.model.physics.nominal, strict=True))
    lines = [*([" ".join(calibration.partial.warning)] if calibration.partial else []),
             f"Bench '{calibration.bench}'",
             f"{'parameter':22}{'value':>12}  {f'{calibration.level:.0%} interval':>24}  {'x nominal':>9}  "
             f"{'scatter':>8}"]
    for name, entry in calibration.spec()["parameters"].items():
        note = "  at a bound: not a valid estimate" if name in calibration.at_bound else \
            "  not determined" if name in calibration.undetermined else ""
        scatter, error = (entry[key] / abs(nominal[name]) for key in ("scatter", "scatter_error"))
        shown = f"{scatter:8.2%}" if scatter > error else f"< {scatter + error:.2%}"
        lines.append(f"{name:22}{entry['value']:12.5g}  {entry['interval'][0]:11.5g} to {entry['interval'][1]:<10.5g}"
                     f"{entry['value'] / nominal[name]:9.4f}  {shown:>8}  {entry['unit']}{note}")
    lines += _list_undetermined(calibration)
    lines.append("Scatter: standard deviation from run to run, as a share of the nominal value\n"
                 "Correlation of the estimates, in the same order")
    lines += ["  " + "".join(f"{value:7.2f}" for value in row) for row in calibration.correlation]
    lines.append("Sensor noise, its correlation from sample to sample, and reduced chi-square")
    lines += [f"  {name:20}{calibration.noise[name]:9.3g}  {calibration.noise_correlation.get(name, 0.0):5.2f}"
              f"{value:9.2f}" for name, value in calibration.chi_square.items()]
    if max(calibration.chi_square.values()) > _LARGE_CHI_SQUARE:
        lines.append("Reduced chi-square is well above 1, although each run has parameters of its own: an effect is\n"
                     "missing (see `study`). Values and intervals then describe the best model without it.")
    if not calibration.converged:
        lines.append("The fit has not converged: do not use its intervals.")
    lines.append(f"RMS of the shifting-time residual: {1e3 * calibration.rms_before:.1f} ms before the calibration, "
                 f"{1e3 * calibration.rms_after:.1f} ms after")
    return "\n".join(lines)


def _list_undetermined(calibration: Calibration) -> list[str]:
    missing = [name for name in SIGNAL_UNITS if name not in calibration.signals]
    lines = [f"Not measured: {', '.join(missing)}"] if missing else []
    if calibration.undetermined:
        lines.append(f"Not determined by these recordings: {', '.join(calibration.undetermined)}.\n"
                     "At most combinations of them are. Among the values that fit alike, these are near the start, and "
                     "the\nintervals say what the bounds of the bench file leave open.")
    return lines
