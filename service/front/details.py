"""What the pages of tables, recordings and benches have in common, and the page of a bench."""

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from itertools import islice

import numpy as np

from slipstick.bench import Bench, parameters
from slipstick.bench.converter import CAPACITY_UNIT
from slipstick.interface.tables import condition_columns
from slipstick.pictures import units
from slipstick.pictures.panels import draw_curves
from slipstick.pictures.theme import in_words
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.report.markup import coded, definitions, paragraph, section, table
from slipstick.table.subject import Setting, columns

from ..drawings import Drawings
from ..front.elements import Link, fold, link_line
from ..front.panels import Panel, draw_panels

_MOST = 1000
"""Maximum number of conditions on a page."""
_BLOCKS = (("valve", ("current",), "oil pressure"),
           ("piston and plates", ("oil pressure", "input speed", "output speed"), "output torque"),
           ("load", ("output torque", "load inertia", "brake torque"), "output speed"))


def bench_page(name: str, bench: Bench, about: str, drawings: Drawings) -> str:
    """Return the content of the page of a bench."""
    rows = [(entry.meaning, f"{value:.6g}", units.raised(entry.unit), entry.name)
            for entry, value in zip(parameters.PARAMETERS, bench.physics.nominal, strict=True)]
    return page("Bench", name, about, f"/v1/benches/{name}", [
        section("Blocks", paragraph("The model is cut where a signal is measured. Each block reads what was measured, "
                                    "and gives the next signal."), _blocks(bench)),
        section("Sensors", _sensors(bench)),
        section("Profiles and curves", draw_panels(drawings, _curves(bench), "bench", bench.digest,
                                                   bench.conditions.digest)),
        section("Parameters", table(("parameter", "nominal value", "unit", "name"), rows, {2, 3})),
        section("Conditions", conditions_table(bench.conditions)),
        section("Origin", f"<p>{coded(bench.source.strip())}</p>", definitions([
            ("digest", bench.digest), ("digest of sensors and priors", bench.sensing_digest)]))])


def _blocks(bench: Bench) -> str:
    driven = ("motor speed through the torque converter",) if bench.physics.converter else ("input torque",)
    entries = (*_BLOCKS, ("input shaft", ("output torque", *driven), "input speed"))
    items = "\n".join(
        f'<li><h3>{escape(block)}</h3><p><span class="side">reads</span> {escape(", ".join(reads))}</p>'
        f'<p><span class="side">gives</span> <strong>{escape(gives)}</strong></p></li>'
        for block, reads, gives in entries)
    return f'<ol class="blocks">\n{items}\n</ol>'


def _sensors(bench: Bench) -> str:
    unit_of = {**SIGNAL_UNITS, "shifting_time": "s"}
    rows = [(in_words(signal), units.raised(unit_of.get(signal, "")), *(
        "unknown" if value is None else f"{value:g}" for value in (sensor.noise, sensor.resolution, sensor.lag)))
        for signal, sensor in bench.sensors.items()]
    return table(("signal", "unit", "noise", "resolution", "lag [s]"), rows, {1}) + paragraph(
        f"Noise: its standard deviation. A sample every {1e3 * bench.sample_time:g} ms.", "note")


def _curves(bench: Bench) -> list[Panel]:
    conditions, converter = bench.conditions, bench.physics.converter
    profiles = {f"profile {number}": (time, current) for number, (time, current) in enumerate(
        zip(conditions.profile_time, conditions.profile_current, strict=True))}
    drawn = [Panel(draw_curves("current", "A", ("time", "s"), profiles),
                   f"The {len(profiles)} current profiles of the bench over the time since the shift command.")]
    if converter is not None:
        ratio = np.array(converter.speed_ratio)
        for curve, unit, values in (("torque ratio", "1", converter.torque_ratio),
                                    ("capacity factor", CAPACITY_UNIT, converter.capacity_factor)):
            drawn.append(Panel(draw_curves(curve, unit, ("speed ratio", "1"), {curve: (ratio, np.array(values))}),
                               f"The {curve} of the torque converter over its speed ratio."))
    return drawn


def page(kind: str, name: str, about: str, address: str, sections: Iterable[str]) -> str:
    """Return the content of a page about what has a `kind` and a `name`, described at `address` for programs."""
    return "\n".join([paragraph(kind, "over"), f"<h1>{escape(name)}</h1>", paragraph(about, "lead"), *sections,
                      link_line([Link("Description as JSON", address)])])


def conditions_table(conditions: Setting, more: Mapping[str, Sequence[float]] | None = None) -> str:
    """Return a folded table of all conditions by their numbers, and of the further columns `more`."""
    given = {**condition_columns(columns(conditions)), **(more or {})}
    return numbers_table("number", given, len(conditions), "condition")


def numbers_table(word: str, columns: Mapping[str, Sequence[float]], count: int, noun: str) -> str:
    """Return a table of columns under headings with units, one row for each number; folded where it is long."""
    head = (word, *(units.raised(in_words(heading)).removesuffix(" [1]") for heading in columns))
    rows = [[str(number), *(f"{value:.5g}" for value in row)]
            for number, row in enumerate(islice(zip(*columns.values(), strict=True), _MOST))]
    left = count - len(rows)
    note = paragraph(f"{left:,} more are in the description as JSON.", "note") if left else ""
    return fold(table(head, rows) + note, count, noun)
