"""The pages of a table, of recordings and of a bench: what they are, and their conditions with units."""

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from itertools import islice

import numpy as np

from slipstick.bench import Bench, parameters
from slipstick.black_box import Measurements
from slipstick.interface.tables import condition_columns
from slipstick.machine import Runs
from slipstick.pictures.theme import in_words
from slipstick.recordings import Recordings
from slipstick.report.markup import definitions, paragraph, section, table
from slipstick.table import Table
from slipstick.table.subject import Setting, columns

from ..front.elements import Link

_MOST = 1000
"""Maximum number of conditions on a page."""


def table_page(name: str, shown_table: Table, about: str) -> str:
    """Return the content of the page of a table; `about` is a sentence on it."""
    axes = [(in_words(axis.name), f"{axis.nominal:g}", axis.unit, f"{axis.values[0]:g} to {axis.values[-1]:g}",
             str(len(axis.values))) for axis in shown_table.axes]
    return _page("Table", name, about, f"/v1/tables/{name}", [
        section("Axes", table(("parameter", "nominal value", "unit", "range [multiples]", "points"), axes, {2})),
        section("Conditions", _conditions(shown_table.conditions)),
        section("Origin", definitions([("computed by", shown_table.origin), ("digest", shown_table.digest),
                                       ("digest of the model", shown_table.model.digest)]))])


def recordings_page(name: str, recordings: Recordings | Measurements | Runs, about: str) -> str:
    """Return the content of the page of recordings."""
    if isinstance(recordings, Runs):
        return _runs_page(name, recordings, about)
    output = "shifting time [s]" if isinstance(recordings, Recordings) else \
        f"{recordings.output.name} [{recordings.output.unit}]"
    return _page("Recordings", name, about, f"/v1/recordings/{name}", [
        section("Engagements", _conditions(recordings.conditions, {output: recordings.measured_time.tolist()})),
        section("Origin", definitions([("digest", recordings.digest)]))])


def _runs_page(name: str, runs: Runs, about: str) -> str:
    """Return the content of the page of runs of a declared machine: what was recorded, and constants of the runs."""
    recorded = [(kind, entry, runs.units.get(entry, ""), f"{np.min(values):.5g} to {np.max(values):.5g}")
                for kind, entries in (("signal", runs.signals), ("command", {
                    entry: profile.value for entry, profile in runs.commands.items()}), ("channel", runs.channels))
                for entry, values in entries.items()]
    constants = {entry: values for entry, values in {**runs.conditions, **runs.channels}.items() if values.ndim == 1}
    head = ("run", *(f"{entry} [{runs.units[entry]}]" if runs.units.get(entry, "1") != "1" else entry
                     for entry in constants))
    rows = [[str(number), *(f"{values[number]:.5g}" for values in constants.values())]
            for number in range(min(len(runs), _MOST))]
    return _page("Recordings", name, about, f"/v1/recordings/{name}", [
        section("Recorded", paragraph(f"{len(runs.time)} samples from {runs.time[0]:g} to {runs.time[-1]:g} s"),
                table(("kind", "name", "unit", "range"), recorded, {1, 2})),
        section("Runs", table(head, rows)) if constants else "",
        section("Origin", definitions([("machine", runs.machine), ("digest", runs.digest)]))])


def bench_page(name: str, bench: Bench, about: str) -> str:
    """Return the content of the page of a bench."""
    rows = [(entry.meaning, f"{value:.6g}", entry.unit, entry.name)
            for entry, value in zip(parameters.PARAMETERS, bench.physics.nominal, strict=True)]
    return _page("Bench", name, about, f"/v1/benches/{name}", [
        section("Parameters", table(("parameter", "nominal value", "unit", "name"), rows, {2, 3})),
        section("Conditions", _conditions(bench.conditions)),
        section("Origin", paragraph(bench.source.strip()), definitions([
            ("digest", bench.digest), ("digest of sensors and priors", bench.sensing_digest)]))])


def _page(kind: str, name: str, about: str, address: str, sections: Iterable[str]) -> str:
    return "\n".join([paragraph(kind, "over"), f"<h1>{escape(name)}</h1>", paragraph(about, "lead"), *sections,
                      f'<p class="links">{Link("Description as JSON", address).html()}</p>'])


def _conditions(conditions: Setting, more: Mapping[str, Sequence[float]] | None = None) -> str:
    """A table of all conditions by their numbers, and of the further columns `more`."""
    given = {**condition_columns(columns(conditions)), **(more or {})}
    head = ("number", *(in_words(name) for name in given))
    rows = [[str(number), *(f"{value:.5g}" for value in row)]
            for number, row in enumerate(islice(zip(*given.values(), strict=True), _MOST))]
    left = len(conditions) - len(rows)
    return table(head, rows) + (paragraph(f"{left:,} more are in the description as JSON.", "note") if left else "")
