"""Where tables and recordings meet the uncertainty: both as the models and problems that `uncertainty/` knows."""

from slipstick.recordings import Recordings
from slipstick.table import Outside, Table
from slipstick.uncertainty.likelihood import Model, Problem


def table_model(table: Table, outside: Outside) -> Model:
    """The table as a model, with what holds beyond its edges; it raises `OutsideTable` for the policy `error`."""
    return lambda points, conditions: table.restricted(conditions).interpolate(points, outside)


def table_problem(table: Table, recordings: Recordings, outside: Outside) -> Problem:
    """Hold the recordings against the table; raises `InvalidValue` where it lacks one of their conditions."""
    table.restricted(recordings.conditions)
    return Problem(table_model(table, outside), recordings.conditions, recordings.measured_time, table.lower,
                   table.upper, tuple(axis.name for axis in table.axes))
