"""Recorded runs of a declared machine as measurements of its output."""

from collections.abc import Mapping

import numpy as np

from slipstick.black_box.cases import Cases
from slipstick.black_box.declared import Declared, name_of, profile_column
from slipstick.black_box.measurements import Measurements
from slipstick.black_box.reader import BlackBox
from slipstick.errors import BadRecording, InvalidValue
from slipstick.machine import Command, Machine, Output, Parameter, Runs, evaluate_output, require_runs, select_profiles

FARTHEST = 0.05
"""Largest root mean square of the difference between a recorded command and its profile, as a share of the range."""
_MOST_LISTED = 10
_WIDE = 3.0
"""Standard deviations by which a first sample may be off."""


def measure_runs(runs: Runs, file: BlackBox) -> Measurements:
    """Return the output of a declared machine, computed from the signals of recorded runs, with their conditions.

    The profile of a run is that of the machine nearest to its command. Runs without an output are left out, which the
    description of the measurements says. Raises `InvalidValue` for a machine that is not declared, and `BadRecording`
    for runs of another machine, for a run that follows no profile or begins elsewhere than the experiments, and where
    no run has an output.
    """
    if not isinstance(file.simulator, Declared):
        raise InvalidValue(f"'{file.description.title}' is no declared machine, whose output runs would have",
                           "Give its measurements as a CSV file")
    machine, output = file.simulator.machine, file.simulator.declared_output
    require_runs(machine, runs)
    if output.above is None and output.below is None:
        _require_duration(machine, output, runs)
    for parameter in machine.parameters:
        if parameter.first_of is not None and parameter.first_of in runs.signals and parameter.value is not None:
            _require_begin(parameter, parameter.value, runs.signals[parameter.first_of], machine)
    columns: Mapping[str, np.ndarray] = {
        **{profile_column(each.name): _find_profiles(each, runs) for each in machine.commands},
        **{name_of(name): values for name, values in runs.conditions.items()}}
    measured = evaluate_output(output, runs.time, runs.signals)
    defined = np.isfinite(measured)
    missing = np.flatnonzero(~defined)
    listed = ", ".join(map(str, missing[:_MOST_LISTED])) + " and others" * (len(missing) > _MOST_LISTED)
    remark = f"{len(missing)} of {len(runs)} runs have no {file.description.output.name} and are left out: {listed}"
    if not defined.any():
        raise BadRecording(f"None of the {len(runs)} runs has the output {file.description.output.name}",
                           "Record runs that reach it, or choose another output")
    values = np.column_stack([columns[quantity.name] for quantity in file.description.columns])
    return Measurements(Cases(file.description.columns, values[defined]), measured[defined], file.description.output,
                        "; ".join(filter(None, [runs.description, remark * bool(len(missing))])))


def _find_profiles(command: Command, runs: Runs) -> np.ndarray:
    """Return the numbers (n,) of the profiles nearest to a recorded command."""
    recorded = runs.commands[command.name].at(runs.time)
    profiles = select_profiles(command.profiles, np.arange(len(command.profiles))).at(runs.time)
    distances = np.sqrt(np.mean((recorded[:, None] - profiles) ** 2, axis=2))
    nearest = np.argmin(distances, axis=1)
    size = np.ptp(profiles, axis=1)
    size = np.where(size > 0, size, np.abs(profiles).max(axis=1))[nearest]
    far = distances[np.arange(len(runs)), nearest] > FARTHEST * size
    if far.any():
        run = int(np.argmax(far))
        raise BadRecording(
            f"The command '{command.name}' of run {run} follows no profile of the machine: it differs from profile "
            f"{nearest[run]}, the nearest, by {distances[run, nearest[run]]:.3g} {command.unit} RMS",
            f"Declare the profile, or leave out the run; {FARTHEST:.0%} of the range of a profile are allowed")
    return np.asarray(nearest, float)


def _require_begin(parameter: Parameter, value: float, signal: np.ndarray, machine: Machine) -> None:
    """Refuse runs that begin with another value than the experiments, beyond what first samples scatter by."""
    spread = _WIDE * parameter.scatter * (parameter.scale or abs(value))
    far = np.abs(signal[:, 0] - value) > FARTHEST * np.ptp(signal, axis=1) + spread
    if far.any():
        run, unit = int(np.argmax(far)), parameter.unit
        raise BadRecording(
            f"Run {run} begins with a {parameter.first_of} of {signal[run, 0]:.4g} {unit}, and the experiments of the "
            f"machine '{machine.name}' with {value:g} {unit}, the value of '{parameter.name}'",
            f"Leave out the run, give '{parameter.name}' this value, or declare it as a condition with levels; "
            f"{FARTHEST:.0%} of the range of the signal are allowed beside its scatter")


def _require_duration(machine: Machine, output: Output, runs: Runs) -> None:
    recorded = runs.time[-1] - runs.time[0]
    # Clocks that are not even lose up to a sample at each end, where runs are brought to the same one.
    if abs(recorded - machine.duration) > machine.step + 2 * runs.step:
        raise BadRecording(f"The runs take {recorded:g} s, and experiments of the machine '{machine.name}' "
                           f"{machine.duration:g} s, on which its output '{output.name}' depends",
                           "Cut the runs, or declare the machine with their duration")
