"""The page of a machine whose file a worker has: blocks, parameters, sensors, experiments and outputs, as it is told.

All of it comes from the job database, and is text or numbers.
"""

import math
from collections.abc import Iterable, Mapping
from html import escape
from itertools import islice
from typing import Any
from urllib.parse import quote, urlencode

import numpy as np

from slipstick.black_box.known import KnownMachine, SimulatedOutput
from slipstick.errors import SlipstickError
from slipstick.machine import Command, Condition, MachineDescription, Output, Parameter, Quantity
from slipstick.machine.description import BlockDescription
from slipstick.pictures import units
from slipstick.pictures.panels import draw_curves
from slipstick.pictures.theme import in_words
from slipstick.report.markup import paragraph, section, table
from slipstick.report.words import listed
from slipstick.storage.library import Library

from ..drawings import Drawings
from ..front.details import page
from ..front.elements import UNFOLDED, Entry, Link, fold, group, link_line, plural
from ..front.panels import Panel, draw_panels
from ..machines import Machines, StoredMachine
from .forms import WITHOUT_SCRIPT, Form, folded
from .holdings import file_entry
from .orders import recorded_subjects, table_subjects

_MOST_CURVES, _POINTS = 12, 400
"""Profiles of a command that are drawn, and points of each."""
_TAKEN = {"end": "at the end of the run", "largest": "its largest value", "smallest": "its smallest value",
          "mean": "its mean"}


def address_of(name: str) -> str:
    """Return the address of the page of a machine."""
    return f"/machines/{quote(name)}"


def machine_links(machines: Machines, name: str | None) -> list[Link]:
    """Return a link to the page of a machine; none where there is no name, or no worker has told of it."""
    return [] if name is None or machines.get(name) is None else [Link(f"The machine “{name}”", address_of(name))]


def machine_entry(stored: StoredMachine) -> Entry:
    """Return a machine as an entry of a list."""
    href, mark = address_of(stored.name), "" if stored.workers else "no worker"
    try:
        return Entry(stored.name, href, about_machine(stored.known), mark)
    except SlipstickError as error:
        return Entry(stored.name, href, str(error), "invalid")


def about_machine(known: KnownMachine) -> str:
    """Return what is known of a machine, in a sentence."""
    outputs = list(dict.fromkeys(in_words(each.about.output.name) for each in known.outputs))
    tables = f"; tables of {listed(outputs)}" if outputs else ""
    declared = known.declared
    if declared is None:
        inputs = known.outputs[0].about.inputs if known.outputs else ()
        return f"{plural(len(inputs), 'input')}, {plural(known.experiments, 'condition')}{tables}"
    blocks = plural(len(declared.blocks), "block")
    if declared.blocks:
        blocks += f" ({listed([each.name for each in declared.blocks])})"
    run = plural(known.experiments, "experiment") if known.experiments else "no experiments of its own"
    return f"{blocks}, {plural(len(_parameters(declared.blocks)), 'parameter')}, {run}{tables}"


def machine_page(stored: StoredMachine, orders: Mapping[str, Form], library: Library, drawings: Drawings) -> str:
    """Return the content of the page of a machine with the jobs that it can be given to; raises `InvalidValue`."""
    known = stored.known
    running = paragraph(f"{plural(stored.workers, 'running worker')} {'has' if stored.workers == 1 else 'have'} its "
                        "file.", "note") if stored.workers else (
        '<aside class="warnings"><p><strong>No running worker has its file.</strong> What is shown is what the last '
        "one told. Jobs of this machine need a worker: <code>slipstick work --machine FILE</code></p></aside>")
    added = [] if known.declared is None else [
        Link("Add recordings of it", f"/upload?{urlencode({'machine': stored.name})}#read-files")]
    links = link_line([*added, Link("Jobs with it", f"/find?{urlencode({'text': stored.name})}")])
    actions = section("What to do", running, *(
        [WITHOUT_SCRIPT, *(folded(title, form.html()) for title, form in orders.items())] if orders else []), links)
    declared = known.declared
    sections = [] if declared is None else [
        section("Blocks", paragraph("The model is cut where a signal is measured. Each block reads what was commanded, "
                                    "stated or measured, and gives the next signal."), _blocks(declared.blocks)),
        section("Sensors", _sensors(declared)),
        section("Experiments", _experiments(declared), draw_panels(
            drawings, _draw_commands(declared), "machine", stored.digest), _commands(declared.commands),
            _conditions(declared.conditions)),
        section("Parameters", _parameter_table(declared.blocks)),
        section("What a law may change", _quantities(declared)),
        section("Effects with a name", _effects(declared)),
        section("Outputs", _outputs(declared))]
    files = [*(file_entry("recordings", name, library) for name, subject in recorded_subjects(library)
               if subject.machine == stored.name),
             *(file_entry("tables", name, library) for name, subject in table_subjects(library)
               if subject.machine == stored.name)]
    return page("Machine", stored.name, f"{about_machine(known)}.", f"/v1/machines/{quote(stored.name)}", [
        actions, *sections,
        section("Tables", _tables(known)),
        group("Recordings and tables", files, "There are no runs and no tables of it yet.", most=UNFOLDED)])


def _blocks(blocks: Iterable[BlockDescription]) -> str:
    def line(word: str, names: Iterable[str], is_strong: bool = False) -> str:
        words = escape(", ".join(names))
        return f'<p><span class="side">{word}</span> {f"<strong>{words}</strong>" if is_strong else words}</p>' \
            if words else ""

    items = "\n".join("".join([
        f"<li><h3>{escape(block.name)}</h3>", line("reads", block.reads), line("gives", block.gives, is_strong=True),
        line("states", (f"{each} (may rest)" if each in block.switches else each for each in block.states)),
        line("laws also over", block.derived), line("parameters", (each.name for each in block.parameters)),
        line("may change", (each.name for each in block.quantities)), "</li>"]) for block in blocks)
    return f'<ol class="blocks">\n{items}\n</ol>'


def _sensors(declared: MachineDescription) -> str:
    rows = [(each.signal, _unit(each.unit), f"{each.noise:g}" if each.noise else "not stated")
            for each in declared.sensors]
    words = ["Noise: the standard deviation that simulated runs get; that of recordings is estimated."]
    words += [f"{what}: {listed(list(names))}." for what, names in (
        ("Further signals that laws may depend on", declared.signals),
        ("Further channels that the equations read", declared.inputs)) if names]
    return table(("signal", "unit", "noise"), rows, {1}) + paragraph(" ".join(words), "note")


def _experiments(declared: MachineDescription) -> str:
    if not declared.experiments:
        return paragraph("It does not say how it is run, and is not simulated; runs that were recorded of it are "
                         "studied.", "note")
    unit, factor = units.scale("s", declared.step)
    choices = [f"the {what} of its {whose}" for what, whose, each in (
        ("profiles", "commands", declared.commands), ("levels", "conditions", declared.conditions)) if each]
    return paragraph(f"{plural(declared.experiments, 'experiment')} of {declared.duration:g} s with a sample every "
                     f"{factor * declared.step:g} {unit}: all combinations of {listed(choices) or 'nothing'}.")


def _draw_commands(declared: MachineDescription) -> list[Panel]:
    """A panel for each command with profiles; of what a worker tells, corners may be missing or not finite."""
    panels = []
    for command in declared.commands:
        corners = {f"profile {number}": np.array(each, float) for number, each in enumerate(command.profiles)
                   if each and np.isfinite(each).all()}
        shown = dict(islice(corners.items(), _MOST_CURVES))
        if not shown:
            continue
        end = max(float(each[-1, 0]) for each in shown.values())
        end = max(end, declared.duration) if math.isfinite(declared.duration) else end
        left = len(command.profiles) - len(shown)
        panels.append(Panel(
            draw_curves(command.name, command.unit, ("time", "s"),
                        {name: _extend(each, end) for name, each in shown.items()}),
            f"The {plural(len(shown), 'profile')} of the command {command.name} over time.",
            f"{left:,} more are not drawn." if left else ""))
    return panels


def _extend(corners: np.ndarray, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Return instants and values of a profile from 0 to its `end`, between which lines are drawn."""
    time = np.concatenate([[min(0.0, corners[0, 0])], corners[:, 0], [end]])
    values = np.concatenate([corners[:1, 1], corners[:, 1], corners[-1:, 1]])
    if len(time) <= _POINTS:
        return time, values
    places = np.linspace(time[0], end, _POINTS)
    return places, np.interp(places, time, values)


def _commands(commands: Iterable[Command]) -> str:
    without = [_titled(each.name, each.unit) for each in commands if not each.profiles]
    return paragraph(f"Commands without a profile: {listed(without)}.", "note") if without else ""


def _conditions(conditions: Iterable[Condition]) -> str:
    rows = [(each.name, units.with_unit(", ".join(f"{level:g}" for level in each.levels) or "not stated",
                                        _unit(each.unit)),
             _percent(each.within) + (", drifts" if each.drifts else ""), _percent(each.scatter))
            for each in conditions]
    return table(("condition", "levels", "error of a level", "scatter between runs"), rows, {1}) \
        if rows else ""


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def _parameters(blocks: Iterable[BlockDescription]) -> list[Parameter]:
    """The parameters, each once."""
    return list(dict.fromkeys(each for block in blocks for each in block.parameters))


def _parameter_table(blocks: Iterable[BlockDescription]) -> str:
    rows = [(each.name, _value(each), _change(each, each.within),
             _change(each, each.scatter) if each.scatter else "none") for each in _parameters(blocks)]
    return fold(table(("parameter", "nominal value", "known within", "scatter between runs"), rows, {1}), len(rows),
                "parameter") + paragraph(
        "Known within: the standard deviation of the mean over all runs before any is recorded.", "note") \
        if rows else ""


def _value(parameter: Parameter) -> str:
    if parameter.first_of is not None:
        return f"first {parameter.first_of}"
    return "not stated" if parameter.value is None else units.with_unit(
        f"{parameter.value:.6g}", _unit(parameter.unit))


def _change(parameter: Parameter, change: float) -> str:
    """A standard deviation of a parameter: a share where changes are factors, and else in its unit."""
    if not math.isfinite(change):
        return "estimated"
    nominal = 1.0 if parameter.value is None else parameter.value
    return _percent(change) if parameter.is_factor(nominal) else units.with_unit(
        f"{change * (parameter.scale or abs(nominal) or 1.0):.3g}", _unit(parameter.unit))


def _quantities(declared: MachineDescription) -> str:
    quantities = list(dict.fromkeys(each for block in declared.blocks for each in block.quantities))
    if not quantities:
        return ""
    fluctuates = any(each.disturbance for each in quantities)
    head = ("quantity", "unit", "may depend on", *(["fluctuates by"] if fluctuates else []))
    rows = [(each.name, "share" if each.relative else _unit(each.unit) or "1", _dependence(each),
             *([f"{each.disturbance:g}" if each.disturbance else ""] if fluctuates else [])) for each in quantities]
    errors = [f"{each.quantity} over {each.over}" for block in declared.blocks for each in block.curves]
    return fold(table(head, rows, {1, 2}), len(rows), "quantity") + paragraph(
        "They are 0 in the model; a study finds which of them depends on what, and tests errors of each sensor as well."
        + (f" Curves of data sheets, whose errors are always fitted: {listed(errors)}." if errors else ""), "note")


def _dependence(quantity: Quantity) -> str:
    if quantity.over is not None:
        return listed(list(quantity.over)) or "nothing"
    return f"everything but {listed(list(quantity.without))}" if quantity.without else "everything"


def _effects(declared: MachineDescription) -> str:
    rows = [(each.name, each.quantity, each.on, each.kind) for each in declared.effects]
    return table(("effect", "quantity", "depends on", "kind"), rows, {1, 2, 3}) if rows else ""


def _outputs(declared: MachineDescription) -> str:
    unit_of = {each.signal: _unit(each.unit) for each in declared.sensors}

    def meaning(output: Output) -> str:
        for level, word in ((output.above, "rises above"), (output.below, "falls below")):
            if level is not None:
                return units.with_unit(f"time at which {output.of} first {word} {level:g}",
                                       unit_of.get(output.of, ""))
        return f"{output.of}: {_TAKEN.get(output.take, output.take)}"

    rows = [(in_words(each.name), _unit(each.unit) or "1", meaning(each)) for each in declared.outputs]
    return table(("output", "unit", "meaning"), rows, {1, 2}) if rows else ""


def _tables(known: KnownMachine) -> str:
    """What tables can be built of, with the inputs folded; outputs that have these and conditions in common once."""
    shared = dict[tuple[Any, ...], list[SimulatedOutput]]()
    for each in known.outputs:
        shared.setdefault((each.about.inputs, each.about.columns, each.conditions), []).append(each)
    parts = []
    for (inputs, columns, conditions), outputs in shared.items():
        names = listed([_titled(each.about.output.name, each.about.output.unit) for each in outputs])
        over = listed([_titled(each.name, each.unit) for each in columns])
        simulators = listed(list(dict.fromkeys(each.about.simulator for each in outputs)))
        rows = [(in_words(each.name), f"{each.nominal:.6g}", _unit(each.unit),
                 f"{each.lower:.3g} to {each.upper:.3g}") for each in inputs]
        ranges = table(("input", "nominal value", "unit", "range [multiples]"), rows, {2})
        parts += [paragraph(f"Tables can be built of {names}, under {plural(conditions, 'condition')} of {over}."),
                  f"<details><summary>{plural(len(inputs), 'input')} with their ranges</summary>\n{ranges}</details>"
                  if known.declared is not None else ranges + paragraph(f"Simulator: {simulators}.", "note")]
    return "\n".join(parts)


def _unit(unit: str) -> str:
    """A unit with raised exponents, which is not broken at the end of a line."""
    return units.raised(unit).replace(" ", "\N{NO-BREAK SPACE}")


def _titled(name: str, unit: str) -> str:
    return in_words(name) if unit in ("", "1") else f"{in_words(name)} [{_unit(unit)}]"
