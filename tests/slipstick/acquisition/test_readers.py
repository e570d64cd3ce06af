"""Every format gives back what another program wrote into it; damaged and foreign content is refused by name."""

import io
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy
from asammdf import MDF, Signal
from scipy.io import savemat

from slipstick.acquisition import open_source
from slipstick.acquisition.csv_file import CsvOptions
from slipstick.errors import BadRecording
from tests.slipstick.acquisition.conftest import csv, opened, run

FAST, SLOW = np.arange(500) * 1e-3, np.arange(50) * 1e-2
MATLAB = Path(scipy.__file__).parent / "io" / "matlab" / "tests" / "data"
PARQUET = Path(pa.__file__).parent / "tests" / "data" / "parquet"


def mdf(path: Path, version: str, compression: int = 0) -> Path:
    file = MDF(version=version)
    file.append([Signal(np.sin(FAST), FAST, "bar", "p"), Signal(np.arange(500, dtype=np.int16), FAST, "rpm", "n")])
    file.append([Signal(np.cos(SLOW), SLOW, "°C", "T"), Signal(np.full(50, 7.0), SLOW, "rpm", "n")])
    return Path(file.save(path, compression=compression))


@pytest.mark.parametrize(("version", "compression"), [
    ("3.30", 0), ("4.10", 0), ("4.10", 1), ("4.10", 2), ("4.20", 0), ("4.20", 2)])
def test_mdf_keeps_the_clock_of_each_channel(tmp_path: Path, version: str, compression: int) -> None:
    with mdf(tmp_path / "a.mf4", version, compression).open("rb") as file:
        source = open_source("a.mf4", file)
        assert {one.name: (one.unit, one.samples) for one in source.listed()} == {
            "p": ("bar", 500), "T": ("°C", 50), "n@0": ("rpm", 500), "n@1": ("rpm", 50)}
        fast, slow = source.channel("n@0"), source.channel("T")
    assert source.remarks == (f"MDF {version}",)
    np.testing.assert_allclose(fast.time, FAST)
    np.testing.assert_array_equal(fast.values, np.arange(500))
    np.testing.assert_allclose(slow.time, SLOW)
    np.testing.assert_allclose(slow.values, np.cos(SLOW))


def test_an_unfinished_file_of_a_logger_is_read_and_left_as_it_is(tmp_path: Path) -> None:
    path = mdf(tmp_path / "a.mf4", "4.10")
    content = bytearray(path.read_bytes())
    content[:8], content[60:62] = b"UnFinMF ", (1).to_bytes(2, "little")  # the counters of samples are not up to date
    path.write_bytes(content)
    with path.open("rb") as file:
        np.testing.assert_array_equal(open_source("a.mf4", file).channel("n@0").values, np.arange(500))
    assert path.read_bytes() == content


def test_an_invalid_sample_of_mdf_is_left_out(tmp_path: Path) -> None:
    invalid = np.zeros(500, bool)
    invalid[[3, 4]] = True
    file = MDF(version="4.10")
    file.append([Signal(np.sin(FAST), FAST, "bar", "p", invalidation_bits=invalid)])
    path = Path(file.save(tmp_path / "a.mf4"))
    with path.open("rb") as content:
        np.testing.assert_array_equal(open_source("a.mf4", content).channel("p").time, FAST[~invalid])


def test_mat_5_has_vectors_columns_and_fields() -> None:
    memory = io.BytesIO()
    savemat(memory, {"t": FAST, "log": {"p": np.sin(FAST), "name": "bench 3"}, "M": np.arange(1000).reshape(500, 2)})
    source = open_source("a.mat", opened(memory.getvalue()))
    assert {one.name: one.samples for one in source.listed()} == {"t": 500, "log.p": 500, "M(:,1)": 500, "M(:,2)": 500}
    np.testing.assert_array_equal(source.channel("M(:,2)").values, np.arange(1000)[1::2])
    np.testing.assert_array_equal(source.channel("log.p").values, np.sin(FAST))


def test_mat_7_3_is_the_same_though_hdf5_stores_it_transposed() -> None:
    memory = io.BytesIO()
    with h5py.File(memory, "w", userblock_size=512) as file:
        file["t"] = FAST[None]
        file["log/p"] = np.sin(FAST)[None]
        file["M"] = np.arange(1000).reshape(500, 2).T
        file["log/name"] = np.array([[98]], np.uint16)
        file["log/name"].attrs["MATLAB_class"] = np.bytes_("char")
        file["elsewhere"] = h5py.ExternalLink("/etc/passwd", "x")
    content = bytearray(memory.getvalue())
    content[:19] = b"MATLAB 7.3 MAT-file"
    source = open_source("a.mat", opened(bytes(content)))
    assert {one.name for one in source.listed()} == {"t", "log.p", "M(:,1)", "M(:,2)"}
    np.testing.assert_array_equal(source.channel("M(:,2)").values, np.arange(1000)[1::2])


@pytest.mark.parametrize(("file", "name", "values"), [
    ("testdouble_4.2c_SOL2.mat", "testdouble", np.linspace(0, 2 * np.pi, 9)),
    ("testdouble_6.1_SOL2.mat", "testdouble", np.linspace(0, 2 * np.pi, 9)),
    ("testdouble_7.4_GLNX86.mat", "testdouble", np.linspace(0, 2 * np.pi, 9)),
    ("teststruct_7.4_GLNX86.mat", "teststruct.doublefield", np.array([np.sqrt(2), np.e, np.pi])),
    ("testhdf5_7.4_GLNX86.mat", "testdouble", np.linspace(0, 2 * np.pi, 9))])
def test_files_written_by_matlab(file: str, name: str, values: np.ndarray) -> None:
    """Those that scipy is tested with, by MATLAB 4.2 to 7.4: they come with its package."""
    if not (MATLAB / file).exists():
        pytest.skip("this build of scipy comes without its test data")
    with (MATLAB / file).open("rb") as content:
        np.testing.assert_allclose(open_source(file, content).channel(name).values, values)


def test_parquet_has_units_in_names_or_metadata_and_times() -> None:
    memory = io.BytesIO()
    fields = [pa.field("n [rpm]", pa.float64()), pa.field("p", pa.float32(), metadata={"unit": "bar"}),
              pa.field("at", pa.timestamp("ms")), pa.field("who", pa.string())]
    columns = [[1.0, None, 3.0], [1.0, 2.0, 4.0], np.array([1000, 1001, 1003], "M8[ms]"), ["a", "b", "c"]]
    pq.write_table(pa.table(columns, schema=pa.schema(fields)), memory)
    source = open_source("a.parquet", opened(memory.getvalue()))
    assert {one.name: one.unit for one in source.listed()} == {"n": "rpm", "p": "bar", "at": "s"}
    np.testing.assert_array_equal(source.channel("n").values, [1, np.nan, 3])
    np.testing.assert_allclose(source.channel("at").values, [0, 0.001, 0.003])


def test_a_parquet_file_of_2017_by_another_writer() -> None:
    path = PARQUET / "v0.7.1.parquet"
    if not path.exists():
        pytest.skip("this build of pyarrow comes without its test data")
    with path.open("rb") as content:
        source = open_source("old.parquet", content)
        assert {one.name for one in source.listed()} >= {"carat", "depth", "price"}
        assert source.channel("carat").values[:3] == pytest.approx([0.23, 0.21, 0.23])


@pytest.mark.parametrize(("separator", "decimal"), [(";", ","), (";", "."), ("\t", ","), (",", ".")])
def test_csv_of_every_country(separator: str, decimal: str) -> None:
    one = run(step=0.01)
    source = open_source("a.csv", opened(csv(one, separator, decimal)))
    for name, values in one.columns.items():
        np.testing.assert_allclose(source.channel(name).values, values, rtol=1e-8)
    assert ("decimal commas" if decimal == "," else "decimal points") in source.remarks[0]


@pytest.mark.parametrize(("text", "units"), [
    ("t [ms];n (rpm)\n1;2,5\n3;4\n", {"t": "ms", "n": "rpm"}),
    ("t;n\nms;1/min\n1;2,5\n3;4\n", {"t": "ms", "n": "1/min"}),
    ("remark;a;b\nt;n\n1;2,5\n3;4\n", {"t": "", "n": ""}),
    ("\ufefft;n_Öl\n[s];[°C]\n1,0;2\n", {"t": "s", "n_Öl": "°C"})])
def test_csv_has_units_in_names_or_in_a_row_of_their_own(text: str, units: dict[str, str]) -> None:
    assert {one.name: one.unit for one in open_source("a.csv", opened(text.encode())).listed()} == units


def test_objects_of_matlab_classes_are_said_to_be_unreadable() -> None:
    with (MATLAB / "testobject_7.4_GLNX86.mat").open("rb") as file:
        assert "'testobject' is an object of a MATLAB class" in open_source("a.mat", file).remarks[1]
    memory = io.BytesIO()
    with h5py.File(memory, "w", userblock_size=512) as content:
        content["p"] = np.arange(5.0)
        content["series"] = np.arange(6, dtype=np.uint32).reshape(1, 6)
        content["series"].attrs["MATLAB_class"] = np.bytes_("timeseries")
        content["series"].attrs["MATLAB_object_decode"] = np.int32(3)
    written = b"MATLAB 7.3 MAT-file".ljust(128) + memory.getvalue()[128:]
    source = open_source("a.mat", opened(written))
    assert [one.name for one in source.listed()] == ["p"]
    assert source.remarks[1].startswith("'series' is an object of a MATLAB class")
    memory = io.BytesIO()
    savemat(memory, {"p": np.arange(5.0)})
    assert open_source("a.mat", opened(memory.getvalue())).remarks == ("MATLAB 5 to 7",)


@pytest.mark.parametrize("rows", [
    "2026-11-02T14:03:11.25Z;1\n2026-11-02T14:03:11.75Z;2", "2026-11-02 14:03:11.250;1\n2026-11-02 14:03:11.750;2",
    "02.11.2026 14:03:11,25;1\n02.11.2026 14:03:11,75;2", "9:59:59.75;1\n10:00:00.25;2",
    "2026-11-02 23:59:59.8;1\n2026-11-03 00:00:00.3;2", "2026-10-25T02:59:59.5+02:00;1\n2026-10-25T02:00:00+01:00;2"])
def test_dates_and_times_of_day_are_seconds_after_the_first_row(rows: str) -> None:
    source = open_source("a.csv", opened(f"time;p\n{rows}\n".encode()))
    np.testing.assert_allclose(source.channel("time").values, [0, 0.5], atol=1e-9)
    assert {one.name: one.unit for one in source.listed()} == {"time": "s", "p": ""}
    assert source.remarks[1].startswith("the column 'time' states dates or times of day")


def test_csv_of_windows_is_read_and_said() -> None:
    source = open_source("a.csv", opened("t [s];Öl [°C]\n1;2\n2;3\n".encode("cp1252")))
    assert source.listed()[1].name == "Öl"
    assert "Windows-1252" in source.remarks[0]


def test_an_empty_cell_is_missing_and_never_filled() -> None:
    values = open_source("a.csv", opened(b"t;p\n1;2\n2;\n3;4\n")).channel("p").values
    np.testing.assert_array_equal(values, [2, np.nan, 4])


@pytest.mark.parametrize(("content", "says"), [
    (b"", "a.csv is empty"),
    (b"t;p\n1;2\n2;n/a\n3;4\n", "Row 3 of a.csv, column 'p': 'n/a' is not a number"),
    (b"t;p\n10:00:00;2\n2;3\n", "Row 3 of a.csv, column 't': '2' is not a date with a time, as in the first row"),
    (b"t;p\n1;2\n10:00:00;3\n", "Row 3 of a.csv, column 't': '10:00:00' is not a number"),
    (b"t;p\n1;2\n2;3;4\n", "Row 3 of a.csv has 3 cells for 2 columns"),
    (b"t;p;p\n1;2;3\n2;3;4\n", "more than one column 'p'"),
    (b"1;2\n2;3\n", "a.csv has no row of 2 column names"),
    (b"nothing here\n", "a.csv has no rows of two or more numbers"),
    (b"\x7fELF\0\0\0\0", "a.csv is none of MDF, MATLAB, Parquet and text"),
    (b"MDF     4.10" + b"\xff" * 600, "a.csv cannot be read as MDF"),
    (b"PAR1" + b"\xff" * 600 + b"PAR1", "a.csv cannot be read as Parquet"),
    (b"MATLAB 5.0 MAT-file" + b"\0" * 109 + b"\xff" * 500, "a.csv cannot be read as a MATLAB file")])
def test_wrong_content_names_file_row_and_remedy(content: bytes, says: str) -> None:
    with pytest.raises(BadRecording) as error:
        open_source("a.csv", opened(content))
    assert says in error.value.cause
    assert error.value.remedy


def test_an_unknown_channel_names_those_that_are_alike() -> None:
    source = open_source("a.csv", opened(b"t;p_oil\n1;2\n2;3\n"))
    with pytest.raises(BadRecording, match=r"a.csv has no channel 'p_oill'. Did you mean p_oil\?"):
        source.channel("p_oill")


def test_utf_16_is_known_by_its_byte_order_mark() -> None:
    source = open_source("a.csv", opened("t [s];p_oil [bar]\n1;2\n2;3\n".encode("utf-16")))
    assert source.channel("p_oil").values.tolist() == [2, 3]
    assert "UTF-16" in source.remarks[0]


def test_stated_options_are_obeyed() -> None:
    text = "a,5;b\n1,5;2\n".encode("utf-16")
    assert open_source("a.csv", opened(text), CsvOptions(";", ",", "utf-16")).channel("a,5").values.tolist() == [1.5]
    with pytest.raises(BadRecording, match="not text in the encoding klingon"):
        open_source("a.csv", opened(b"t;p\n1;2\n"), CsvOptions(encoding="klingon"))
