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
from slipstick.acquisition.csv_layout import CsvOptions
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


def test_an_invalid_sample_of_mdf_is_missing(tmp_path: Path) -> None:
    invalid = np.zeros(500, bool)
    invalid[[3, 4]] = True
    file = MDF(version="4.10")
    file.append([Signal(np.sin(FAST), FAST, "bar", "p", invalidation_bits=invalid)])
    path = Path(file.save(tmp_path / "a.mf4"))
    with path.open("rb") as content:
        channel = open_source("a.mf4", content).channel("p")
    np.testing.assert_allclose(channel.time, FAST)
    np.testing.assert_array_equal(np.isnan(channel.values), invalid)


def test_arrays_of_mdf_are_left_out_and_said(tmp_path: Path) -> None:
    file = MDF(version="4.10")
    pairs = np.rec.fromarrays([np.column_stack([FAST, FAST + 1])], dtype=[("force", "<f8", (2,))])
    file.append([Signal(pairs, FAST, name="force"), Signal(np.sin(FAST), FAST, "bar", "p")])
    with Path(file.save(tmp_path / "a.mf4")).open("rb") as content:
        source = open_source("a.mf4", content)
        assert [entry.name for entry in source.listed()] == ["p"]
        assert source.remarks[1].startswith("arrays are left out: force")


def test_a_file_of_mdf_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    """The records of MDF 3 are moved to the end of the file, where loggers write them, and the last ones are lost."""
    path = mdf(tmp_path / "a.mdf", "3.30")
    content = bytearray(path.read_bytes())
    group = int.from_bytes(content[64 + 4:64 + 8], "little")  # of the header; its fifth link leads to the records
    records = int.from_bytes(content[group + 16:group + 20], "little")
    moved = len(content).to_bytes(4, "little")
    content[group + 16:group + 20] = moved
    content += content[records:records + 500 * 18]
    path.write_bytes(content[:-180])
    with path.open("rb") as file:
        source = open_source("a.mdf", file)
        with pytest.raises(BadRecording, match="of its 500 samples: the file is cut off"):
            source.channel("p")


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
        assert "'testobject' is an object of the MATLAB class inline" in open_source("a.mat", file).remarks[1]
    memory = io.BytesIO()
    with h5py.File(memory, "w", userblock_size=512) as content:
        content["p"] = np.arange(5.0)
        content["series"] = np.arange(6, dtype=np.uint32).reshape(1, 6)
        content["series"].attrs["MATLAB_class"] = np.bytes_("timeseries")
        content["series"].attrs["MATLAB_object_decode"] = np.int32(3)
    written = b"MATLAB 7.3 MAT-file".ljust(128) + memory.getvalue()[128:]
    source = open_source("a.mat", opened(written))
    assert [one.name for one in source.listed()] == ["p"]
    assert source.remarks[1].startswith("'series' is an object of the MATLAB class timeseries")
    for asked in ("series", "series.Data"):
        with pytest.raises(BadRecording, match=r"'series' of a.mat is an object of the MATLAB class timeseries"):
            source.channel(asked)
    memory = io.BytesIO()
    savemat(memory, {"p": np.arange(5.0)})
    assert open_source("a.mat", opened(memory.getvalue())).remarks == ("MATLAB 5 to 7",)


@pytest.mark.parametrize("rows", [
    "2026-11-02T14:03:11.25Z;1\n2026-11-02T14:03:11.75Z;2", "2026-11-02 14:03:11.250;1\n2026-11-02 14:03:11.750;2",
    "02.11.2026 14:03:11,25;1\n02.11.2026 14:03:11,75;2", "9:59:59.75;1\n10:00:00.25;2",
    "2026-11-02 23:59:59.8;1\n2026-11-03 00:00:00.3;2", "23:59:59.8;1\n00:00:00.3;2",
    "2026-10-25T02:59:59.5+02:00;1\n2026-10-25T02:00:00+01:00;2"])
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
    (b"t;p\n1;2\n2;3;4\n", "Row 3 of a.csv has 3 cells, and the others 2"),
    (b"t;p;c;\n0;1.5;2;\n1;2.53;\n2;3;4;\n", "Row 3 of a.csv has 3 cells, and the others 4"),
    (b"t;p;c;\n0;1.5;2;\n1;2;.53;4;\n2;3;4;\n", "Row 3 of a.csv has 5 cells, and the others 4"),
    (b"t;p#0;1.5\n1;2.5\n2;3.5\n3;4.5\n", "a.csv has no row of 2 column names"),
    (b"t;p\n" + b"0;1.5\n" * 200 + b"1;\0.5\n2;3\n", "Row 202 of a.csv contains characters of value 0"),
    (b"t;p\n2026-11-02T01:59:59;1\n2026-11-02T03:00:00+02:00;2\n", "is not a date with a time, as in the first"),
    (b"t;p;p\n1;2;3\n2;3;4\n", "a.csv has 2 channels 'p'"),
    (b"t;p\n1;2\n#2;3\n3;4\n", "Row 3 of a.csv, column 't': '#2' is not a number"),
    (b"t;p\n1;2\n2;3 # disturbed\n3;4\n", "Row 3 of a.csv, column 'p': '3 # disturbed' is not a number"),
    (b"t;p\n1;2\n2;1.#QNAN0\n3;4\n", "Row 3 of a.csv, column 'p': '1.#QNAN0' is not a number"),
    (b"t;p\n1;2,5\n2;1.000\n3;0,5\n", "Row 3 of a.csv, column 'p': '1.000' is not a number"),
    (b"t;p\n1;2.5\n2;1,000\n3;0.5\n", "Row 3 of a.csv, column 'p': '1,000' is not a number"),
    (b"t;p\n1;2.5\n2;1_000\n3;0.5\n", "Row 3 of a.csv, column 'p': '1_000' is not a number"),
    (b"t;p\n1;2.5\n2;1e400\n3;0.5\n", "Row 3 of a.csv, column 'p': '1e400' is not a number"),
    (b"t;p\nERR;2\n2;3\n3;4\n", "Row 2 of a.csv, column 't': 'ERR' is not a number"),
    (b"1;2\n2;3\n", "a.csv has no row of 2 column names"),
    (b"nothing here\n", "a.csv has no rows of two or more numbers"),
    (b"\x7fELF\0\0\0\0", "a.csv is none of MDF, MATLAB, Parquet and text"),
    (b"MDF     4.10" + b"\xff" * 600, "a.csv cannot be read as MDF"),
    (b"PAR1" + b"\xff" * 600 + b"PAR1", "a.csv cannot be read as Parquet"),
    (b"MATLAB 5.0 MAT-file" + b"\0" * 109 + b"\xff" * 500, "a.csv cannot be read as a MATLAB file")])
def test_wrong_content_names_file_row_and_remedy(content: bytes, says: str) -> None:
    def read() -> None:
        source = open_source("a.csv", opened(content))
        for name in ("t", "p"):
            source.channel(name)

    with pytest.raises(BadRecording) as error:
        read()
    assert says in error.value.cause
    assert error.value.remedy


@pytest.mark.parametrize("heading", [
    "t;p\n", "sep=;\nt;p\n", "Bench 3\n\nt;p\n", "t;p\n\n", "t;p;;\n", "s;bar\nt;p\n", "t;p\ns;bar\n\n",
    "t;p\ns;bar\nfloat;float\n", "t;p\ns;bar\nTime;Clutch pressure\n", "t;p\n;bar\n", "t;p\n;clutch\n"])
def test_csv_rows_above_the_numbers(heading: str) -> None:
    source = open_source("a.csv", opened(f"{heading}0.5;2\n1;3\n1.5;4\n".encode()))
    assert [entry.name for entry in source.listed()] == ["t", "p"]
    np.testing.assert_array_equal(source.channel("t").values, [0.5, 1, 1.5])
    assert source.channel("p").unit == ("bar" if "bar" in heading else "")


def test_csv_row_that_counts_the_columns_is_no_sample() -> None:
    source = open_source("a.csv", opened(b"t;p;n\ns;bar;rpm\n1;2;3\n0.1;5.5;6.5\n0.2;7.5;8.5\n"))
    np.testing.assert_array_equal(source.channel("t").values, [0.1, 0.2])
    assert source.remarks[-1] == "row 3 counts the columns, and is left out"
    source = open_source("a.csv", opened(b"t;p;n\n1;2;3\n2;5.5;6\n3;7;8\n"))  # here it may be one
    np.testing.assert_array_equal(source.channel("t").values, [1, 2, 3])


@pytest.mark.parametrize(("text", "name", "times"), [
    ("t;a;b\n0;1;-\n0.1;3.5;1\n0.2;3.5;1\n", "a", [0, 0.1, 0.2]),
    ("t;a;b\ns;bar;Nm\n0;ERR;\n1;2;3\n2;3;3\n3;4;3\n", "b", [0, 1, 2, 3]),
    ("t [s];a [bar];b\n0;--;--\n0.1;--;--\n0.2;3;1\n0.3;4;1\n", "t", [0, 0.1, 0.2, 0.3]),
    ("t;a;b;c\n0;1;2;1.#QNAN\n0.1;3;2;1.#QNAN\n0.2;3.5;1;5\n", "b", [0, 0.1, 0.2]),
    ("t;1;2\n0;1.5;2\n1;2.5;3\n", "1", [0, 1]), ("Date;2024-05-01\nt;a\n0;1.5\n0.1;2.5\n", "a", [0, 0.1]),
    ("s;;;A\nt;M1;M;x1\n0;1.5;2;1\n0.1;2.5;3;1\n", "x1", [0, 0.1]),
    ("t\tq\n" + "".join(f"{row},5\t{'1,5' if row < 6 else ''}\n" for row in range(9)), "q", list(np.arange(9) + 0.5))])
def test_no_row_with_numbers_is_taken_for_a_heading(text: str, name: str, times: list[float]) -> None:
    source = open_source("a.csv", opened(text.encode()))
    np.testing.assert_array_equal(source.channel("t").values, times)
    assert len(source.channel(name).values) == len(times)


@pytest.mark.parametrize(("rows", "values"), [
    ("1;2;OK\n2;3;OK\n3;4;stop", [2, 3, 4]), ("1;2;\n2;3;\n3;4;shift", [2, 3, 4]),
    ("1;2;2012-01-01\n2;3;2012-01-01\n", [2, 3]), ("1;2;10:00:01 AM\n2;3;10:00:02 AM", [2, 3]),
    ("1;2;\n;;\n2;3;\n", [2, 3]), ("1;2;\n2;3;\n;;\n;;\n", [2, 3]), ("1;2;;\n2;3;;\n", [2, 3]),
    ("1;;\n2;3;\n3;;\n4;5;\n", [np.nan, 3, np.nan, 5])])
def test_csv_columns_that_nobody_needs_and_empty_cells(rows: str, values: list[float]) -> None:
    source = open_source("a.csv", opened(f"t;p;status\n{rows}".encode()))
    np.testing.assert_array_equal(source.channel("p").values, values)
    assert not any("left out" in remark for remark in source.remarks)


def test_csv_text_at_the_end_is_left_out_and_said() -> None:
    source = open_source("a.csv", opened(b"t,p\n1,2\n2,3\n\nEnd of measurement\n"))
    np.testing.assert_array_equal(source.channel("p").values, [2, 3])
    assert source.remarks[1] == "the text from row 4 on, at the end of the file, is left out: 'End of measurement'"


def test_csv_text_column_is_refused_when_it_is_asked_for() -> None:
    source = open_source("a.csv", opened(b"t;p;status\n1;2;OK\n2;3;OK\n"))
    assert [entry.name for entry in source.listed()] == ["t", "p"]
    with pytest.raises(BadRecording, match=r"Row 2 of a.csv, column 'status': 'OK' is not a number"):
        source.channel("status")


def test_csv_cells_in_quotation_marks_have_decimal_commas() -> None:
    source = open_source("a.csv", opened(b't,p,note\n"0,5","2,25","a, b"\n"1,0","3","c"\n'))
    np.testing.assert_array_equal(source.channel("p").values, [2.25, 3])


def test_csv_header_states_the_row_of_names() -> None:
    content = b"who;what;where\nt;p;n\nx;y;z\n1;2;3\n2;3;5\n"
    assert open_source("a.csv", opened(content)).listed()[1].name == "what"
    source = open_source("a.csv", opened(content), CsvOptions(header=2))
    np.testing.assert_array_equal(source.channel("p").values, [2, 3])
    with pytest.raises(BadRecording, match=r"a.csv has 6 rows, and csv.header states row 9"):
        open_source("a.csv", opened(content), CsvOptions(header=9))


def test_lvm_of_labview() -> None:
    text = "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n" \
        "Multi_Headings\tNo\nX_Columns\tOne\nTime_Pref\tAbsolute\nDate\t2026/11/02\nTime\t14:03:11.25\n" \
        "***End_of_Header***\t\n\t\nChannels\t2\t\t\nSamples\t3\t3\t\nDate\t2026/11/02\t2026/11/02\t\n" \
        "Y_Unit_Label\tbar\trpm\t\nX0\t0.0\t0.0\t\nDelta_X\t0.1\t0.1\t\n***End_of_Header***\t\t\t\n" \
        "X_Value\tp\tn\tComment\n" + "".join(f"{row / 10}\t1.5\t{row}\n" for row in range(20))
    source = open_source("a.lvm", opened(text.encode()))
    np.testing.assert_array_equal(source.channel("X_Value").values, np.arange(20) / 10)
    np.testing.assert_array_equal(source.channel("n").values, np.arange(20))


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be"])
def test_utf_16_without_a_byte_order_mark_is_known_and_may_be_stated(encoding: str) -> None:
    content = "t [s];p_oil [bar]\n1;2\n2;3\n".encode(encoding)
    for options in (CsvOptions(), CsvOptions(encoding=encoding)):
        assert open_source("a.csv", opened(content), options).channel("p_oil").values.tolist() == [2, 3]


def test_csv_is_read_alike_with_and_without_a_cell_of_text() -> None:
    """The quick reader of numpy reads what the grammar of a cell reads: a cell of text switches it off."""
    draw = np.random.default_rng(4)
    written = ["1", "-2.5", "+3", ".5", "4.", "1e3", "2.5E-02", "007", "-0", "0.1", "123456789.123456789"]
    for separator, decimal in ((";", "."), (";", ","), ("\t", "."), (",", ".")):
        cells = draw.choice(written, (50, 3))
        rows = [separator.join(row).replace(".", decimal) for row in cells]
        quick = open_source("a.csv", opened("\n".join([separator.join("abc"), *rows]).encode()))
        slow = open_source("a.csv", opened("\n".join([separator.join(["a", "b", "c", "note"]), *(
            f"{row}{separator}x" for row in rows)]).encode()))
        for column, name in enumerate("abc"):
            expected = [float(cell) for cell in cells[:, column]]
            np.testing.assert_array_equal(quick.channel(name).values, expected)
            np.testing.assert_array_equal(slow.channel(name).values, expected)


NAMES = [
    (["t [s]", "M (raw)", "M (filtered)"], ["t", "M (raw)", "M (filtered)"], ["s", "", ""]),
    (["t [s]", "M [N m]", "M [lbf ft]"], ["t", "M [N m]", "M [lbf ft]"], ["s", "N m", "lbf ft"]),
    (["t", "M[0]", "M[1]"], ["t", "M[0]", "M[1]"], ["", "", ""]),
    (["t", "mu [1]", "M"], ["t", "mu", "M"], ["", "1", ""]),
    (["t", "M", "M"], ["t", "M@2", "M@3"], ["", "", ""]),
    (["t", "p (min)", "p (max)"], ["t", "p (min)", "p (max)"], ["", "min", ""]),
    (["t", "p (front) [bar]", "p (rear) [bar]"], ["t", "p (front)", "p (rear)"], ["", "bar", "bar"]),
    (["t (ms)", "n (Motor)", "p [barg]"], ["t", "n (Motor)", "p [barg]"], ["ms", "", ""])]


@pytest.mark.parametrize(("headings", "names", "units"), NAMES)
@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_every_channel_has_a_name_of_its_own(form: str, headings: list[str], names: list[str],
                                             units: list[str]) -> None:
    columns = [np.arange(3.0), np.arange(3.0) + 10, np.arange(3.0) + 20]
    if form == "csv":
        rows = ["\t".join(map(str, row)) for row in zip(*columns, strict=True)]
        content = "\n".join(["\t".join(headings), *rows]).encode()
    else:
        memory = io.BytesIO()
        pq.write_table(pa.Table.from_arrays([pa.array(values) for values in columns], names=headings), memory)
        content = memory.getvalue()
    source = open_source("a", opened(content))
    assert [(entry.name, entry.unit) for entry in source.listed()] == list(zip(names, units, strict=True))
    for name, heading, values in zip(names, headings, columns, strict=True):
        np.testing.assert_array_equal(source.channel(name).values, values)
        if headings.count(heading) == 1:
            np.testing.assert_array_equal(source.channel(heading).values, values)
    if names[1][0] == "M":
        with pytest.raises(BadRecording, match=r"a has 2 channels 'M'") as error:
            source.channel("M")
        assert names[1] in error.value.remedy


def test_a_name_twice_in_one_group_of_mdf(tmp_path: Path) -> None:
    file = MDF(version="4.10")
    file.append([Signal(np.sin(FAST), FAST, "Nm", "M"), Signal(np.cos(FAST), FAST, "Nm", "M")])
    with Path(file.save(tmp_path / "a.mf4")).open("rb") as content:
        source = open_source("a.mf4", content)
        assert [entry.name for entry in source.listed()] == ["M@0.1", "M@0.2"]
        np.testing.assert_allclose(source.channel("M@0.1").values, np.sin(FAST))
        np.testing.assert_allclose(source.channel("M@0.2").values, np.cos(FAST))
        with pytest.raises(BadRecording, match=r"a.mf4 has 2 channels 'M'"):
            source.channel("M")


@pytest.mark.parametrize(("code", "says"), [
    (1, ""), (2, "the master 'time' of its group 0 is an angle"), (3, "the master 'time' of its group 0 is a distance"),
    (4, "the master 'time' of its group 0 is an index"), (0, "its group 0 has no master channel")])
def test_the_master_of_mdf_must_be_a_time(tmp_path: Path, code: int, says: str) -> None:
    file = MDF(version="4.10")
    file.append([Signal(np.sin(FAST), FAST, "bar", "p")])
    file.groups[0].channels[0].sync_type = code
    if code == 0:
        file.groups[0].channels[0].channel_type = 0  # a channel as any other
    with Path(file.save(tmp_path / "a.mf4")).open("rb") as content:
        source = open_source("a.mf4", content)
        channel = source.channel("p")
        assert channel.no_time == says
        assert (channel.time is None) == (code != 1)
        if code != 1:
            np.testing.assert_allclose(source.channel("time").values, FAST)


def test_numbers_that_mdf_translates_to_text_are_read_as_numbers(tmp_path: Path) -> None:
    file = MDF(version="4.10")
    texts = {"val_0": 0, "text_0": b"OFF", "val_1": 1, "text_1": b"ON"}
    file.append([Signal((FAST > 0.1).astype(np.uint8), FAST, "", "request", conversion=texts)])
    with Path(file.save(tmp_path / "a.mf4")).open("rb") as content:
        channel = open_source("a.mf4", content).channel("request")
    np.testing.assert_array_equal(channel.values, FAST > 0.1)
    assert channel.note == "the file translates its numbers to text, and the numbers are used"


def test_structures_in_arrays_and_cells_of_matlab() -> None:
    signals = np.zeros((1, 2), dtype=[("values", "O"), ("label", "O")])
    signals[0, 0], signals[0, 1] = (np.sin(FAST)[:, None], "p"), (np.cos(FAST)[:, None], "n")
    cells = np.empty((1, 2), object)
    cells[0, 0], cells[0, 1] = FAST, "text"
    memory = io.BytesIO()
    savemat(memory, {"scope": {"time": FAST, "signals": signals}, "c": cells})
    source = open_source("a.mat", opened(memory.getvalue()))
    assert {entry.name for entry in source.listed()} == {
        "scope.time", "scope.signals(1).values", "scope.signals(2).values", "c{1}"}
    np.testing.assert_array_equal(source.channel("scope.signals(2).values").values, np.cos(FAST))


def test_structures_in_arrays_and_cells_of_matlab_7_3() -> None:
    memory = io.BytesIO()
    with h5py.File(memory, "w", userblock_size=512) as file:
        elements = file.create_group("#refs#")
        elements["a"], elements["b"] = np.sin(FAST)[None], np.cos(FAST)[None]
        for place in ("scope/signals/values", "c"):
            references = file.create_dataset(place, (2, 1), h5py.ref_dtype)
            references[0, 0], references[1, 0] = elements["a"].ref, elements["b"].ref
        file["scope/signals"].attrs["MATLAB_class"] = np.bytes_("struct")
        file["c"].attrs["MATLAB_class"] = np.bytes_("cell")
        file["soft"] = h5py.SoftLink("/c")
        file.create_dataset("circle", (1,), h5py.ref_dtype)
        file["circle"][0] = file["circle"].ref
        file["circle"].attrs["MATLAB_class"] = np.bytes_("cell")
    content = b"MATLAB 7.3 MAT-file".ljust(128) + memory.getvalue()[128:]
    source = open_source("a.mat", opened(content))
    assert {entry.name for entry in source.listed()} == {
        "scope.signals(1).values", "scope.signals(2).values", "c{1}", "c{2}"}
    np.testing.assert_array_equal(source.channel("scope.signals(2).values").values, np.cos(FAST))


def test_parquet_without_rows_or_with_a_missing_time() -> None:
    memory = io.BytesIO()
    times = np.array(["NaT", 1000, 1500], "M8[ms]")
    pq.write_table(pa.table({"at": times, "p": [1.0, 2.0, 3.0]}), memory)
    np.testing.assert_array_equal(open_source("a.parquet", opened(memory.getvalue())).channel("at").values,
                                  [np.nan, 0, 0.5])
    memory = io.BytesIO()
    pq.write_table(pa.table({"at": times[:0], "p": np.zeros(0)}), memory)
    with pytest.raises(BadRecording, match=r"a.parquet has no rows"):
        open_source("a.parquet", opened(memory.getvalue()))


def test_a_log_of_bus_messages_must_be_decoded_first(tmp_path: Path) -> None:
    file = MDF(version="4.10")
    file.append([Signal(np.arange(500, dtype=np.uint32), FAST, "", "CAN_DataFrame.ID")])
    with Path(file.save(tmp_path / "a.mf4")).open("rb") as content, pytest.raises(
            BadRecording, match=r"a log of bus messages that are not decoded. Decode it with the DBC"):
        open_source("a.mf4", content).channel("TurbineSpeed")


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
