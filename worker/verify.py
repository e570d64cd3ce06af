"""`verify`: check a table, say what it is, and hold its interpolation against direct simulation."""

import argparse
from pathlib import Path

import numpy as np

from slipstick.clutch.ensemble import STATUS, TIGHT, Simulator
from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings
from slipstick.table import Grid, Surrogate, Table
from slipstick.uncertainty import Inputs, log10_mean_density, mass_outside, standard_normals
from worker.surrogate import describe_error

SHIPPED = Path("tables/measured.h5")
GERMS = 1024
"""Samples of the germ, the same for both likelihoods, so that only their difference means anything."""
REFERENCE_STD, REFERENCE_OUTPUT_STD = 0.05, 5e-3
"""The inputs at which likelihoods are compared: mean 1 and this std on every axis, and this output std in s."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the command line."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the table")
    parser.add_argument("--points", type=int, default=2000, metavar="N",
                        help="random points off the grid (default: %(default)s); 0 checks the file only")
    parser.add_argument("--seed", type=int, default=1, help="of these points (default: %(default)s)")
    parser.add_argument("--recordings", type=Path, default=SHIPPED, metavar="FILE",
                        help="what likelihoods are measured on (default: %(default)s)")


def run(arguments: argparse.Namespace) -> int:
    """Verify, describe and measure; a bad table raises `BadTable`."""
    table = Table.open(arguments.file)
    print(describe(table))
    if arguments.points > 0:
        print(interpolation_error(table, arguments.points, arguments.seed))
        if arguments.recordings != SHIPPED or SHIPPED.exists():
            print(likelihood_error(table, Recordings.open(arguments.recordings)))
    return 0


def describe(table: Table) -> str:
    """What the table is, in lines."""
    lines = [f"{axis.name}: {axis.lower:g} to {axis.upper:g} of {axis.nominal:g} {axis.unit}" for axis in table.axes]
    kind: str = table.kind
    if isinstance(table, Grid):
        kind += " of " + " x ".join(str(len(axis.values)) for axis in table.axes)
        for code, name in STATUS.items():
            kind += f", {np.count_nonzero(table.status == code):,} {name}"
    if isinstance(table, Surrogate):
        kind += f" {describe_error(table)}"
    effects = ", ".join(table.model.effects) or "none"
    return "\n".join([*lines, f"conditions: {len(table.conditions)}, digest {table.conditions.digest}",
                      f"model: digest {table.model.digest}, effects: {effects}", f"origin: {table.origin}",
                      f"kind: {kind}", f"content: digest {table.digest}"])


def interpolation_error(table: Table, count: int, seed: int) -> str:
    """Compare with the tight simulation at `count` random points between the edges of the table."""
    points = np.random.default_rng(seed).uniform(table.lower, table.upper, (count, len(table.axes)))
    difference = (table.interpolate(points, "error") - _direct(table)(points, table.conditions)) * 1e3
    both = difference[np.isfinite(difference)]
    if not len(both):
        return f"error: no engagement locks both in the table and directly at {count} points"
    return (f"error: {np.sqrt(np.mean(both**2)):.4f} ms RMS, {np.abs(both).max():.3f} ms at most from direct "
            f"simulation, {len(both):,} engagements at {count:,} random points (seed {seed}); "
            f"{difference.size - len(both):,} without a time in the table, directly, or both")


def likelihood_error(table: Table, recordings: Recordings) -> str:
    """Compare the likelihood of `recordings` by the table and by the tight simulation, at the same samples."""
    dimension = len(table.axes)
    inputs = Inputs(np.ones(dimension), np.full(dimension, REFERENCE_STD))
    germs = standard_normals(dimension, GERMS, seed=1)
    try:
        outputs = [model(inputs.points(germs), recordings.conditions) for model in (table, _direct(table))]
    except InvalidValue as error:
        return f"likelihood: not measured on these recordings. {error}"
    by_table, direct = (float(log10_mean_density(times, recordings.measured_time, REFERENCE_OUTPUT_STD).sum())
                        for times in outputs)
    outside = mass_outside(inputs, table.lower, table.upper, germs)
    return (f"likelihood: log10 {by_table:.4f} by the table, {direct:.4f} directly, {by_table - direct:+.4f} decades, "
            f"per ms, at mean 1, std {REFERENCE_STD:g}, output std {REFERENCE_OUTPUT_STD * 1e3:g} ms; "
            f"{outside:.2g} of the probability lies outside the table")


def _direct(table: Table) -> Simulator:
    return Simulator(table.model, tuple(axis.name for axis in table.axes), TIGHT)
