"""`verify`: check the integrity of a table, describe it, and compare it with direct simulation."""

import argparse
import os
from pathlib import Path

import numpy as np

from slipstick.bench import Bench, Conditions
from slipstick.black_box import BlackBox, BlackBoxDescription, Workers
from slipstick.black_box.simulation import OUTCOMES
from slipstick.clutch.ensemble import STATUS, TIGHT, Simulator
from slipstick.errors import InvalidValue
from slipstick.numerics.quantities import raised
from slipstick.recordings import Recordings
from slipstick.table import Grid, Surrogate, Table
from slipstick.uncertainty import Inputs, log10_mean_density, mass_outside, standard_normals

from .bench_option import bench_file, refuse_machine
from .surrogate import describe_error

SHIPPED = Path("tables/measured.h5")
SAMPLES = 1024
"""Number of samples, the same for both likelihoods, so that sampling error largely cancels in their difference."""
REFERENCE_STD, REFERENCE_OUTPUT_STD = 0.05, 5e-3
"""The candidate at which likelihoods are compared: mean 1 and this std on every axis, and this output std in s."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the table file")
    parser.add_argument("--bench", type=bench_file, metavar="FILE.toml",
                        help="the bench of the table; a table of another bench is refused (default: not checked)")
    parser.add_argument("--machine", type=Path, metavar="FILE",
                        help="the file of another machine from which the table was built, to simulate it")
    parser.add_argument("--points", type=int, default=2000, metavar="N",
                        help="number of random points between the edges of the table (default: %(default)s); "
                             "0 only checks the file")
    parser.add_argument("--seed", type=int, default=1, help="seed of these points (default: %(default)s)")
    parser.add_argument("--recordings", type=Path, default=SHIPPED, metavar="FILE",
                        help="recordings whose likelihood is computed by the table and by direct simulation "
                             "(default: %(default)s)")


def run(arguments: argparse.Namespace) -> int:
    """Check the table, print its description and its errors; raises `BadTable`, and `InvalidValue` for an option."""
    if arguments.points < 0:
        raise InvalidValue(f"{arguments.points} points cannot be compared", "Give --points 0 or more")
    table = Table.open(arguments.file)
    if arguments.bench:
        Bench.open(arguments.bench).require(table.clutch.physics)
    if not isinstance(table.model, BlackBoxDescription):
        refuse_machine(arguments)
    print(describe(table))
    if isinstance(table.model, BlackBoxDescription):
        if arguments.points > 0:
            print(machine_error(table, table.model, arguments.machine, arguments.points, arguments.seed))
    elif arguments.points > 0:
        print(interpolation_error(table, arguments.points, arguments.seed))
        if arguments.recordings != SHIPPED or SHIPPED.exists():
            print(likelihood_error(table, Recordings.open(arguments.recordings)))
    return 0


def describe(table: Table) -> str:
    """Axes, conditions, model, origin, kind and digest of the table, one per line."""
    lines = [f"{axis.name}: {axis.lower:g} to {axis.upper:g} of {axis.nominal:g} {raised(axis.unit)}"
             for axis in table.axes]
    kind: str = table.kind
    if isinstance(table, Grid):
        shape = " x ".join(str(len(axis.values)) for axis in table.axes)
        what, outcomes = ("runs", OUTCOMES) if isinstance(table.model, BlackBoxDescription) else ("engagements", STATUS)
        counts = (f"{np.count_nonzero(table.status == code):,} {name}" for code, name in outcomes.items())
        kind += f" of {shape} points; {what}: {', '.join(counts)}"
    if isinstance(table, Surrogate):
        kind += f" {describe_error(table)}"
    return "\n".join([*lines, f"conditions: {len(table.conditions)}, digest {table.conditions.digest}",
                      f"model: digest {table.model.digest}, {_model(table)}", f"origin: {table.origin}",
                      f"kind: {kind}", f"content: digest {table.digest}"])


def _model(table: Table) -> str:
    if isinstance(table.model, BlackBoxDescription):
        return f"{table.output.name} in {raised(table.output.unit)} of: {table.model.title}"
    effects = ", ".join(table.model.effects) or "none"
    return f"effects: {effects}" + "".join(f"\nmeasured law: {law.quantity} over {law.depends_on}"
                                           for law in table.model.laws)


def machine_error(table: Table, machine: BlackBoxDescription, path: Path | None, count: int, seed: int) -> str:
    """As `interpolation_error`, for another machine, whose simulator is that of the file at `path`."""
    if not machine.simulator:
        return "error: not computed; another program computed the table, so there is no simulation to compare with"
    if path is None:
        return "error: not computed; give --machine FILE to simulate the machine"
    file = BlackBox.open(path, machine.output.name)
    if file.description.digest != machine.digest:
        raise InvalidValue(f"'{path.name}' describes another machine or simulator than the table",
                           "Give the file from which the table was built, or build the table again")
    points = np.random.default_rng(seed).uniform(table.lower, table.upper, (count, len(table.axes)))
    with Workers(file, os.cpu_count() or 1) as workers:
        direct, _ = workers.simulate(tuple(axis.name for axis in table.axes), points, file.cases)
    difference = table.interpolate(points, "error") - direct
    defined = difference[np.isfinite(difference)]
    if not len(defined):
        return f"error: undefined, no run at {count} points has an output both in the table and in direct simulation"
    unit = raised(table.output.unit)
    return (f"error: {np.sqrt(np.mean(defined**2)):.4g} {unit} RMS, {np.abs(defined).max():.4g} "
            f"{unit} maximum against direct simulation, over {len(defined):,} runs at {count:,} random "
            f"points (seed {seed}); {difference.size - len(defined):,} runs have no output in one of them or both")


def interpolation_error(table: Table, count: int, seed: int) -> str:
    """The error against the tight simulation at `count` random points between the edges of the table."""
    points = np.random.default_rng(seed).uniform(table.lower, table.upper, (count, len(table.axes)))
    assert isinstance(table.conditions, Conditions)  # as the table is one of a clutch
    difference = (table.interpolate(points, "error") - _direct(table)(points, table.conditions)) * 1e3
    defined = difference[np.isfinite(difference)]
    if not len(defined):
        return f"error: undefined, no engagement at {count} points locks both in the table and in direct simulation"
    return (f"error: {np.sqrt(np.mean(defined**2)):.4f} ms RMS, {np.abs(defined).max():.3f} ms maximum against direct "
            f"simulation, over {len(defined):,} engagements at {count:,} random points (seed {seed}); "
            f"{difference.size - len(defined):,} engagements have no shifting time in the table, in direct simulation "
            "or in both")


def likelihood_error(table: Table, recordings: Recordings) -> str:
    """The likelihood of `recordings` by the table and by the tight simulation, computed from the same samples."""
    dimension = len(table.axes)
    inputs = Inputs(np.ones(dimension), np.full(dimension, REFERENCE_STD))
    normals = standard_normals(dimension, SAMPLES, seed=1)
    try:
        outputs = [model(inputs.points(normals), recordings.conditions) for model in (table, _direct(table))]
    except InvalidValue as error:
        return f"likelihood: not computed for these recordings. {error}"
    by_table, direct = (float(log10_mean_density(times, recordings.measured_time, REFERENCE_OUTPUT_STD).sum())
                        for times in outputs)
    outside = mass_outside(inputs, table.lower, table.upper, normals)
    return (f"likelihood: log10 likelihood per ms {by_table:.4f} by the table and {direct:.4f} by direct simulation, "
            f"difference {by_table - direct:+.4f} decades, at mean 1, std {REFERENCE_STD:g} and output std "
            f"{REFERENCE_OUTPUT_STD * 1e3:g} ms; probability outside the table {outside:.2g}")


def _direct(table: Table) -> Simulator:
    return Simulator(table.clutch, tuple(axis.name for axis in table.axes), TIGHT)
