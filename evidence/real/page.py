"""The tables of the page of real recordings, from the committed table."""

import csv

from evidence.real.command import TABLE

_COUNTED = {"candidates", "runs", "runs set aside", "blocks with more than noise left"}
_NAMED = "named: "


def read_rows(machine: str) -> list[dict[str, str]]:
    """Return the rows of a machine."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        return [row for row in csv.DictReader(file) if row["machine"] == machine]


def render_findings(machine: str) -> str:
    """Return what is named in each variant, with nats."""
    rows = read_rows(machine)
    lines = list[list[str]]()
    for variant in dict.fromkeys(row["variant"] for row in rows):
        own = {row["what"]: row["value"] for row in rows if row["variant"] == variant}
        named = "; ".join(f"{what.removeprefix(_NAMED)} ({float(value):.0f})" for what, value in own.items()
                          if what.startswith(_NAMED))
        lines.append([variant, own["runs"], own["runs set aside"], own["candidates"], named or "nothing",
                      "yes" if int(own["blocks with more than noise left"]) else "no"])
    return _join(["variant", "runs", "set aside", "candidates", "named (nats)", "more than noise left"], lines)


def render_values(machine: str) -> str:
    """Return the values beside what is known, of each variant in a column, or in a row if there are more variants."""
    rows = [row for row in read_rows(machine) if row["what"] not in _COUNTED and not row["what"].startswith(_NAMED)]
    cells = {(row["variant"], row["what"]): _write(row) for row in rows}
    variants, whats = (tuple(dict.fromkeys(row[key] for row in rows)) for key in ("variant", "what"))
    units = {row["what"]: ", ".join(filter(None, (row["what"], row["unit"]))) for row in rows}
    if len(variants) > len(whats):
        whats = tuple(sorted(whats))
        return _join(["variant", *(units[what] for what in whats)],
                     [[variant, *(cells.get((variant, what), "") for what in whats)] for variant in variants])
    return _join(["", *variants],
                 [[units[what], *(cells.get((variant, what), "") for variant in variants)] for what in whats])


def _write(row: dict[str, str]) -> str:
    error, known = row["standard error"], row["published"]
    return row["value"] + (f" ± {error}" if error else "") + (f" ({known})" if known else "")


def _join(head: list[str], rows: list[list[str]]) -> str:
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *rows))
