"""What the readers of measurement files make of drawn valid files, and of damaged ones.

    python -m evidence.robustness.reader_fuzz               # replaces the rows of the table, two minutes
    python -m evidence.robustness.reader_fuzz csv 400 2     # one format, files and seed: prints what went wrong

A seed draws channels with known names, units, values and times, and the form of the file that holds them: forms that
docs/your_files.md promises to read or to refuse, written by somebody who had not read the readers. Text is written by
hand, the other formats by scipy, h5py, asammdf and pyarrow. Damages cut files off, and replace, insert and delete
bytes; in text they also change cells and rows. Each file is read in a child process with limits. Its outcome is that of
its worst channel: a file is *wrong* if a channel has another value, unit, time or number of samples than the file
states, and neither a remark nor a note says so.
"""

import io
import multiprocessing
import os
import re
import resource
import signal
import struct
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from dataclasses import replace as change
from datetime import UTC, datetime, timedelta, timezone
from decimal import Decimal
from pathlib import Path
from typing import Any

import asammdf
import h5py
import numpy as np
import pyarrow as pa
import scipy.io
from pyarrow import parquet
from scipy.sparse import csc_array

from evidence.robustness.table import Row, replace_rows
from slipstick.acquisition import open_source
from slipstick.errors import BadRecording

VALID, DAMAGED, SEED, SECONDS, MEMORY, LONGEST = 100, 250, 1, 10, 2 << 30, 600
OUTCOMES = CRASHED, WRONG, UNDETECTABLE, SAID, REFUSED, RIGHT = (
    "crashed or timed out", "wrong without a word", "undetectable", "said", "refused", "right")
"""From the worst to the best. Undetectable are changed numbers at a damaged place that no checksum covers."""
READ, MAYBE, NEVER, ANY = "read", "read or refused", "refused", "anything"
OTHER, NAMES = -1, -2
_FOOTER = "End of file"
_NAMES = ("p_clutch", "n turbine", "M.output", "Öldruck", "i_valve", "T-oil", "n_motor", "x1", "speed in", "Weg", "q")
_UNITS = ("bar", "rpm", "Nm", "°C", "A", "kPa", "mm", "N m")
_KINDS = {"fast": 12, "slow": 2, "short": 2, "held": 1, "gaps": 2, "late": 2, "odd": 0.4, "date": 2, "text": 1,
          "thousands": 0.4}
"""Kinds of columns with their weights: `odd` and `late` have cells that are no numbers, within and at the start."""
_JUNK = ("ERR", "#", "1.000", "1,000", "--", "NaN", "1e", "١٢", '"', '"7"', "1 2", "0x1F", "1_0", "1.2.3", "12:00", "-",
         "1d3", "true", "=1+1", "1/2", "1e999", "−1")

Rng = np.random.Generator


@dataclass(frozen=True)
class Truth:
    """A channel with the `names` by which it may be asked for, and what is `due`; a unit of None is not compared.

    Values are `relative` if they count from the first. Damage has touched the samples `hit`.
    """

    names: tuple[str, ...]
    unit: str | None = None
    values: np.ndarray = field(default_factory=lambda: np.zeros(0))
    due: str = READ
    time: np.ndarray | None = None
    relative: bool = False
    hit: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Line:
    """The cells of a row, and its number among the samples, or NAMES or OTHER."""

    cells: tuple[str, ...]
    sample: int = OTHER


@dataclass(frozen=True)
class Text:
    """A text of lines; cells are quoted already."""

    lines: tuple[Line, ...]
    separator: str
    decimal: str
    end: str
    codec: str
    bom: bytes = b""

    def pieces(self) -> Iterator[tuple[bytes, int, int]]:
        """Each cell with the separator or line end after it: bytes, sample and column."""
        for line in self.lines:
            last = max(len(line.cells), 1) - 1
            for column, cell in enumerate(line.cells or ("",)):
                yield (cell + (self.end if column == last else self.separator)).encode(self.codec), line.sample, column

    def write(self) -> bytes:
        """The bytes of the file."""
        return self.bom + b"".join(piece for piece, _, _ in self.pieces())

    def find(self, sample: int) -> int:
        """The line of a sample, or of the names."""
        return next(index for index, line in enumerate(self.lines) if line.sample == sample)


@dataclass(frozen=True)
class Case:
    """A file; of a text, the first channels are those of the columns. At most `changed` bytes are damaged.

    Checksums of a `sealed` file cover its numbers.
    """

    name: str
    content: bytes
    channels: tuple[Truth, ...]
    form: str
    text: Text | None = None
    sealed: bool = False
    damage: str = ""
    changed: int = 0


@dataclass(frozen=True)
class Verdict:
    """An outcome with its reason."""

    outcome: str
    reason: str = ""


def draw(rng: Rng, entries: Sequence[Any], weights: Sequence[float] | None = None) -> Any:
    """One of the entries."""
    shares = np.ones(len(entries)) if weights is None else np.array(weights, float)
    return entries[int(rng.choice(len(entries), p=shares / shares.sum()))]


def draw_signal(rng: Rng, count: int) -> np.ndarray:
    """Noise, a ramp, a step, a marker, a counter or a wave, of some amplitude."""
    phase, noise, amplitude = np.linspace(0, 1, count), rng.normal(size=count), 10.0 ** rng.integers(-2, 4)
    return draw(rng, (amplitude * noise, amplitude * (phase + 0.01 * noise), amplitude * ((phase > 0.3) + 0.01 * noise),
                      1.0 * (phase > 0.4), np.arange(count) + 7.0, amplitude * np.sin(20 * phase + noise / 50)))


def draw_times(rng: Rng, count: int) -> np.ndarray:
    """Equal steps or jitter, from 0 or later."""
    times = np.arange(count) + (rng.uniform(-0.2, 0.2, count) if rng.random() < 0.5 else 0) + draw(rng, (0, 0.5, 1000))
    return np.round(times * 10.0 ** rng.integers(-4, 0), 7)


def draw_type(rng: Rng, values: np.ndarray, types: str) -> np.ndarray:
    """The values in one of the types, most often the first, rounded to its range."""
    kind = np.dtype(draw(rng, types.split(), [6, *[1] * types.count(" ")]))
    if kind.kind in "iu":
        values = np.clip(np.round(values), np.iinfo(kind).min, min(np.iinfo(kind).max, 2**31))
    return values > np.median(values) if kind.kind == "b" else values.astype(kind)


# Text


def _write_numbers(rng: Rng, values: np.ndarray) -> tuple[list[str], np.ndarray]:
    """Cells of one form, empty where values are missing, and the numbers that they state."""
    form = draw(rng, ("{:.6g}", "{:.3f}", "{:.0f}", "{:.4E}", "{:+.2f}", "{:.10f}", "short"))
    if form == "short":  # such as .5 and 5.
        cells = [re.sub(r"^(-?)0\.(?=[1-9])|(?<=\.)0$", lambda match: f"{match[1]}." if match[1] is not None else "",
                        f"{value:.1f}") for value in values]
    else:
        cells = [form.format(value) for value in values]
    cells = ["" if np.isnan(value) else cell for cell, value in zip(cells, values, strict=True)]
    return cells, np.array([float(cell or "nan") for cell in cells])


def _write_dates(rng: Rng, count: int, sign: str) -> tuple[list[str], np.ndarray, str]:
    """Cells of dates or times of day, their seconds, and what is due."""
    step = draw(rng, (1, 0.25, 0.001, 3600))
    start = draw(rng, (datetime(2024, 2, 28, 23, 59, 58), datetime(2023, 12, 5, 8, 0), datetime(2024, 3, 31, 0, 30)))
    instants = [start + timedelta(seconds=step * sample) for sample in range(count)]
    form = draw(rng, ("%Y-%m-%d %H:%M:%S", "%Y-%m-%dT%H:%M:%S", "%d.%m.%Y %H:%M:%S", "%H:%M:%S", "%m/%d/%Y %H:%M:%S",
                      "zone"), (2, 2, 2, 2, 1, 1))
    tails = [f"{sign}{instant.microsecond // 1000:03d}" if step < 1 else "" for instant in instants]
    cells = [instant.strftime(form) + tail for instant, tail in zip(instants, tails, strict=True)]
    if form == "zone":  # summer time begins after the third row
        zones = [timezone(timedelta(hours=1 + (sample > 2))) for sample in range(count)]
        cells = [f"{instant.replace(tzinfo=UTC).astimezone(zone):%Y-%m-%dT%H:%M:%S}{tail}{str(zone)[3:]}"
                 for instant, tail, zone in zip(instants, tails, zones, strict=True)]
    late = form == "zone" or (form == "%H:%M:%S" and instants[-1].date() > start.date())
    return cells, step * np.arange(count, dtype=float), NEVER if form.startswith("%m") else MAYBE if late else READ


def _draw_column(rng: Rng, count: int, decimal: str, kind: str) -> tuple[list[str], Truth]:
    """The cells and the truth, which has no names yet, of a column of one kind."""
    values, due = draw_signal(rng, count), READ
    if kind == "slow":
        values[np.arange(count) % int(rng.integers(2, 6)) != rng.integers(2)] = np.nan
    elif kind == "short":
        values[int(rng.integers(1, count)):] = np.nan
    elif kind == "gaps":
        values[rng.random(count) < 0.1] = np.nan
    elif kind == "held":
        values = np.repeat(values, 4)[:count]
    if kind == "date":
        cells, values, due = _write_dates(rng, count, draw(rng, (".", decimal)))
        return cells, Truth((), "s", values, due, relative=True)
    if kind == "text":
        return [draw(rng, ("ok", "fault", "R 2", "")) for _ in values], Truth((), None, values, NEVER)
    if kind == "thousands":
        cells = [f"{10_000 + abs(value):,.2f}" for value in values]
        return [cell.translate(str.maketrans(f".,{decimal}", f"{decimal},.")) for cell in cells], Truth(
            (), None, values, NEVER)
    cells, values = _write_numbers(rng, draw_times(rng, count) if kind == "time" else values)
    first, last = {"odd": (count // 2, count // 2 + 1), "late": (0, 3)}.get(kind, (0, 0))
    cells = [cell.replace(".", decimal) for cell in cells]
    if first < last:
        cells[first:last] = [draw(rng, ("1.#QNAN", "NaN", "-"))] * (last - first)
        values[first:last], due = np.nan, MAYBE
    return cells, Truth((), None, values, due)


def _draw_heads(rng: Rng, dated: Sequence[bool], style: str) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """The heading of each column, its unit, and the names by which it may be asked for."""
    count = len(dated)
    heads = ["t", *(str(name) for name in rng.permutation(_NAMES)[:count - 1])]
    units = ["s", *(draw(rng, ("", *_UNITS)) for _ in heads[1:])] if style != "none" else [""] * count
    kind = draw(rng, ("", "equal", "words", "numbers", "units"), (6, 1, 1, 1, 1)) if count > 3 else ""
    if kind and (kind != "units" or style == "brackets"):
        place = int(rng.integers(1, count - 1))
        pairs = {"words": ["M (raw)", "M (filtered)"], "numbers": ["M[0]", "M[1]"]}
        heads[place:place + 2] = pairs.get(kind, ["M", "M"])
        units[place:place + 2] = ["Nm", "bar"] if kind == "units" else ["", ""]
    units = ["" if date else unit for unit, date in zip(units, dated, strict=True)]
    for column, (head, unit) in enumerate(zip(heads, units, strict=True)):
        full = f"{head} {draw(rng, ('[{}]', '({})')).format(unit)}" if unit and style == "brackets" else head
        yield full, unit, ((f"M@{column + 1}",) if head == "M" and kind == "equal" else
                           (full,) if head == "M" else tuple({head, full}))


def draw_csv(rng: Rng) -> Case:
    """A text of columns."""
    separator, decimal = draw(rng, ((";", ","), (";", "."), ("\t", "."), ("\t", ","), (",", "."), (",", ",")))
    count, width = 1500 if rng.random() < 0.03 else int(rng.integers(4, 40)), int(rng.integers(2, 8))
    style = draw(rng, ("brackets", "row below", "row above", "none"))
    kinds = ["time", "fast", *(draw(rng, list(_KINDS), list(_KINDS.values())) for _ in range(width - 2))]
    columns = [_draw_column(rng, count, decimal, kind) for kind in kinds]
    if rng.random() < 0.05 and {"date", "text", "late", "thousands"}.isdisjoint(kinds):  # looks like column numbers
        for number, (cells, truth) in enumerate(columns, start=1):
            cells[0], truth.values[0] = str(number), number
    heads = list(_draw_heads(rng, [kind == "date" for kind in kinds], style))
    channels = [change(truth, names=names, unit=truth.unit or unit)
                for (_, unit, names), (_, truth) in zip(heads, columns, strict=True)]
    headings, units = tuple(head for head, _, _ in heads), tuple(unit for _, unit, _ in heads)
    if len(set(headings)) < width:
        channels.append(Truth(("M",), due=NEVER))
    quoted, trailing = separator == decimal or rng.random() < 0.15, draw(rng, ("", "all", "rows"), (8, 1, 1))

    def finish(cells: Sequence[str], sample: int, end: bool) -> Line:
        return Line((*(f'"{cell}"' if quoted or separator in cell else cell for cell in cells), *[""] * end), sample)

    above = draw(rng, ([], [["Logger 7"]], [["Operator", "Smith"], ["Rate", "1000"], []],
                       [["# Bench 3"], ["Date", "2024-05-01"], ["Version", "2.1"]], [[]]), (4, 1, 1, 1, 1))
    above = ([[f"sep={separator}"]] if separator != "\t" and rng.random() < 0.1 else []) + above
    names = [finish(headings, NAMES, trailing == "all")]
    if style.startswith("row"):
        names.insert(style == "row below", finish(units, OTHER, trailing == "all"))
        if rng.random() < 0.15:
            names.append(finish(["double"] * width, OTHER, trailing == "all"))
    rows = [finish(cells, sample, trailing != "") for sample, cells in
            enumerate(zip(*(cells for cells, _ in columns), strict=True))]
    for _ in range(draw(rng, (0, 2), (4, 1))):
        rows.insert(int(rng.integers(len(rows) + 1)), Line(()))
    below = draw(rng, ([], [[_FOOTER]], [[]], [[], [_FOOTER, "ok"]]), (5, 1, 1, 1))
    codec = draw(rng, ("utf-8", "cp1252", "utf-16-le", "utf-16-be"), (5, 2, 1, 1))
    bom = {"utf-8": b"\xef\xbb\xbf", "utf-16-le": b"\xff\xfe", "utf-16-be": b"\xfe\xff"}.get(codec, b"")
    lines = (*(Line(tuple(cells)) for cells in above), *names, *rows, *(Line(tuple(cells)) for cells in below))
    text = Text(lines, separator, decimal, draw(rng, ("\n", "\r\n", "\r"), (5, 5, 1)), codec,
                bom if rng.random() < 0.5 else b"")
    form = (f"{separator!r} {decimal} units {style} {codec} {text.bom!r} trailing {trailing!r} quoted {quoted} "
            f"{' '.join(kinds)}")
    return Case("drawn.csv", text.write(), tuple(channels), form, text)


def draw_lvm(rng: Rng) -> Case:
    """A file of LabVIEW: two headers, a column of X for all channels, for each or for none, and a comment."""
    decimal, x_columns = draw(rng, (".", ",")), draw(rng, ("One", "Multi", "No"), (4, 4, 1))
    width, count, columns, heads, channels = int(rng.integers(1, 5)), int(rng.integers(4, 40)), [], [], []
    for number, name in enumerate(rng.permutation(_NAMES)[:width]):
        for head in (("X_Value",) if number == 0 or x_columns == "Multi" else ()) + (str(name),):
            values = draw_times(rng, count) if head == "X_Value" else draw_signal(rng, count)
            cells = ["" if head == "X_Value" and x_columns == "No" else f"{value:.6f}" for value in values]
            heads.append(head)
            columns.append([cell.replace(".", decimal) for cell in cells])
            full = f"{head}@{len(heads)}" if head == "X_Value" and x_columns == "Multi" and width > 1 else head
            channels.append(Truth((full,), None, np.array([float(cell or "nan") for cell in cells]),
                                  READ if cells[0] else MAYBE))
    columns.append([draw(rng, ("", "stopped"), (30, 1)) for _ in range(count)])
    comment = Truth(("Comment",), None, np.full(count, np.nan), NEVER if any(columns[-1]) else MAYBE)
    stamp = f"10:11:12{decimal}123456"
    head = ["LabVIEW Measurement|", "Writer_Version|2", "Separator|Tab", f"Decimal_Separator|{decimal}",
            "Multi_Headings|No", f"X_Columns|{x_columns}", "Time_Pref|Relative", "Date|2024/05/01", f"Time|{stamp}",
            "***End_of_Header***|", "|" * (len(heads))]
    gap = "||" if x_columns == "Multi" else "|"
    head += [f"{key}|{gap.join(cells)}|" + "|" * (x_columns == "Multi") for key, cells in (
        ("Channels", [str(width)] + [""] * (width - 1)), ("Samples", [str(count)] * width),
        ("Date", ["2024/05/01"] * width), ("Time", [stamp] * width),
        ("Y_Unit_Label", [draw(rng, ("Volts", "bar", "")) for _ in range(width)]), ("X_Dimension", ["Time"] * width),
        ("X0", [f"0{decimal}0000000E+0"] * width), ("Delta_X", [f"0{decimal}001000"] * width),
        ("***End_of_Header***", [""] * width))]
    lines = (*(Line(tuple(line.split("|"))) for line in head), Line((*heads, "Comment"), NAMES),
             *(Line(cells, sample) for sample, cells in enumerate(zip(*columns, strict=True))))
    text = Text(lines, "\t", decimal, draw(rng, ("\r\n", "\n")), draw(rng, ("utf-8", "cp1252")))
    return Case("drawn.lvm", text.write(), (*channels, comment), f"{decimal} X_Columns {x_columns}", text)


# MATLAB: an array, a sparse array, a text, a dict (structure), a list of dicts (structures), or a tuple (cell array)


def _draw_array(rng: Rng) -> Any:
    count, kind = int(rng.integers(3, 60)), draw(rng, ("vector", "matrix", "odd"), (6, 3, 1))
    if kind == "odd":
        return draw(rng, ("text", np.zeros((0, 0)), np.zeros((2, 3, 4)), draw_signal(rng, count)[:, None] * 1j,
                          csc_array(np.diag(draw_signal(rng, 3)))))
    values = np.column_stack([draw_signal(rng, count) for _ in range(1 if kind == "vector" else rng.integers(2, 5))])
    return draw_type(rng, values if kind == "matrix" or rng.random() < 0.5 else values.T, "f8 f4 i2 i4 u1 i1 u2 i8 ?")


def _draw_variables(rng: Rng) -> dict[str, Any]:
    variables: dict[str, Any] = {}
    for name in rng.permutation(["t", "p_clutch", "data", "n1", "Signals", "X"])[:int(rng.integers(2, 6))]:
        fields = draw(rng, (("values",), ("time", "y"), ("a", "b", "c")))
        structs = [{field: _draw_array(rng) for field in fields} for _ in range(int(rng.integers(2, 4)))]
        cells = tuple(_draw_array(rng) for _ in range(int(rng.integers(2, 5))))
        deep = structs[0] | {"inner": {"z": _draw_array(rng)}, "list": cells}
        variables[str(name)] = draw(rng, (_draw_array(rng), structs[0], deep, structs, cells), (6, 1, 1, 1, 1))
    return variables


def _list_truths(name: str, node: Any) -> Iterator[Truth]:
    if isinstance(node, dict | list | tuple):
        parts = ([(f"{name}.{field}", part) for field, part in node.items()] if isinstance(node, dict) else
                 [(f"{name}({number})" if isinstance(node, list) else f"{name}{{{number}}}", part)
                  for number, part in enumerate(node, start=1)])
        for full, part in parts:
            yield from _list_truths(full, part)
    elif isinstance(node, csc_array):
        yield from (change(truth, due=MAYBE) for truth in _list_truths(name, node.toarray()))
        yield Truth((f"{name}.data",), due=NEVER)
    elif isinstance(node, str) or node.ndim != 2 or node.size == 0 or np.iscomplexobj(node):
        yield Truth((name,), due=NEVER)
    elif min(node.shape) == 1:
        yield Truth((name,), "", node.ravel().astype(float))
    else:
        yield from (Truth((f"{name}(:,{column})",), "", values)
                    for column, values in enumerate(node.T.astype(float), start=1))


def _make_scipy(node: Any) -> Any:
    if isinstance(node, dict):
        return {field: _make_scipy(part) for field, part in node.items()}
    if not isinstance(node, list | tuple):
        return node
    array = np.empty((1, len(node)), [(field, object) for field in node[0]] if isinstance(node, list) else object)
    for index, part in enumerate(node):
        array[0, index] = tuple(map(_make_scipy, part.values())) if isinstance(node, list) else _make_scipy(part)
    return array


def draw_matlab_5(rng: Rng) -> Case:
    """A file of MATLAB 5 to 7, or of MATLAB 4 if it has but simple arrays."""
    variables, memory = _draw_variables(rng), io.BytesIO()
    plain = all(isinstance(node, np.ndarray) and node.ndim == 2 and node.dtype in ("f8", "f4", "i2", "u2", "u1", "i4")
                and node.size for node in variables.values())
    version, packed = draw(rng, ("4", "5") if plain else ("5",)), bool(rng.random() < 0.5)
    scipy.io.savemat(memory, {name: _make_scipy(node) for name, node in variables.items()}, format=version,
                     do_compression=packed and version == "5")
    channels = tuple(truth for name, node in variables.items() for truth in _list_truths(name, node))
    content = memory.getvalue()
    if version == "5":  # its header has the time
        content = b"MATLAB 5.0 MAT-file".ljust(116) + content[116:]
    return Case("drawn.mat", content, channels, f"version {version} compressed {packed}",
                sealed=packed and version == "5")


def _write_hdf5(file: h5py.File, parent: h5py.Group, name: str, node: Any, options: dict[str, Any]) -> None:
    def refer(parts: Sequence[Any]) -> np.ndarray:
        references = np.empty((len(parts), 1), h5py.ref_dtype)
        for index, part in enumerate(parts):
            _write_hdf5(file, file["#refs#"], own := f"r{len(file['#refs#'])}", part, options)
            references[index, 0] = file["#refs#"][own].ref
        return references

    kinds = {"f8": "double", "f4": "single", "i1": "int8", "i2": "int16", "i4": "int32", "i8": "int64", "u1": "uint8",
             "u2": "uint16", "b1": "logical", "c16": "double"}
    attributes: dict[str, Any] = {}
    if isinstance(node, dict | list | csc_array):
        item, kind = parent.create_group(name), "double" if isinstance(node, csc_array) else "struct"
        if isinstance(node, dict):
            for field, part in node.items():
                _write_hdf5(file, item, field, part, options)
        elif isinstance(node, list):
            for field in node[0]:
                item.create_dataset(field, data=refer([part[field] for part in node]), dtype=h5py.ref_dtype)
        else:
            attributes = {"MATLAB_sparse": np.uint64(node.shape[0])}
            item["data"], item["ir"], item["jc"] = node.data, node.indices.astype("u8"), node.indptr.astype("u8")
    elif isinstance(node, tuple):
        item, kind = parent.create_dataset(name, data=refer(node), dtype=h5py.ref_dtype), "cell"
    elif isinstance(node, str):
        item, kind = parent.create_dataset(name, data=np.array([[ord(letter)] for letter in node], "u2")), "char"
        attributes = {"MATLAB_int_decode": np.int32(2)}
    elif node.size == 0:
        item, kind, attributes = parent.create_dataset(name, data=np.array(node.shape, "u8")), "double", {
            "MATLAB_empty": np.uint8(1)}
    else:
        values, kind = node.T, kinds[node.dtype.str[1:]]
        if kind == "logical":
            values, attributes = values.astype("u1"), {"MATLAB_int_decode": np.int32(1)}
        if np.iscomplexobj(node):
            values = np.ascontiguousarray(values).view([("real", "f8"), ("imag", "f8")])
        item = parent.create_dataset(name, data=values, **options)
    for key, entry in {**attributes, "MATLAB_class": np.bytes_(kind)}.items():
        item.attrs[key] = entry


def draw_matlab_73(rng: Rng) -> Case:
    """A file of MATLAB 7.3: HDF5 behind a block of 512 bytes."""
    variables, memory = _draw_variables(rng), io.BytesIO()
    options = draw(rng, ({}, {"chunks": True, "compression": "gzip"}, {"chunks": True, "fletcher32": True}))
    with h5py.File(memory, "w", userblock_size=512) as file:
        file.create_group("#refs#")
        for name, node in variables.items():
            _write_hdf5(file, file, name, node, options)
        if not len(file["#refs#"]):
            del file["#refs#"]
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon May  1".ljust(124) + b"\x00\x02IM"
    channels = tuple(truth for name, node in variables.items() for truth in _list_truths(name, node))
    return Case("drawn.mat", header + memory.getvalue()[128:], channels, f"{options}", sealed=bool(options))


# MDF and Parquet


def _draw_mdf_signal(rng: Rng, name: str, times: np.ndarray, new: bool, master: tuple[str, int]) -> tuple[Any, Truth]:
    kinds = ("plain", "linear", "table", "text", "string", "rational", "invalid", "array")[:8 if new else 5]
    kind, unit = draw(rng, kinds, [8, *[1] * (len(kinds) - 1)]), draw(rng, ("", *_UNITS))
    raw = draw_type(rng, draw_signal(rng, len(times)), "f8" if kind in ("linear", "rational") else "f8 f4 i2 i4 u1 u2")
    values, conversion, due, more = raw.astype(float), None, READ, {}
    if kind == "linear":
        conversion, values = {"a": 0.25, "b": -3.0}, values * 0.25 - 3
    elif kind == "rational":
        conversion, values = {"P1": 0.0, "P2": 2.0, "P3": 1.0, "P4": 0.0, "P5": 0.0, "P6": 4.0}, (2 * values + 1) / 4
    elif kind in ("table", "text"):
        raw = rng.integers(0, 3, len(times)).astype("u1")
        key, word, entries, factor = (("raw", "phys", (0.0, 10.0, 20.0), 10.0) if kind == "table" else
                                      ("val", "text", (b"off", b"on", b"fault"), 1.0))
        conversion = {f"{key}_{index}": float(index) for index in range(3)} | {
            f"{word}_{index}": entry for index, entry in enumerate(entries)} | (
            {"interpolation": True} if kind == "table" else {"default": b"?"})
        values = factor * raw
    elif kind == "string":
        raw, due, more = np.array([b"abc", b"d"] * len(times))[:len(times)], NEVER, {"encoding": "utf-8"}
    elif kind == "invalid":
        more = {"invalidation_bits": rng.random(len(times)) < 0.2}
        values = np.where(more["invalidation_bits"], np.nan, values)
    elif kind == "array":
        due = MAYBE
    name = name if kind not in ("string", "array") else f"{name} {rng.integers(10**9)}"  # not to be counted as equal
    if kind == "array":
        raw = np.rec.fromarrays([np.column_stack([raw, raw])], dtype=[(name, raw.dtype, (2,))])
    own = asammdf.Signal(raw, times, unit=unit, name=name, conversion=conversion, master_metadata=master, **more)
    return own, Truth((name,), unit, values, due, times if master[1] == 1 else None)


def draw_mdf(rng: Rng) -> Case:
    """A file of MDF of several groups, with the numbers before or behind their descriptions."""
    version, packed = draw(rng, ("3.30", "4.10", "4.20")), int(rng.integers(3))
    truths: list[Truth] = []
    places: list[tuple[int, int]] = []
    masters: set[str] = set()
    with asammdf.MDF(version=version) as mdf, tempfile.TemporaryDirectory() as folder:
        mdf.header.start_time = datetime(2024, 5, 1, tzinfo=UTC)
        mdf.configure(write_fragment_size=draw(rng, (512, 1 << 20)))
        for group in range(int(rng.integers(1, 5))):
            times = draw_times(rng, int(rng.integers(3, 80)))
            master = draw(rng, (("time", 1), ("angle", 2), ("index", 4)), (8, 1, 1)) if version > "4" else ("time", 1)
            names = rng.choice(_NAMES, int(rng.integers(1, 5)), replace=bool(rng.random() < 0.3))
            pairs = [_draw_mdf_signal(rng, str(name), times, version > "4", master) for name in names]
            mdf.append([own for own, _ in pairs], common_timebase=True)
            masters |= {master[0], f"{master[0]}@{group}"} if master[1] != 1 else set()
            for index, (_, truth) in enumerate(pairs, start=1):
                truths.append(truth)
                places.append((group, index))
        path = mdf.save(Path(folder) / ("a.mf4" if version > "4" else "a.mdf"), compression=packed)
        content = Path(path).read_bytes()
    if (history := content.find(b"##FH")) > 0:  # both histories have the time of writing
        content = content[:history + 40] + bytes(8) + content[history + 48:]
    content = re.sub(rb"\w{3} \w{3} [ \d]{2} [\d:]{8} \d{4}: upd", b"Wed May  1 10:11:12 2024: upd", content)
    content = _move_numbers(content) if (behind := bool(rng.random() < 0.5)) else content
    in_file = Counter(truth.names[0] for truth in truths)
    in_group = Counter((group, truth.names[0]) for (group, _), truth in zip(places, truths, strict=True))
    for number, (truth, (group, index)) in enumerate(zip(truths, places, strict=True)):
        name, = truth.names
        full = f"{name}@{group}.{index}" if in_group[group, name] > 1 else f"{name}@{group}"
        truths[number] = change(truth, names=(full if in_file[name] > 1 else name,))
    truths += [Truth((name,), due=NEVER) for name, count in in_file.items() if count > 1]
    truths += [Truth((name,), due=ANY) for name in sorted(masters)]
    return Case("drawn.mf4", content, tuple(truths), f"version {version} compression {packed} numbers behind {behind}")


def _move_numbers(content: bytes) -> bytes:
    """Put the numbers of all groups to the end, as a logger writes them."""
    moved, new = bytearray(content), content[8:9] == b"4"
    head, following, numbers, form = (64 + 24, 24, 40, "<Q") if new else (64 + 4, 4, 16, "<I")
    place, = struct.unpack_from(form, content, head)
    while place:
        start, = struct.unpack_from(form, content, place + numbers)
        if new:
            size, = struct.unpack_from("<Q", content, start + 8)
            moved += bytes(-len(moved) % 8)
        else:
            group, = struct.unpack_from("<I", content, place + 8)
            size = int(np.prod(struct.unpack_from("<HI", content, group + 20), dtype=int))
        struct.pack_into(form, moved, place + numbers, len(moved))
        moved += content[start:start + size]
        place, = struct.unpack_from(form, content, place + following)
    return bytes(moved)


def _draw_parquet_column(rng: Rng, count: int) -> tuple[Any, Truth]:
    kinds = ("number", "decimal", "stamp", "duration", "dictionary", "bool", "nested", "text")
    kind = draw(rng, kinds, (8, *[1] * 7))
    values = draw_signal(rng, count)
    gaps = (rng.random(count) < 0.1) if rng.random() < 0.4 else np.zeros(count, bool)
    if kind in ("nested", "text"):
        own = ["a"] * count if kind == "text" else [{"x": 1.0}] * count
        return pa.array(own, pa.string() if kind == "text" else pa.struct([("x", pa.float64())])), Truth((), due=NEVER)
    if kind == "decimal":
        cells = [None if gap else Decimal(f"{value:.3f}") for value, gap in zip(values, gaps, strict=True)]
        array, values = pa.array(cells, pa.decimal128(20, 3)), np.round(values, 3)
    elif kind in ("stamp", "duration"):
        unit, factor = draw(rng, (("s", 1), ("ms", 10**3), ("us", 10**6), ("ns", 10**9)))
        own = pa.timestamp(unit, draw(rng, (None, "UTC", "Europe/Berlin"))) if kind == "stamp" else pa.duration(unit)
        steps = np.arange(count) * max(factor // 1000, 1)
        array = pa.array(steps + (1_714_521_600 * factor if kind == "stamp" else 0), pa.int64(), mask=gaps).cast(own)
        values = steps / factor
        values = values - (values[~gaps][0] if kind == "stamp" and not gaps.all() else 0)
    else:
        raw = values > 0 if kind == "bool" else draw_type(rng, values, "f8 f4 i1 i2 i4 i8 u1 u2 u4 u8 f2")
        array, values = pa.array(raw, mask=gaps), raw.astype(float)
        array = array.dictionary_encode() if kind == "dictionary" else array
    due = MAYBE if kind in ("duration", "dictionary") or count == 0 else READ
    return array, Truth((), "s" if kind in ("stamp", "duration") else None, np.where(gaps, np.nan, values), due,
                        relative=kind == "stamp")


def draw_parquet(rng: Rng) -> Case:
    """A file of Parquet."""
    count, width = int(rng.integers(3, 60)) if rng.random() < 0.97 else 0, int(rng.integers(2, 7))
    style, sealed = draw(rng, ("brackets", "metadata", "none")), bool(rng.random() < 0.5)
    columns = [_draw_parquet_column(rng, count) for _ in range(width)]
    fields, truths = [], []
    heads = _draw_heads(rng, [truth.unit == "s" for _, truth in columns], style if style == "brackets" else "none")
    for (heading, unit, names), (array, truth) in zip(heads, columns, strict=True):
        unit = draw(rng, _UNITS) if style == "metadata" and truth.unit is None else unit
        fields.append(pa.field(heading, array.type, metadata={"unit": unit} if style == "metadata" and unit else None))
        equal = names[0].startswith("M@") and truth.due == READ  # a text beside it may leave its name alone
        truths.append(change(truth, names=names, unit=truth.unit or unit, due=MAYBE if equal else truth.due))
    truths.append(Truth(("M",), due=ANY))
    memory, codec = io.BytesIO(), draw(rng, ("none", "snappy", "gzip", "zstd"))
    parquet.write_table(pa.Table.from_arrays([array for array, _ in columns], schema=pa.schema(fields)), memory,
                        compression=codec, row_group_size=draw(rng, (None, 7)), write_page_checksum=sealed,
                        data_page_version=draw(rng, ("1.0", "2.0")), use_dictionary=bool(rng.random() < 0.5))
    return Case("drawn.parquet", memory.getvalue(), tuple(truths), f"{codec} checksums {sealed}", sealed=sealed)


# Damages


def truncate(case: Case, rng: Rng) -> Case:
    """Cut the end off; the last row of a text may end within a cell."""
    end, channels = int(rng.integers(len(case.content))), case.channels
    if case.text:
        position, samples = len(case.text.bom), 0
        for piece, sample, _ in case.text.pieces():
            samples = sample + 1 if sample >= 0 and position + 2 < end else samples  # not for a quote alone
            position += len(piece)
        channels = tuple(change(truth, values=truth.values[:samples], hit=frozenset({samples - 1}), unit=None,
                                due=ANY if truth.due == NEVER else MAYBE) for truth in channels)
    return change(case, content=case.content[:end], channels=channels, damage=f"cut at {end}", changed=1)


def change_bytes(case: Case, rng: Rng) -> Case:
    """Replace, insert or delete bytes at 1 to 4 places, or overwrite or insert a block of zeros."""
    kind = draw(rng, ("replaced", "inserted", "deleted", "zeros over", "zeros inserted"), (3, 1, 1, 0.5, 0.5))
    content, channels, words, zeros = case.content, case.channels, [], kind.startswith("zeros")
    for place in sorted(map(int, rng.integers(len(content), size=1 if zeros else int(rng.integers(1, 5)))))[::-1]:
        length = int(rng.integers(1, 65)) if zeros else 1
        letters = b"0123456789;,.\t\n -+Ee\"#" if case.text and rng.random() < 0.7 else bytes(range(256))
        new = bytes(length) if zeros else b"" if kind == "deleted" else bytes([draw(rng, letters)])
        stop = place if "inserted" in kind else place + length
        channels = _hit(change(case, channels=channels), place, stop)
        content = content[:place] + new + content[stop:]
        words.append(f"{place}: {new[:4]!r}")
    damage = f"{kind} {', '.join(words)}"
    return change(case, content=content, channels=channels, damage=damage, changed=64 if zeros else 4)


def _hit(case: Case, first: int, last: int) -> tuple[Truth, ...]:
    """The channels of a text with the samples marked whose cells the bytes from `first` to `last` touch."""
    hits: dict[int, set[int]] = {}
    position = len(case.text.bom) if case.text else 0
    for piece, sample, column in case.text.pieces() if case.text else ():
        if sample >= 0 and position - 2 <= last and first <= position + len(piece):
            hits.setdefault(column, set()).add(sample)
        position += len(piece)
    return tuple(change(truth, hit=truth.hit | frozenset(range(len(truth.values))) if truth.relative and column in hits
                        else truth.hit | hits.get(column, set())) for column, truth in enumerate(case.channels))


def change_cell(case: Case, rng: Rng) -> Case:
    """Put something else than a number into a cell."""
    text, sample, junk = case.text, _draw_sample(case, rng), draw(rng, _JUNK)
    line = text.lines[row := text.find(sample)]
    column, channels = int(rng.integers(len(line.cells))), list(case.channels)
    if column < len(channels) and line.cells[column].strip('"') and (truth := channels[column]).due != NEVER:
        stated = re.fullmatch(rf'("?)(-?\d+({re.escape(text.decimal)}\d+)?)\1', junk, re.ASCII)
        values, due = truth.values.copy(), MAYBE
        if stated and not truth.relative:
            values[sample], due = float(stated[2].replace(text.decimal, ".")), READ
        hit = frozenset(range(len(values)) if truth.relative and sample == 0 else () if stated else (sample,))
        channels[column] = change(truth, values=values, due=due, hit=hit)
    cells = (*line.cells[:column], junk, *line.cells[column + 1:])
    return _rewrite(case, row, [Line(cells, sample)], channels, f"cell {junk!r} in column {column + 1} of {sample}")


def change_rows(case: Case, rng: Rng) -> Case:
    """Cut a row, double it, exchange two of its cells, lose the names, or repeat them amid the numbers."""
    kind = draw(rng, ("cut", "doubled", "exchanged", "no names", "new names"))
    text, sample = case.text, _draw_sample(case, rng)
    line = text.lines[row := text.find(sample)]
    first, second = sorted(map(int, rng.choice(len(line.cells), 2, replace=False)))
    channels, lines, names = list(case.channels), [line], text.find(NAMES)
    if kind == "cut":
        lines = [Line(line.cells[:second], sample)]
        channels[second:] = [change(truth, hit=frozenset({sample}), due=MAYBE) for truth in channels[second:]]
    elif kind == "doubled":
        lines = [line, line]
        channels = [change(truth, values=np.insert(truth.values, sample, truth.values[sample]))
                    if len(truth.values) else truth for truth in channels]
    elif kind == "exchanged":
        cells = list(line.cells)
        cells[first], cells[second] = cells[second], cells[first]
        lines = [Line(tuple(cells), sample)]
        for column, other in ((first, second), (second, first)):
            if column < len(columns := case.channels) and (truth := columns[column]).due != NEVER:
                values, given = truth.values.copy(), columns[other] if other < len(columns) else truth
                values[sample] = given.values[sample] if other < len(columns) and given.due != NEVER else np.nan
                dated = truth.relative or given.relative
                channels[column] = change(truth, values=values, due=MAYBE, hit=frozenset(
                    range(len(values)) if dated else ()))
    else:
        row, lines = (names, []) if kind == "no names" else (text.find(max(sample, 1)),
                                                             [text.lines[names], text.lines[text.find(max(sample, 1))]])
        channels = [change(truth, due=NEVER) for truth in channels]
    return _rewrite(case, row, lines, channels, f"row of sample {sample} {kind}")


def _draw_sample(case: Case, rng: Rng) -> int:
    count = sum(line.sample >= 0 for line in case.text.lines)
    return draw(rng, (0, 1, count - 1, int(rng.integers(count))))


def _rewrite(case: Case, row: int, lines: Sequence[Line], channels: Sequence[Truth], damage: str) -> Case:
    text = change(case.text, lines=(*case.text.lines[:row], *lines, *case.text.lines[row + 1:]), codec="utf-8", bom=b"")
    return change(case, content=text.write(), text=text, channels=tuple(channels), damage=damage)


# Outcomes


def judge(case: Case) -> Verdict:
    """Read the file, and give the worst verdict of its channels."""
    try:
        source = open_source(case.name, io.BytesIO(case.content))
        listed = source.listed()
    except BadRecording as error:
        return _judge_refusal(error, bool(case.damage) or any(truth.due == READ for truth in case.channels))
    verdicts = [_judge_channel(case, source, truth, name) for truth in case.channels for name in truth.names]
    known = {name for truth in case.channels for name in truth.names}
    verdicts += [Verdict(REFUSED, f"lists {channel.name!r}, which the file has not")
                 for channel in listed if channel.name not in known and not case.damage]
    return min(verdicts, key=lambda verdict: OUTCOMES.index(verdict.outcome))


def _judge_refusal(error: BadRecording, wanted: bool) -> Verdict:
    if not (error.cause and error.remedy and len(str(error)) < LONGEST):
        return Verdict(WRONG, f"refused in {len(str(error))} letters: {str(error)[:80]}...{str(error)[-80:]}")
    return Verdict(REFUSED if wanted else RIGHT, str(error))


def _judge_channel(case: Case, source: Any, truth: Truth, name: str) -> Verdict:
    try:
        channel = source.channel(name)
    except BadRecording as error:
        return _judge_refusal(error, truth.due == READ or (truth.due == MAYBE and bool(case.damage)))
    words = [word for word in (*source.remarks[1:], channel.note) if "left out" in word and _FOOTER not in word]
    verdict = _compare(case, truth, channel) if truth.due != ANY else Verdict(RIGHT)
    outcome = SAID if words and verdict.outcome == WRONG else verdict.outcome
    return Verdict(outcome, f"{name!r}: {verdict.reason} {' '.join(words)}")


def _compare(case: Case, truth: Truth, channel: Any) -> Verdict:
    if truth.due == NEVER:
        return Verdict(UNDETECTABLE if case.changed else WRONG, f"read as numbers {channel.values[:4]}")
    if truth.unit is not None and channel.unit != truth.unit:
        return Verdict(UNDETECTABLE if case.changed else WRONG, f"unit {channel.unit!r} instead of {truth.unit!r}")
    if (truth.time is None) != (channel.time is None):
        return Verdict(SAID if case.damage and channel.no_time else WRONG, f"times {channel.time}, {channel.no_time!r}")
    if truth.time is None:
        return _compare_values(case, truth, truth.values, channel.values)
    kept, given = ~np.isnan(truth.values), ~np.isnan(channel.values)  # where there are times, no sample need be missing
    return min((_compare_values(case, truth, *pair) for pair in (
        (truth.values[kept], channel.values[given]), (truth.time[kept], channel.time[given]))),
        key=lambda verdict: OUTCOMES.index(verdict.outcome))


def _compare_values(case: Case, truth: Truth, due: np.ndarray, values: np.ndarray) -> Verdict:
    if values.shape != due.shape:
        return Verdict(WRONG, f"{values.shape} samples instead of {due.shape}: {values[:4]}, not {due[:4]}")
    scale = np.max(np.abs(due), initial=0, where=np.isfinite(due))
    equal = np.isclose(values, due, rtol=1e-9, atol=1e-6 if truth.relative else 1e-12 * scale, equal_nan=True)
    places = np.flatnonzero(~equal)
    if not len(places):
        return Verdict(RIGHT)
    words = f"{len(places)} of {len(due)} differ, from {places[0]}: {values[places][:3]}, not {due[places][:3]}"
    if truth.relative and np.allclose(np.diff(values), np.diff(due), 0, 1e-6, equal_nan=True):
        places = places[:1]  # the first has changed, from which the others count
    others = [other.values for other in case.channels if other.values.shape == due.shape and np.ptp(other.values) > 0]
    strays = any(np.array_equal(values, other) for other in (*others, np.roll(due, 1), np.roll(due, -1)))
    if case.text:
        if set(places.tolist()) <= truth.hit and np.isnan(values[places]).all():
            return Verdict(RIGHT)
        detectable = not case.changed or not set(places.tolist()) <= truth.hit
    else:  # in MDF, a changed description changes all numbers
        pairs = set(zip(due[places].tolist(), values[places].tolist(), strict=True))  # many by an entry of a dictionary
        detectable = case.sealed or strays or (case.name != "drawn.mf4" and len(pairs) > 2 * case.changed)
    return Verdict(WRONG if detectable or not case.damage else UNDETECTABLE, words)


def try_case(case: Case) -> Verdict:
    """Judge the file in a child process with limits of time and memory."""
    receiver, sender = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.get_context("fork").Process(target=_judge_with_limits, args=(case, sender))
    process.start()
    sender.close()
    verdict = None
    with suppress(EOFError):
        verdict = receiver.recv()
    process.join()
    return verdict or Verdict(CRASHED, f"exit {process.exitcode}")


def _judge_with_limits(case: Case, sender: Any) -> None:
    present = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (present + MEMORY, present + MEMORY))
    signal.alarm(SECONDS)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # of libraries
    try:
        sender.send(judge(case))
    except Exception as error:
        sender.send(Verdict(CRASHED, f"{type(error).__name__}: {str(error)[:200]}"))


FORMATS: dict[str, Callable[[Rng], Case]] = {
    "csv": draw_csv, "lvm": draw_lvm, "matlab 5": draw_matlab_5, "matlab 7.3": draw_matlab_73, "mdf": draw_mdf,
    "parquet": draw_parquet}


def try_format(name: str, valid: int, damaged: int, seed: int, report: Callable[[int, Case, Verdict], None]
               ) -> Iterator[Row]:
    """The rows of a format; `report` is called with all cases."""
    counts: dict[str, Counter[str]] = {"valid forms": Counter(), "damages": Counter()}
    for number in range(max(valid, damaged)):
        case, rng = FORMATS[name](np.random.default_rng([seed, number])), np.random.default_rng([seed, number, 1])
        damages = (truncate, change_bytes, change_bytes, *((change_cell, change_rows) if case.text else ()))
        for kind, own in (("valid forms", case), ("damages", draw(rng, damages)(case, rng))):
            if number < (valid if kind == "valid forms" else damaged):
                counts[kind][(verdict := try_case(own)).outcome] += 1
                report(number, own, verdict)
    for kind, outcomes in counts.items():
        bad = outcomes.total() - outcomes[RIGHT] if kind == "valid forms" else outcomes[WRONG] + outcomes[CRASHED]
        yield Row(f"{name}: {kind}", outcomes.total(), outcomes.total() - bad, "files",
                  ", ".join(f"{outcomes[outcome]} {outcome}" for outcome in OUTCOMES[::-1]))


def main(arguments: Sequence[str]) -> None:
    """Replace the rows of the table, or print what goes wrong in a format."""
    open_source("a.csv", io.BytesIO(b"a [bar];b [s]\n1;2\n3;4\n")).listed()  # or each child imports the units anew
    if arguments:
        name, count, seed = arguments

        def report(number: int, case: Case, verdict: Verdict) -> None:
            if verdict.outcome in (CRASHED, WRONG, SAID) or (verdict.outcome == REFUSED and not case.damage):
                print(f"{number} {case.form}; {case.damage or 'valid'}: {verdict.outcome}: {verdict.reason[:400]}")

        print(*try_format(name, int(count), int(count), int(seed), report), sep="\n")
    else:
        replace_rows("readers", [row for name in FORMATS for row in try_format(
            name, VALID, DAMAGED, SEED, lambda *_: None)], "python -m evidence.robustness.reader_fuzz")


if __name__ == "__main__":
    main(sys.argv[1:])
