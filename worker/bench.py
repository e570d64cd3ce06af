"""`bench`: write a template of a bench file, or check a bench file and show what the bench does."""

import argparse
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Literal

from slipstick.bench import Bench
from slipstick.clutch.ensemble import STATUS
from slipstick.errors import InvalidValue
from slipstick.interface.files import write
from slipstick.pictures.rendering import render
from slipstick.pictures.theme import Spec
from slipstick.plausibility import Finding, Inspection, inspect
from slipstick.plausibility.picture import picture

from .bench_option import bench_file
from .program import command_line

_FORMS: dict[str, Literal["svg", "png"]] = {".svg": "svg", ".png": "png"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the actions and their options."""
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    new = actions.add_parser("new", help="write a commented template")
    new.add_argument("file", type=Path, metavar="FILE",
                     help="the bench file to write; an existing file is never replaced")
    check = actions.add_parser("check", help="say what is wrong or implausible, and show what the bench does")
    check.add_argument("file", type=bench_file, metavar="FILE", help="the bench file to check")
    check.add_argument("--picture", type=Path, nargs="?", const=Path(), metavar="FILE.svg",
                       help="draw the engagement with the median shifting time, as .svg or .png (default: beside the "
                            "bench file, as .svg)")


def run(arguments: argparse.Namespace) -> int:
    """Run the action; status 1 also if nothing locks."""
    if arguments.action == "check":
        return _check(arguments.file, arguments.picture)
    path = arguments.file
    write_template(path, (files("slipstick.bench") / "template.toml").read_bytes())
    print(f"Wrote {path}\nReplace its values by those of your bench, then: {command_line('bench', 'check', path)}")
    return 0


def write_template(path: Path, content: bytes) -> None:
    """Write a template; raises `InvalidValue` where there is a file of this name."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("xb") as file:
            file.write(content)
    except FileExistsError:
        raise InvalidValue(f"'{path}' already exists", "Choose another name, or remove the file") from None


def picture_file(out: Path | None, beside: Path) -> Path | None:
    """The picture to write, if any: by default an SVG of the name of another file; raises `InvalidValue`."""
    if out is None:
        return None
    out = beside.with_suffix(".svg") if out == Path() else out
    if out.suffix not in _FORMS:
        raise InvalidValue(f"'{out}' is neither .svg nor .png", "Give a file name that ends with .svg or .png")
    return out


def write_picture(out: Path, spec: Spec) -> None:
    """Write a picture in the form that its suffix names."""
    write(out, render(spec, _FORMS[out.suffix]))


def _check(path: Path, out: Path | None) -> int:
    out = picture_file(out, path)
    inspection = inspect(Bench.open(path))
    print(report(inspection))
    if out is not None:
        condition = inspection.behaviour.nearest_to(0.5)
        write_picture(out, picture(inspection.bench, condition))
        print(f"Wrote {out}: condition {condition}")
    return 0 if inspection.behaviour.locked.any() else 1


def report(inspection: Inspection) -> str:
    """The inspection as plain text."""
    bench, behaviour = inspection.bench, inspection.behaviour
    counts = ", ".join(f"{int((behaviour.status == code).sum())} {name}" for code, name in STATUS.items())
    lines = [f"{bench.name}: {bench.title}", f"{len(bench.conditions)} conditions: {counts}"]
    if behaviour.locked.any():
        marks = {name: behaviour.nearest_to(quantile) for name, quantile in (("earliest", 0.0), ("median", 0.5),
                                                                              ("latest", 1.0))}
        lines.append("Shifting time: " + ", ".join(
            f"{name} {1e3 * behaviour.shifting_time[row]:.1f} ms (condition {row})" for name, row in marks.items()))
    else:
        lines.append("No engagement locks: the bench cannot be used")
    return "\n".join([*lines, *list_findings(inspection.findings)])


def list_findings(findings: Sequence[Finding]) -> list[str]:
    """What is implausible, as lines."""
    if not findings:
        return ["Nothing implausible was found."]
    lines = [f"Implausible: {len(findings)}"]
    for number, finding in enumerate(findings, 1):
        lines += [f"{number}. {finding.key}: {finding.what}.", f"   Why it matters: {finding.why}.",
                  f"   What to do: {finding.remedy}."]
    return lines
