import re
import shutil
import zlib
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from slipstick.errors import BadRecording, UnknownName
from slipstick.recordings import Recordings, open_conditions
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.storage.isolated import require_readable
from tests.benches import HEAVY

ROOT = Path(__file__).parents[3]


@pytest.fixture
def copy(shipped_file, tmp_path):
    shutil.copy(shipped_file, tmp_path / "copy.h5")
    return tmp_path / "copy.h5"


def test_the_shipped_recordings_are_read_completely(shipped, shipped_file):
    assert (len(shipped), shipped.signals.pressure.shape) == (216, (216, 1001))
    assert shipped.conditions.digest == HEAVY.conditions.digest
    assert open_conditions(shipped_file).digest == HEAVY.conditions.digest
    assert sorted(shipped.run_order) == list(range(216))
    assert np.array_equal(shipped.conditions.run_order, shipped.run_order)
    assert shipped.description.startswith("Simulated test-bench recordings")
    with h5py.File(shipped_file) as file:
        assert np.array_equal(shipped.measured_time, file["shifting_time"])
        assert np.array_equal(shipped.signals.output_torque, file["signals/output_torque"])
    assert Recordings.read(shipped_file.read_bytes(), "h5").digest == shipped.digest


def put(file, path, values, **options):
    units = file[path].attrs["units"]
    del file[path]
    file.create_dataset(path, data=values, **options).attrs["units"] = units


def edit(path, index, value):
    def damage(file):
        values = file[path][()].astype(float)
        values[index] = value
        put(file, path, values)
    return damage


def unit(path, wrong_unit):
    def damage(file):
        file[path].attrs["units"] = wrong_unit
    return damage


def cut(path):
    return lambda file: put(file, path, file[path][:-1])


def drop(*paths):
    def damage(file):
        for path in paths:
            del file[path]
    return damage


def rename(path, other):
    return lambda file: file.move(path, other)


def swap_times(file):
    times = file["signals/time"][()]
    times[[10, 11]] = times[[11, 10]]
    put(file, "signals/time", times)


def group_for_dataset(file):
    del file["shifting_time"]
    file.create_group("shifting_time")


@pytest.fixture
def in_this_process(monkeypatch):
    """Recordings are read without the preceding check in a child process, which takes a second to start."""
    monkeypatch.setattr("slipstick.recordings.recordings.require_readable", lambda *_: None)


def test_the_child_process_raises_the_error_of_the_reader(copy):
    with h5py.File(copy, "r+") as file:
        unit("shifting_time", "ms")(file)
    with pytest.raises(BadRecording, match=r"'shifting_time'.*'ms'") as error:
        require_readable(copy.read_bytes(), "slipstick.recordings.hdf5_form:read", BadRecording)
    assert "Convert the values" in error.value.remedy


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize(("damage", "message"), [
    (unit("shifting_time", "ms"), "'shifting_time' is in 'ms', not in 's'"),
    (lambda file: file["signals/pressure"].attrs.__delitem__("units"), "'units' of 'signals/pressure' is missing"),
    (cut("shifting_time"), r"'shifting_time' has shape \(215,\), not \(216\)"),
    (cut("signals/time"), r"'signals/pressure' has shape \(216, 1001\), not \(216, 1000\)"),
    (cut("conditions/run_order"), "'conditions/run_order' has shape"),
    (swap_times, "does not increase at sample 11 "),
    (edit("shifting_time", 7, np.nan), "shifting time of condition 7 is nan s"),
    (edit("signals/output_speed", (5, 17), np.inf), "output_speed of condition 5 is not finite at sample 17 "),
    (edit("conditions/load_inertia", 3, np.nan), "'conditions/load_inertia' of condition 3 is nan"),
    (edit("conditions/motor_speed", 4, -1.0), "'conditions/motor_speed' of condition 4 is -1"),
    (edit("conditions/motor_speed", 4, 1e300), "Motor_speed has a value of 1e\\+300"),
    (edit("current_profiles/time", (2, 3), 9.0), "do not rise"),
    (lambda file: put(file, "conditions/current_profile", np.full(216, 6)), "beyond the 6"),
    (lambda file: put(file, "conditions/run_order", np.zeros(216, int)), "run order"),
    (lambda file: put(file, "shifting_time", np.array(["fast"] * 216, dtype="S4")), "'shifting_time' is of type"),
    (group_for_dataset, "'shifting_time' is a group"),
    (drop("shifting_time"), "'shifting_time' is missing"), (drop("conditions"), "'conditions' is missing"),
    (drop("signals/time"), "'signals/time' is missing"),
    (rename("signals/pressure", "signals/presure"), "There is no signal 'presure'"),
    (drop(*(f"signals/{name}" for name in SIGNAL_UNITS)), "times of samples and no signals"),
])
def test_errors_name_the_dataset(copy, damage, message):
    with h5py.File(copy, "r+") as file:
        damage(file)
    with pytest.raises(BadRecording, match=message):
        Recordings.open(copy)


def test_signals_run_order_and_description_are_optional(copy, shipped):
    with h5py.File(copy, "r+") as file:
        del file["signals"], file["conditions/run_order"], file.attrs["description"]
    read = Recordings.open(copy)
    assert (read.signals, read.run_order, read.description) == (None, None, "")
    assert np.array_equal(read.measured_time, shipped.measured_time)
    assert read.digest != shipped.digest


def link_to_a_file(file):
    del file["shifting_time"]
    file["shifting_time"] = h5py.ExternalLink(ROOT / "tables" / "measured.h5", "shifting_time")


def link_a_group_to_a_file(file):
    del file["signals"]
    file["signals"] = h5py.ExternalLink(ROOT / "tables" / "measured.h5", "signals")


def replaced(file, path, shape, **options):
    """The dataset in whose place nothing was written, with the same unit."""
    units = file[path].attrs["units"]
    del file[path]
    dataset = file.create_dataset(path, shape, "f8", **options)
    dataset.attrs["units"] = units
    return dataset


def values_in_another_file(file):
    replaced(file, "shifting_time", (216,), external=[("/proc/self/environ", 0, 8 * 216)])


def values_of_another_dataset(file):
    del file["shifting_time"]
    layout = h5py.VirtualLayout((216,), "f8")
    layout[:] = h5py.VirtualSource(ROOT / "tables" / "measured.h5", "shifting_time", (216,))
    file.create_virtual_dataset("shifting_time", layout).attrs["units"] = "s"


def seven_tebibytes(file):
    replaced(file, "current_profiles/current", (216, 1 << 32), chunks=(1, 1000))


def never_written(file):
    replaced(file, "signals/pressure", (216, 1001), chunks=(1, 1001), compression="gzip")


def huge_chunk(file):
    replaced(file, "shifting_time", (216,), chunks=(1 << 28,), maxshape=(None,))


def decompression_bomb(file):
    dataset = replaced(file, "shifting_time", (216,), chunks=(216,), compression="gzip")
    packer = zlib.compressobj()
    packed = b"".join(packer.compress(bytes(1 << 20)) for _ in range(500)) + packer.flush()
    dataset.id.write_direct_chunk((0,), packed)  # half a megabyte on disk, 500 MB in memory


def skipped_filter(file):
    dataset = replaced(file, "shifting_time", (216,), chunks=(216,), compression="gzip")
    dataset.id.write_direct_chunk((0,), bytes(8 * 216), filter_mask=1)


def other_filter(file):
    put(file, "shifting_time", file["shifting_time"][()], compression="lzf")


def peak_of_memory():
    """Largest resident memory in kB since 5 was last written to clear_refs."""
    return int(re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text())[1])


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="resets the peak of memory, as only Linux can")
@pytest.mark.parametrize(("damage", "message"), [
    (link_to_a_file, "is a link"), (link_a_group_to_a_file, "is a link"),
    (values_in_another_file, "stored in another file"), (values_of_another_dataset, "stored in another file"),
    (seven_tebibytes, r"requires 7,\d+,\d+,\d+,\d+ bytes"),
    (never_written, "contains fewer values than its shape"), (huge_chunk, r"requires .* bytes"),
    (decompression_bomb, "decompresses to more than 1,728 bytes"), (skipped_filter, "skips a filter"),
    (other_filter, "filters other than"),
])
def test_malicious_files_are_rejected_before_their_values_are_read(copy, damage, message):
    with h5py.File(copy, "r+") as file:
        damage(file)
    Path("/proc/self/clear_refs").write_text("5")
    before = peak_of_memory()
    with pytest.raises(BadRecording, match=message):
        Recordings.open(copy)
    assert peak_of_memory() - before < 100_000


def test_a_file_that_hangs_its_reader_is_rejected(shipped_file):
    content = bytearray(shipped_file.read_bytes())
    heap = content.index(b"GCOL")
    size = int.from_bytes(content[heap + 24 : heap + 32], "little")  # of the first text in the heap
    content[heap + 25] ^= 8
    assert size < 2048 < int.from_bytes(content[heap + 24 : heap + 32], "little")
    with pytest.raises(BadRecording, match="hangs or crashes"):
        require_readable(bytes(content), "slipstick.recordings.hdf5_form:read", BadRecording, seconds=2)


def test_damaged_bytes_are_rejected(shipped_file):
    content = shipped_file.read_bytes()
    for broken in (b"", b"not HDF5", content[:1000], content[:-1000], content[8:], content[:8] + bytes(5000)):
        with pytest.raises(BadRecording):
            Recordings.read(broken, "h5")


def test_missing_files_unknown_extensions_and_extra_signals_files_are_rejected(tmp_path, copy):
    with pytest.raises(UnknownName, match=r"Did you mean 'copy\.h5'"):
        Recordings.open(tmp_path / "copi.h5")
    with pytest.raises(BadRecording, match=r"neither an \.h5 nor a \.csv file"):
        Recordings.open(tmp_path / "copy.mat")
    with pytest.raises(BadRecording, match="separate signals file"):
        Recordings.open(copy, copy)


def test_recordings_without_some_of_the_signals_are_read_as_they_were_written(shipped):
    partial = replace(shipped, signals=replace(shipped.signals, pressure=None, output_torque=None))
    read = Recordings.read(partial.to_bytes(), "h5")
    assert read.signals.names == ("input_speed", "output_speed")
    assert read.signals.missing == ("pressure", "output_torque")
    assert np.array_equal(read.signals["input_speed"], shipped.signals["input_speed"])
    assert read.digest == partial.digest != shipped.digest
    with pytest.raises(BadRecording, match="The recordings have no output torque"):
        read.signals["output_torque"]


def test_a_table_is_called_a_table(copy):
    with h5py.File(copy, "r+") as file:
        file.attrs["layout"] = "slipstick table"
    for read in (Recordings.open, open_conditions):
        with pytest.raises(BadRecording, match=r"'copy\.h5' is a table, not recordings"):
            read(copy)
