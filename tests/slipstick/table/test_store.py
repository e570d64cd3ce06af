import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from slipstick.errors import BadTable, CorruptTable, UnknownName, WrongDigest, WrongLayout
from slipstick.storage.hdf5 import text
from slipstick.table import Grid, Table
from tests.benches import NOMINAL


@pytest.fixture
def path(table, tmp_path):
    table.save(tmp_path / "table.h5")
    return tmp_path / "table.h5"


def test_a_written_table_is_read_back_unchanged(table, path):
    read = Table.open(path)
    assert read.digest == table.digest
    assert np.array_equal(read.times, table.times, equal_nan=True)
    assert np.array_equal(read.status, table.status)
    assert (read.origin, read.model) == ("a test", NOMINAL)
    assert [(axis.name, axis.nominal, axis.unit) for axis in read.axes] == [
        ("pressure_bias", 1.6, "bar"), ("initial_position", 5e-4, "m")]


def test_attributes_describe_the_file_to_other_readers(path):
    with h5py.File(path) as file:
        times = file["times"]
        assert [dimension.label for dimension in times.dims] == ["pressure_bias", "initial_position", "condition"]
        assert np.array_equal(times.dims[1]["initial_position"], [0.5, 0.8, 0.9, 1.2, 1.5])
        assert times.fletcher32
        assert times.attrs["units"] == b"s"
        assert file["status"].attrs["flag_meanings"] == b"locked never_locked failed"
        assert file["axes/pressure_bias"].attrs["nominal_units"] == b"bar"


def flip(path, position, bit=3):
    content = bytearray(path.read_bytes())
    content[position] ^= 1 << bit
    path.write_bytes(content)


def byte_range(path, dataset):
    """Offset and size of the first chunk of a dataset, or of a whole contiguous dataset."""
    with h5py.File(path) as file:
        stored = file[dataset].id
        if file[dataset].chunks:
            return stored.get_chunk_info(0).byte_offset, stored.get_chunk_info(0).size
        return stored.get_offset(), stored.get_storage_size()


@pytest.mark.parametrize(("dataset", "error", "message"), [
    ("times", CorruptTable, "damaged"), ("status", CorruptTable, "damaged"),
    ("conditions/motor_speed", CorruptTable, "damaged"), ("current_profiles/current", CorruptTable, "damaged"),
    ("model", WrongDigest, "The model of the table"), ("axes/initial_position", BadTable, "digest|increase"),
])
def test_a_flipped_bit_in_any_dataset_is_detected(path, dataset, error, message):
    offset, size = byte_range(path, dataset)
    for fraction in (0.0, 0.3, 0.6, 0.9):
        broken = path.with_name("broken.h5")
        shutil.copy(path, broken)
        flip(broken, offset + int(fraction * size), bit=0)
        with pytest.raises(error, match=message):
            Table.open(broken)


def test_a_bit_flipped_anywhere_is_detected_or_harmless(table, path):
    content, detected = path.read_bytes(), 0
    generator = np.random.default_rng(5)
    for position in generator.integers(len(content), size=150):
        broken = bytearray(content)
        broken[position] ^= 1 << int(generator.integers(8))
        path.write_bytes(broken)
        try:
            assert Table.open(path).digest == table.digest
        except BadTable:
            detected += 1
    assert detected > 50


@pytest.mark.parametrize("fraction", [0.0, 0.001, 0.2, 0.9, 0.9999])
def test_a_truncated_file_is_rejected(path, fraction):
    content = path.read_bytes()
    path.write_bytes(content[: int(fraction * len(content))])
    with pytest.raises(WrongLayout if fraction < 0.0005 else CorruptTable):
        Table.open(path)


def attribute(path, name, value):
    return lambda file: file[path].attrs.__setitem__(name, value)


def change_time(file):
    file["times"][2, 2, 2] += 1e-12  # the checksum is valid, so only the digest detects it


def change_condition(file):
    file["conditions/load_inertia"][0] += 1.0


def change_condition_below_nine_digits(file):
    file["conditions/load_inertia"][0] *= 1 + 1e-14


def change_shape(file):
    times = file["times"][:, :4]
    del file["times"]
    file.create_dataset("times", data=times).attrs["units"] = text("s")


def change_type(file):
    status = file["status"][()].astype(float)
    del file["status"]
    file.create_dataset("status", data=status).attrs["units"] = text("1")


def change_statuses(file):
    file["status"][0, 1, 1] = 1


def link_outside(file):
    with h5py.File(file.filename + ".other", "w") as other:
        other["times"] = file["times"][()]
    del file["times"]
    file["times"] = h5py.ExternalLink(file.filename + ".other", "times")


def store_outside(file):
    times = file["times"][()]
    del file["times"]
    with open(file.filename + ".raw", "wb") as raw:
        raw.write(times.tobytes())
    dataset = file.create_dataset("times", times.shape, "f8", external=[(file.filename + ".raw", 0, times.nbytes)])
    dataset.attrs["units"] = text("s")


def leave_out_chunks(file):
    shape = file["times"].shape
    del file["times"]
    file.create_dataset("times", shape, "f8", chunks=(1, 5, 3)).attrs["units"] = text("s")


@pytest.mark.parametrize(("damage", "error", "message"), [
    (attribute("/", "content_digest", text("0" * 64)), WrongDigest, "The content of the table"),
    (change_time, WrongDigest, "The content of the table"),
    (change_condition, WrongDigest, "The conditions of the table"),
    (change_condition_below_nine_digits, WrongDigest, "The content of the table"),
    (attribute("axes", "order", text('["initial_position", "pressure_bias"]')), CorruptTable,
     r"'times' has shape \(7, 5, 3\), not \(5, 7, 3\)"),
    (change_shape, CorruptTable, r"'times' has shape \(7, 4, 3\), not \(7, 5, 3\)"),
    (change_type, CorruptTable, "'status' is of type float64, not unsigned"),
    (attribute("times", "units", text("ms")), CorruptTable, "'times' is in 'ms', not in 's'"),
    (attribute("/", "layout_version", 2), WrongLayout, "layout version 2, not 1"),
    (attribute("status", "flag_meanings", text("failed never_locked locked")), WrongLayout, "'flag_meanings' of 'st"),
    (change_statuses, CorruptTable, "contradict"),
    (lambda file: file.attrs.__delitem__("layout_version"), CorruptTable, "'layout_version' of '/' is missing"),
    (lambda file: file.__delitem__("times"), CorruptTable, "'times' is missing"),
    (link_outside, CorruptTable, "'times' is a link"),
    (store_outside, CorruptTable, "'times' are stored in another file"),
    (leave_out_chunks, CorruptTable, "'times' contains fewer values than its shape"),
])
def test_errors_name_the_inconsistency(path, damage, error, message):
    with h5py.File(path, "r+") as file:
        damage(file)
    with pytest.raises(BadTable, match=message) as caught:
        Table.open(path)
    assert type(caught.value) is error


def test_files_that_are_not_tables_are_rejected(path, tmp_path):
    with pytest.raises(UnknownName, match=r"no table 'tabel\.h5'\. Did you mean 'table\.h5'"):
        Table.open(tmp_path / "tabel.h5")
    (tmp_path / "note.h5").write_text("not HDF5")
    h5py.File(tmp_path / "empty.h5", "w").close()
    for name, message in (("note.h5", "is not an HDF5 file"), ("empty.h5", "is not a table")):
        with pytest.raises(WrongLayout, match=message):
            Table.open(tmp_path / name)


def test_a_failed_write_leaves_the_old_table(table, path, monkeypatch):
    before = path.read_bytes()
    monkeypatch.setattr("slipstick.table.store.content_digest", lambda *_: "0" * 64)
    other = Grid(table.axes, table.times + 1, table.status, table.conditions, table.model)
    assert other.digest == "0" * 64  # cached; the table read back computes the true digest
    monkeypatch.undo()
    with pytest.raises(WrongDigest):
        other.save(path)
    assert path.read_bytes() == before
    assert [entry.name for entry in path.parent.iterdir()] == ["table.h5"]


WRITER = """
import sys
from slipstick.table import Table
first, second = (Table.open(name) for name in sys.argv[1:3])
print("ready", flush=True)
while True:
    for table in (first, second):
        table.save(sys.argv[3])
"""


def test_a_killed_writer_leaves_no_partial_table(table, tmp_path):
    other = Grid(table.axes, table.times + 1, table.status, table.conditions, table.model)
    table.save(tmp_path / "first.h5")
    other.save(tmp_path / "second.h5")
    out, generator, digests = tmp_path / "out.h5", np.random.default_rng(3), set()
    for _ in range(3):
        arguments = [sys.executable, "-c", WRITER, tmp_path / "first.h5", tmp_path / "second.h5", out]
        with subprocess.Popen(arguments, stdout=subprocess.PIPE, cwd=Path(__file__).parents[3]) as writer:
            assert writer.stdout.readline() == b"ready\n"
            while not out.exists():
                assert writer.poll() is None
                time.sleep(0.001)
            time.sleep(generator.uniform(0, 0.06))
            writer.send_signal(signal.SIGKILL)
        digests.add(Table.open(out).digest)
    assert digests <= {table.digest, other.digest}
