"""What becomes of damaged tables that are uploaded: refused, or read without any difference.

    python -m evidence.robustness.damaged_tables

1,000 files are made from a plain table, that of docs/your_table.md, and from the same table as the service stores it:
cut off, with random bytes changed, with datasets and attributes of wrong types, and with hostile shapes, links and
values. Each is read by the reader of uploads in a child process with the limits of an upload. The children are forked
from a process that has imported the reader already; those of the service import it anew, which takes ten times as long.
A file that is read must give the content of the undamaged one. A minute.
"""

import io
import multiprocessing
import os
import re
import resource
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from evidence.robustness.table import Row, replace_rows
from slipstick.errors import SlipstickError
from slipstick.table.upload import read, rewritten

COUNT, SEED, SECONDS, MEMORY = 1000, 1, 10, 4 << 30
OUTCOMES = REFUSED, FAILED, SAME, DIFFERENT = (
    "refused with cause and remedy", "crashed or timed out", "read without difference", "silently different")
Damage = Callable[[bytes, np.random.Generator], bytes]
Edit = Callable[[h5py.File], None]

_DATASETS = ("times", "axes/torque_constant", "axes/rotor_inertia", "conditions/speed", "conditions/load_inertia")
_ATTRIBUTES = (("/", "layout"), ("/", "layout_version"), ("axes", "order"), ("axes/torque_constant", "nominal"),
               ("axes/torque_constant", "nominal_units"), ("times", "units"), ("times", "row_major_order"),
               ("conditions", "order"), ("conditions/speed", "units"))


def make_plain_table() -> bytes:
    """Run the program of docs/your_table.md, and return the file that it writes."""
    page = (Path(__file__).parents[2] / "docs" / "your_table.md").read_text()
    program, = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, "-c", program], cwd=folder, check=True)
        return (Path(folder) / "motor.h5").read_bytes()


def truncate(content: bytes, rng: np.random.Generator) -> bytes:
    """Cut the end of the file off."""
    return content[:int(rng.integers(len(content)))]


def replace_bytes(content: bytes, rng: np.random.Generator) -> bytes:
    """Replace 1 to 16 bytes, half of the time among its first 4 KiB, where its structure is."""
    damaged = bytearray(content)
    end = min(len(content), 4096) if rng.random() < 0.5 else len(content)
    for position in rng.integers(end, size=int(rng.integers(1, 17))):
        damaged[position] = int(rng.integers(256))
    return bytes(damaged)


def change_type(content: bytes, rng: np.random.Generator) -> bytes:
    """Give a dataset or an attribute another type."""
    def edit(file: h5py.File) -> None:
        if rng.random() < 0.5:
            path = str(rng.choice(_DATASETS))
            values = file[path][()]
            others = [values.astype("c16"), values.astype("S8"), values > 1, np.zeros(values.shape, "V8"),
                      np.zeros(values.shape, [("a", "f8")]), values.astype("g")]
            _replace(file, path, others[int(rng.integers(len(others)))])
        else:
            path, name = _ATTRIBUTES[int(rng.integers(len(_ATTRIBUTES)))]
            values = [np.float64("nan"), np.bytes_(b"\xff\xfe"), np.zeros((3, 3)), np.bytes_(b""), h5py.Empty("f8"),
                      "text", np.array([b"a", b"b"]), np.array((1, 2), [("a", "i4"), ("b", "i4")])]
            file[path].attrs[name] = values[int(rng.integers(len(values)))]

    return _edit(content, edit)


def make_hostile(content: bytes, rng: np.random.Generator) -> bytes:
    """Put a hostile shape, link, name or value into the file."""
    edits = _hostile_edits(rng)
    return _edit(content, edits[int(rng.integers(len(edits)))])


def _hostile_edits(rng: np.random.Generator) -> list[Edit]:
    path = str(rng.choice(_DATASETS))

    def declare_shape(shape: tuple[int, ...], chunks: tuple[int, ...]) -> Edit:
        return lambda file: _replace(file, path, None, shape=shape, chunks=chunks, dtype="f8")

    def link_to(link: object) -> Edit:
        def edit(file: h5py.File) -> None:
            del file[path]
            file[path] = link

        return edit

    def reshape(change: Callable[[np.ndarray], np.ndarray]) -> Edit:
        return lambda file: _replace(file, path, change(file[path][()]))

    def set_value(value: float) -> Edit:
        def edit(file: h5py.File) -> None:
            values = file[path][()].astype("f8")
            values.flat[int(rng.integers(values.size))] = value
            _replace(file, path, values)

        return edit

    def set_order(order: bytes) -> Edit:
        return lambda file: file["axes"].attrs.__setitem__("order", np.bytes_(order))

    def make_virtual(file: h5py.File) -> None:
        layout = h5py.VirtualLayout(file[path].shape, "f8")
        layout[...] = h5py.VirtualSource("/etc/passwd", "x", shape=file[path].shape)
        del file[path]
        file.create_virtual_dataset(path, layout)

    def compress(file: h5py.File) -> None:
        _replace(file, path, np.zeros(1 << 24), chunks=(1 << 24,), compression=9)

    return [
        declare_shape((1 << 40, 1 << 20), (1, 1)), declare_shape((1 << 31,), (1 << 28,)), declare_shape((0, 0), (1, 1)),
        reshape(lambda values: values[..., None]), reshape(lambda values: values.ravel()[:1]),
        reshape(lambda values: values[:0]), reshape(np.atleast_3d),
        link_to(h5py.SoftLink("/")), link_to(h5py.SoftLink("/nowhere")), link_to(h5py.ExternalLink("/etc/passwd", "/")),
        set_value(np.inf), set_value(-np.inf), make_virtual, compress,
        set_order(b"[]"), set_order(b"{}"), set_order(b'["torque_constant", "torque_constant"]'),
        set_order(b'["../times", "x"]'), set_order(b"[" * 100_000), set_order(b'["' + b"a" * 60_000 + b'"]'),
        set_order(b"[1, null]"), set_order(b'["torque_constant"]')]


def _replace(file: h5py.File, path: str, values: np.ndarray | None, **options: Any) -> None:
    units = file[path].attrs["units"]
    attributes = dict(file[path].attrs)
    del file[path]
    if values is not None:
        options = {"chunks": tuple(max(length, 1) for length in values.shape), **options}
    options["maxshape"] = (None,) * len(options["chunks"])
    dataset = file.create_dataset(path, data=values, fletcher32=True, **options)
    for name in ("nominal", "nominal_units"):
        if name in attributes:
            dataset.attrs[name] = attributes[name]
    dataset.attrs["units"] = units


def _edit(content: bytes, edit: Edit) -> bytes:
    memory = io.BytesIO(content)
    with h5py.File(memory, "r+", libver=("v110", "v110")) as file:
        edit(file)
    return memory.getvalue()


DAMAGES: dict[str, Damage] = {"truncated": truncate, "bytes replaced": replace_bytes, "wrong type": change_type,
                              "hostile shape, link, name or value": make_hostile}


def try_upload(content: bytes, digest: str) -> str:
    """Let the reader of uploads read the file; the outcome is one of `OUTCOMES`."""
    receiver, sender = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.get_context("fork").Process(target=_read, args=(content, sender))
    process.start()
    sender.close()
    answer = None
    # Before `join`, because a message that is longer than the buffer of the pipe keeps the process from its end.
    if receiver.poll(6 * SECONDS):
        with suppress(EOFError):
            answer = receiver.recv()
    else:
        process.kill()
    process.join()
    if answer is None or process.exitcode != 0:
        return FAILED
    own_digest, cause, remedy = answer
    if not own_digest:
        assert cause
        assert remedy
        return REFUSED
    return SAME if own_digest == digest else DIFFERENT


def _read(content: bytes, sender: "multiprocessing.connection.Connection") -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # of the HDF5 library
    try:
        sender.send((rewritten(content).partition(b"\n")[0].decode(), "", ""))
    except SlipstickError as error:
        sender.send(("", error.cause, error.remedy))


def count_outcomes(count: int, seed: int) -> Counter[tuple[str, str]]:
    """Damage `count` files: how often each damage has each outcome."""
    plain = make_plain_table()
    stored = rewritten(plain).partition(b"\n")[2]
    digest = read(plain).digest
    forms = (plain, stored)
    assert {try_upload(content, digest) for content in forms} == {SAME}
    counts: Counter[tuple[str, str]] = Counter()
    for number in range(count):
        form, damage = forms[number % 2], list(DAMAGES)[number // 2 % len(DAMAGES)]
        content = DAMAGES[damage](form, np.random.default_rng([seed, number]))
        counts[damage, try_upload(content, digest)] += 1
    return counts


def summarize(counts: Counter[tuple[str, str]]) -> list[Row]:
    """The rows of the table, one per damage."""
    rows = []
    for damage in DAMAGES:
        by_outcome = {outcome: counts[damage, outcome] for outcome in OUTCOMES}
        rows.append(Row(damage, sum(by_outcome.values()),
                        by_outcome[REFUSED] + by_outcome[SAME], "files",
                        ", ".join(f"{count} {outcome}" for outcome, count in by_outcome.items())))
    return rows


def main() -> None:
    """Damage the files, and replace the rows of the table."""
    replace_rows("damaged tables", summarize(count_outcomes(COUNT, SEED)),
                 "python -m evidence.robustness.damaged_tables")


if __name__ == "__main__":
    main()
