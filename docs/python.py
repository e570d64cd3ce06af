"""Write the page of the Python functions, docs/python.md, from their docstrings: `python docs/python.py`."""

import inspect
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import slipstick
from slipstick.interface.finding import Law
from slipstick.interface.machine_study import FindingOfMachine
from slipstick.interface.picture import Picture
from slipstick.interface.result import Result
from slipstick.interface.results import KINDS
from slipstick.interface.study import Finding

_HEAD = """# Python

The names below are the public interface of the package. The functions are those that the command and the service call.
No function changes what it was given. Long ones show a bar in a terminal or a notebook; Ctrl-C leaves no half-written
file.

```python
import slipstick

bench = slipstick.Bench.open("heavy")             # shipped with the package; or the path of a bench file
runs = slipstick.Recordings.open("sample")        # 54 shipped engagements; or the path of a file
study = slipstick.study(bench, runs)
study.findings[0].law.plot()                      # shown in a notebook
study.report("study.html")

table = slipstick.build(bench, {"pressure_bias": (0.5, 1.5, 50), "initial_position": (0.5, 1.5, 50)},
                        model=study.extended, conditions=runs)
slipstick.propagate(table, mean=[1, 1], std=[0.05, 0.08]).plot().save("times.svg")
slipstick.fit(table, runs, ["initial_position"]).summary()
```

Units are those of [nomenclature.md](nomenclature.md); inputs of tables are multiples of nominal values. Values that do
not fit raise `slipstick.errors.SlipstickError`, with cause and remedy; `help(slipstick.fit)` also lists what a function
raises, and the section of the paper. Pictures are Vega-Lite specifications: notebooks show them, and saving them as
SVG, PNG or HTML, or a report, needs the extra `reports`. [quickstart.ipynb](quickstart.ipynb) is a notebook that goes
from recordings to a decision.

This page is written by `python docs/python.py` from the docstrings.
"""
_SECTION = re.compile(r"^(Parameters|Returns|Raises|References)\n-+\n", re.MULTILINE)
_RAISES = re.compile(r"(?:(?<=\.)\s+R|(;) r)aises (?:[^.]|\.(?=\S))*\.")  # help() and the message say it
_MODULES = re.compile(r"\b(?:[a-z_]+\.)+(?=[A-Z])")


def page() -> str:
    """The page."""
    functions = [name for name in slipstick.__all__ if not inspect.isclass(getattr(slipstick, name))]
    classes = [name for name in slipstick.__all__ if name not in functions]
    texts = {name: _text(getattr(slipstick, name)) for name in functions}
    counts = Counter(line for text in texts.values() for line in text.splitlines() if line.startswith("- `"))
    common = {line: line.split("`")[1] for line, count in counts.items() if count > 1}
    members = dict[str, str]()
    return "\n".join([
        _HEAD, "## Functions\n", "Several functions have these arguments:\n", *common, "",
        *(_function(name, texts[name], common) for name in functions),
        "## What functions take\n", *(_class(getattr(slipstick, name), ("open", "save", "take")) for name in classes),
        "## What they return\n", _class(Result),
        *(_class(kind, without=Result, before=members) for kind in KINDS.values()),
        "## Parts of results\n",
        *(_class(part, before=members) for part in (Finding, FindingOfMachine, Law, Picture))])


def _function(name: str, text: str, common: Mapping[str, str]) -> str:
    """The function, whose arguments that several functions have are named only."""
    lines = text.splitlines()
    if shared := [line for line in lines if line in common]:
        named = "- " + ", ".join(f"`{common[line]}`" for line in shared) + ": above"
        lines = [named if line == shared[0] else line for line in lines if line == shared[0] or line not in common]
    text = "\n".join(lines)
    return f"### `{name}`\n\n```python\nslipstick.{_call(name, getattr(slipstick, name))}\n```\n\n{text}\n"


def _class(described: type, only: tuple[str, ...] = (), without: type = object,
           before: dict[str, str] | None = None) -> str:
    """The class with its public members: `only` some, or those that the class `without` does not have.

    Members that a class `before` describes in the same words are named only.
    """
    before = {} if before is None else before
    lines, same = [f"### `{described.__name__}`\n\n{_text(described)}\n"], dict[str, list[str]]()
    for name, member in _members(described):
        if (only and name not in only) or name in vars(without):
            continue
        property_like = isinstance(member, property | cached_property)
        line = f"- `{name if property_like else _call(name, member)}`: {_sentence(member)}"
        other = before.setdefault(line, described.__name__)
        if other == described.__name__:
            lines.append(line)
        else:
            same.setdefault(other, []).append(f"`{name}`")
    lines.extend(f"- {', '.join(names)}: as in `{other}`" for other, names in same.items())
    return "\n".join(lines) + "\n"


def _members(described: type) -> Iterator[tuple[str, Any]]:
    """Public properties and methods, those of the class itself before inherited ones."""
    seen = set[str]()
    for base in described.__mro__[:-1]:
        for name, member in vars(base).items():
            if name.startswith("_") or name in seen or not (
                    callable(member) or isinstance(member, property | cached_property | classmethod)):
                continue
            seen.add(name)
            yield name, member if isinstance(member, property | cached_property) else getattr(described, name)


def _call(name: str, function: Any) -> str:
    """The function with its arguments, as it is called."""
    signature = inspect.signature(function)
    given = [parameter.replace(annotation=inspect.Parameter.empty) for parameter in signature.parameters.values()
             if parameter.name != "self"]
    returned = signature.return_annotation
    text = "" if returned is inspect.Signature.empty else f" -> {_type(returned)}"
    arguments = inspect.Signature(given)
    return f"{name}{arguments}{text}"


def _type(annotation: Any) -> str:
    text = annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)
    return _MODULES.sub("", text).replace("~", "")


def _sentence(member: Any) -> str:
    """The docstring in one paragraph."""
    return " ".join(_doc(member.func if isinstance(member, cached_property) else member).split())


def _doc(described: Any) -> str:
    """The docstring without the sentences that say what is raised."""
    return _RAISES.sub(lambda match: "." if match[1] else "", inspect.getdoc(described) or "")


def _text(described: Any) -> str:
    """A docstring as Markdown: its sections as paragraphs, and their entries as lists."""
    first, *sections = _SECTION.split(_doc(described))
    parts = [first.strip()]
    for title, body in zip(sections[::2], sections[1::2], strict=True):
        if title == "Parameters":
            parts.append(_entries(body))
        elif title == "Returns" and body.strip().count("\n"):  # else the signature says it
            parts.append(_entries(body).replace("- ", "Returns ", 1))
    return "\n\n".join(parts)


def _entries(body: str) -> str:
    """The entries of a section: lines without indentation, each followed by its description."""
    entries = list[list[str]]()
    for line in body.strip().splitlines():
        if line and not line.startswith(" "):
            name, _, kind = line.partition(" : ")
            kind = kind.removesuffix(", optional")  # the signature has its default
            entries.append([f"- `{name}`" + (f" ({kind})" if kind else ""), ""])
        elif entries:
            entries[-1][1] = f"{entries[-1][1]} {line.strip()}".strip()
    return "\n".join(f"{head}: {text}" if text else head for head, text in entries)


if __name__ == "__main__":
    Path(__file__).with_suffix(".md").write_text(page())
