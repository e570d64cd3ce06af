"""`machine`: write a template of a declared machine, or check one and show what it does."""

import argparse
from pathlib import Path

import numpy as np

from slipstick.building import say_compilation
from slipstick.errors import InvalidValue
from slipstick.machine import Machine
from slipstick.numerics.quantities import raised
from slipstick.pictures.machine import draw_machine
from slipstick.plausibility.machine import MachineInspection, inspect_machine
from slipstick.storage.shipped import file_of

from .bench import list_findings, picture_file, write_picture, write_template
from .program import command_line

TEMPLATE = "heated_plate"
"""The shipped machine that is the template."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the actions and their options."""
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    new = actions.add_parser("new", help="write a commented template of two blocks")
    new.add_argument("file", type=Path, metavar="FILE.py",
                     help="the file to write; an existing file is never replaced")
    check = actions.add_parser("check", help="say what is wrong or implausible, and show what the machine does")
    check.add_argument("file", type=Path, metavar="FILE.py",
                       help="the file that declares the machine, or the name of a shipped one; it is run")
    check.add_argument("--picture", type=Path, nargs="?", const=Path(), metavar="FILE.svg",
                       help="draw commands and signals of its experiments, as .svg or .png (default: beside the file, "
                            "as .svg)")


def run(arguments: argparse.Namespace) -> int:
    """Run the action."""
    if arguments.action == "new":
        if arguments.file.suffix != ".py":
            raise InvalidValue(f"'{arguments.file}' is not the name of a Python file", "End it in .py")
        write_template(arguments.file, file_of(TEMPLATE, ".py", "machines").read_bytes())
        print(f"Wrote {arguments.file}\nReplace what is in it by your machine, then: "
              + command_line("machine", "check", arguments.file))
        return 0
    return _check(arguments.file, arguments.picture)


def _check(path: Path, out: Path | None) -> int:
    out = picture_file(out, Path(path.name))
    with say_compilation():
        inspection = inspect_machine(Machine.open(path))
    print(report(inspection))
    if out is not None:
        write_picture(out, draw_machine(inspection.machine, inspection.runs))
        print(f"Wrote {out}")
    print("See what a study would say of simulated runs: "
          + command_line("simulate", "--machine", path, "--runs", "54", "--out", "runs.h5"))
    return 0


def report(inspection: MachineInspection) -> str:
    """The inspection as plain text."""
    machine, runs = inspection.machine, inspection.runs
    lines = [f"{machine.name}: {len(machine.blocks)} blocks, {len(machine.parameters)} parameters, "
             f"{inspection.candidates} laws that a study compares"]
    lines += [f"  {block.name}: {', '.join(block.reads) or 'nothing'} -> {', '.join(block.signals)}"
              for block in machine.blocks]
    lines.append(f"{len(runs)} experiments of {machine.duration:g} s with {len(runs.time)} samples")
    lines += [f"  {name}: {signal.min():.4g} to {signal.max():.4g} {raised(runs.units.get(name, ''))}".rstrip()
              for name, signal in runs.signals.items()]
    for output in machine.outputs:
        known = inspection.outputs[output.name][np.isfinite(inspection.outputs[output.name])]
        span = f"{known.min():.4g} to {known.max():.4g} {raised(output.unit)}" if len(known) else "in no experiment"
        lines.append(f"  {output.name}: {span}")
    return "\n".join([*lines, *list_findings(inspection.findings)])
