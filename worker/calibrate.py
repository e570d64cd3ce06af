"""`calibrate`: the seven uncertain parameters by nonlinear least squares on recordings (section II.C of the paper)."""

import argparse
import json
import sys
from pathlib import Path

from slipstick.bench import parameters
from slipstick.calibration import Calibration, calibrate
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings
from slipstick.storage.files import replacing
from worker.build import read_model

CLEAR = 2.0
"""Reduced chi-square beyond which noise alone no longer explains a signal."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the command line."""
    parser.add_argument("--recordings", type=Path, default=Path("tables/measured.h5"), metavar="FILE",
                        help="recordings with signals, .h5 or .csv (default: %(default)s)")
    parser.add_argument("--signals", type=Path, metavar="FILE", help="the CSV of the signals that go with a CSV")
    parser.add_argument("--model", type=Path, metavar="SPEC.json", help="where to start (default: nominal parameters)")
    parser.add_argument("--shifting-time-noise", type=float, default=3e-3, metavar="S",
                        help="standard deviation of the shifting-time measurement in s (default: %(default)s)")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the calibration as JSON, for `build --model`")


def run(arguments: argparse.Namespace) -> int:
    """Calibrate, print what was found, and write it unless a parameter ended at its bound."""
    start = read_model(arguments.model) if arguments.model else Model()
    recordings = Recordings.open(arguments.recordings, arguments.signals)
    found = calibrate(recordings, start, arguments.shifting_time_noise, say)
    print(report(found))
    if found.at_bound:
        pushed = " and ".join(f"{name} to a bound ({p.lower:g} to {p.upper:g} times nominal)" for name in found.at_bound
                              for p in [parameters.PARAMETERS[parameters.index(name)]])
        raise InvalidValue(f"These recordings push {pushed}: that is no result, and nothing was written",
                           "Look for a physical effect that the model lacks, or start from another --model")
    if arguments.out:
        arguments.out.parent.mkdir(parents=True, exist_ok=True)
        with replacing(arguments.out) as temporary:
            temporary.write_text(json.dumps(found.spec(), indent=1) + "\n")
    return 0


def say(free: tuple[str, ...], evaluations: int, squares: float) -> None:
    """Tell on stderr how the search goes."""
    print(f"{evaluations:3} evaluations, sum of squares {squares:.6g}, moving {', '.join(free)}", file=sys.stderr)


def report(found: Calibration) -> str:
    """The calibration as a page of text."""
    nominal = dict(zip(parameters.NAMES, parameters.nominal(), strict=True))
    lines = [f"{'parameter':22}{'value':>12}  {'std. error':>10}  {'x nominal':>9}"]
    for name, entry in found.spec()["parameters"].items():
        said = "  at its bound: not a result" if name in found.at_bound else ""
        lines.append(f"{name:22}{entry['value']:12.5g}  {entry['standard_error']:10.2g}  "
                     f"{entry['value'] / nominal[name]:9.4f}  {entry['unit']}{said}")
    lines.append("correlation of the estimates, in the same order")
    lines += ["  " + "".join(f"{value:7.2f}" for value in row) for row in found.correlation]
    lines.append("reduced chi-square (1: only sensor noise is left; more: runs scatter or physics is missing)")
    lines += [f"  {name:20}{value:9.2f}" for name, value in found.chi_square.items()]
    if max(found.chi_square.values()) > CLEAR:
        lines.append("Chi-square is far above 1, so standard errors are too small: pressure_bias, temperature_gain\n"
                     "and initial_position, which shift the onset of torque alike, are then known in combination only")
    lines.append(f"RMS of the shifting-time residual: {1e3 * found.rms_before:.1f} ms before, "
                 f"{1e3 * found.rms_after:.1f} ms after")
    return "\n".join(lines)
