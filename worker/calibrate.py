"""`calibrate`: fit the uncertain parameters of a bench and their scatter from run to run (section II.C)."""

import argparse
import json
import sys
from pathlib import Path

from slipstick.bench import Bench, parameters
from slipstick.calibration import Calibration, calibrate
from slipstick.errors import InvalidValue
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.storage.files import replacing

from .bench_option import add_bench_argument, command_line, open_model, open_recordings
from .orders import add_time_budget_argument

LARGE_CHI_SQUARE = 2.0
"""Reduced chi-square above which the report speaks of a missing effect: the residuals have twice the variance of the
noise. The fit does not depend on it."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("--recordings", type=Path, default=Path("tables/measured.h5"), metavar="FILE",
                        help="recordings with at least one signal, .h5 or .csv (default: %(default)s)")
    parser.add_argument("--signals", type=Path, metavar="FILE",
                        help="the CSV file of the signals, if the recordings are a CSV file")
    add_bench_argument(parser)
    parser.add_argument("--model", type=Path, metavar="SPEC.json",
                        help="the model to start from (default: the nominal parameters)")
    add_time_budget_argument(parser)
    parser.add_argument("--out", type=Path, metavar="FILE",
                        help="write the calibration as JSON, for `build --model`")


def run(arguments: argparse.Namespace) -> int:
    """Calibrate, print the result, and write it unless a parameter is at a bound."""
    bench = Bench.open(arguments.bench)
    recordings = open_recordings(bench, arguments.recordings, arguments.signals)
    calibration = calibrate(recordings, bench, open_model(bench, arguments.model), print_progress,
                            arguments.time_budget)
    print(report(calibration))
    if calibration.at_bound:
        bounds = ", ".join(f"{name} ({p.lower:g} to {p.upper:g} times nominal)" for name in calibration.at_bound
                           for p in [bench.prior(name)])
        raise InvalidValue(f"The calibration was not written, because parameters are at a bound: {bounds}",
                           "Look for an effect that the model lacks (`study`), or start from another --model")
    if arguments.out:
        arguments.out.parent.mkdir(parents=True, exist_ok=True)
        with replacing(arguments.out) as temporary:
            temporary.write_text(json.dumps(calibration.spec(), indent=1) + "\n")
        print(f"Wrote {arguments.out}\nBuild a table of the calibrated model: "
              + command_line("build", "--bench", arguments.bench, "--model", arguments.out,
                             "--out", "tables/calibrated.h5"))
    return 0


def print_progress(free: tuple[str, ...], iterations: int, change: float) -> None:
    """Print to stderr the iterations so far and the largest change of a parameter."""
    print(f"iteration {iterations:2}: {len(free)} parameters, largest change {change:.3g} standard errors",
          file=sys.stderr)


def _undetermined(calibration: Calibration) -> list[str]:
    missing = [name for name in SIGNAL_UNITS if name not in calibration.signals]
    lines = [f"Not measured: {', '.join(missing)}"] if missing else []
    if calibration.undetermined:
        lines.append(f"Not determined by these recordings: {', '.join(calibration.undetermined)}.\n"
                     "At most combinations of them are. Among the values that fit alike, these are near the start, and "
                     "the\nintervals say what the bounds of the bench file leave open.")
    return lines


def report(calibration: Calibration) -> str:
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
    lines += _undetermined(calibration)
    lines.append("Scatter: standard deviation from run to run, as a share of the nominal value\n"
                 "Correlation of the estimates, in the same order")
    lines += ["  " + "".join(f"{value:7.2f}" for value in row) for row in calibration.correlation]
    lines.append("Sensor noise, its correlation from sample to sample, and reduced chi-square")
    lines += [f"  {name:20}{calibration.noise[name]:9.3g}  {calibration.noise_correlation.get(name, 0.0):5.2f}"
              f"{value:9.2f}" for name, value in calibration.chi_square.items()]
    if max(calibration.chi_square.values()) > LARGE_CHI_SQUARE:
        lines.append("Reduced chi-square is well above 1, although each run has parameters of its own: an effect is\n"
                     "missing (see `study`). Values and intervals then describe the best model without it.")
    if not calibration.converged:
        lines.append("The fit has not converged: do not use its intervals.")
    lines.append(f"RMS of the shifting-time residual: {1e3 * calibration.rms_before:.1f} ms before the calibration, "
                 f"{1e3 * calibration.rms_after:.1f} ms after")
    return "\n".join(lines)
