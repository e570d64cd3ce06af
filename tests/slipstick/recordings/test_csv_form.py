import re
import textwrap
from dataclasses import replace

import numpy as np
import pytest

from slipstick.errors import BadRecording
from slipstick.recordings import Recordings, open_conditions
from tests.benches import COMPACT, HEAVY

COLUMNS = ["current_profile", "motor_speed [rad/s]", "load_inertia [kg m^2]", "brake_torque [N m]", "shifting_time [s]"]
SIGNALS = ["condition", "time [s]", "pressure [bar]", "input_speed [rad/s]", "output_speed [rad/s]",
           "output_torque [N m]"]
PROFILES = HEAVY.profiles


def sheet(columns, rows, description=""):
    return (description + "\n".join(",".join(map(str, row)) for row in [columns, *rows]) + "\n").encode()


def rows_of(recordings, count=216):
    conditions = recordings.conditions
    columns = (conditions.current_profile, conditions.motor_speed, conditions.load_inertia, conditions.brake_torque,
               recordings.measured_time)
    return [list(row) for row in zip(*(column[:count].tolist() for column in columns), strict=True)]


def signal_rows(recordings, count, samples):
    signals = recordings.signals
    return [[condition, signals.time[k], *(float(getattr(signals, name)[condition, k]) for name in
                                          ("pressure", "input_speed", "output_speed", "output_torque"))]
            for condition in range(count) for k in range(samples)]


def test_shipped_recordings_are_the_same_in_csv(shipped, tmp_path):
    conditions = replace(shipped.conditions.take(range(0, 216, 9)), run_order=np.random.default_rng(1).permutation(24))
    shipped = replace(shipped.take(np.arange(0, 216, 9)), conditions=conditions,
                      run_order=conditions.run_order)
    (tmp_path / "bench.csv").write_bytes(sheet([*COLUMNS, "run_order"], [
        [*row, order] for row, order in zip(rows_of(shipped), shipped.run_order, strict=True)], "# A bench, in May\n"))
    (tmp_path / "signals.csv").write_bytes(sheet(SIGNALS, signal_rows(shipped, 24, 1001)))
    read = Recordings.open(tmp_path / "bench.csv", tmp_path / "signals.csv", PROFILES)
    assert read.digest == shipped.digest
    assert np.array_equal(read.conditions.run_order, shipped.run_order)
    assert read.description == "A bench, in May"
    assert open_conditions(tmp_path / "bench.csv", PROFILES).digest == shipped.conditions.digest


def test_columns_may_have_any_order_and_signals_are_optional(shipped):
    rows = rows_of(shipped, 5)
    content = b"\xef\xbb\xbf" + sheet(COLUMNS[::-1], [row[::-1] for row in rows])
    read = Recordings.read(content, "csv", profiles=PROFILES)
    assert read.digest == Recordings.read(sheet(COLUMNS, rows), "csv", profiles=PROFILES).digest
    assert (len(read), read.signals, read.run_order) == (5, None, None)


def test_conditions_are_read_without_shifting_times(tmp_path):
    (tmp_path / "plan.csv").write_bytes(sheet(COLUMNS[:4], [[0, 100.0, 6, 20], [5, 150.0, 14, 0]]))
    assert open_conditions(tmp_path / "plan.csv", PROFILES).brake_torque.tolist() == [20, 0]


def test_columns_may_have_any_unit_of_their_dimension(shipped):
    rows = rows_of(shipped, 5)
    headings = [COLUMNS[0], "motor_speed [rpm]", "load_inertia [kg cm^2]", "brake_torque [kN m]", "shifting_time [ms]"]
    other = [[row[0], row[1] * 30 / np.pi, row[2] * 1e4, row[3] / 1e3, row[4] * 1e3] for row in rows]
    read = Recordings.read(sheet(headings, other), "csv", profiles=PROFILES)
    np.testing.assert_allclose(rows_of(read, 5), rows, rtol=1e-12)


def test_profiles_are_those_of_the_bench(shipped):
    content = sheet(COLUMNS, rows_of(shipped, 5))
    with pytest.raises(BadRecording, match=r"do not contain their current profiles\. Give the bench"):
        Recordings.read(content, "csv")
    with pytest.raises(BadRecording, match=r"exceeds the 1\.8 s of the current profile"):
        Recordings.read(sheet(COLUMNS, [[0, 100.0, 6, 20, 1.9]]), "csv", profiles=COMPACT.profiles)
    other = Recordings.read(content, "csv", profiles=COMPACT.profiles)
    assert other.digest != Recordings.read(content, "csv", profiles=PROFILES).digest


@pytest.mark.parametrize(("row", "column", "cell", "message"), [
    (3, 1, "fast", r"Row 5, column 'motor_speed \[rad/s\]': 'fast' is not a finite number. .*leave out the row"),
    (3, 4, "", r"Row 5, column 'shifting_time \[s\]': the cell is empty"),
    (0, 4, "nan", r"Row 2, column 'shifting_time \[s\]': 'nan' is not a finite number"),
    (1, 2, "inf", r"Row 3, column 'load_inertia \[kg m\^2\]': 'inf' is not"),
    (4, 4, 1520, r"Row 6, column 'shifting_time \[s\]': 1520 exceeds the 3.5 s"),
    (4, 4, -1, r"Row 6, column 'shifting_time \[s\]': -1 is not positive"),
    (2, 1, 0, r"Row 4, column 'motor_speed \[rad/s\]': 0 is not positive"),
    (2, 3, -5, r"Row 4, column 'brake_torque \[N m\]': -5 is negative"),
    (2, 0, 6, "Row 4, column 'current_profile': 6 is not the number of a current profile of the bench"),
    (2, 0, 1.5, "Row 4, column 'current_profile': 1.5 is not an integer"),
    (2, 0, "1,1", "Row 4 has 6 cells for 5 columns"),
])
def test_errors_name_row_and_column(shipped, row, column, cell, message):
    rows = rows_of(shipped, 5)
    rows[row][column] = cell
    with pytest.raises(BadRecording, match=message):
        Recordings.read(sheet(COLUMNS, rows), "csv", profiles=PROFILES)


def test_a_refused_number_of_another_unit_is_said_in_that_of_the_model(shipped):
    rows = rows_of(shipped, 2)
    rows[1][4] = 5000
    with pytest.raises(BadRecording, match=r"column 'shifting_time \[ms\]': 5 s exceeds .* in the unit of the column"):
        Recordings.read(sheet([*COLUMNS[:4], "shifting_time [ms]"], rows), "csv", profiles=PROFILES)


@pytest.mark.parametrize(("columns", "message"), [
    (COLUMNS[:4], r"The column 'shifting_time \[s\]' is missing"),
    ([*COLUMNS[:4], "shifting_tme [s]"], r"'shifting_tme \[s\]' is unknown\. Did you mean 'shifting_time \[s\]'"),
    ([*COLUMNS[:4], "shifting_time"], r"the unit is missing; the model uses s\. Write the unit of its numbers"),
    ([*COLUMNS[:4], "shifting_time [bar]"], r"'bar' cannot be converted to s .*State the unit"),
    (["current_profile", "motor_speed [1/min]", *COLUMNS[2:]], r"which angle.*Write rpm .* in its place if it counts "
     r"revolutions, .* or convert the numbers to rad/s"),
    (["current_profile", "motor_spd [rpm]", *COLUMNS[2:]], r"Did you mean 'motor_speed \[rpm\]'"),
    ([*COLUMNS, COLUMNS[0]], "'current_profile' appears more than once"), ([";".join(COLUMNS)], "by commas"),
])
def test_columns_are_identified_by_name_and_unit(shipped, columns, message):
    with pytest.raises(BadRecording, match=message):
        Recordings.read(sheet(columns, rows_of(shipped, 2)), "csv", profiles=PROFILES)


@pytest.mark.parametrize(("content", "message"), [
    (b"", "no row of column names"), (b"# only a description\n", "no row of column names"),
    (sheet(COLUMNS, []), "recordings file has no rows of numbers"),
    (b"\xff\xfe\x00", "Byte 0 of the recordings file is not valid UTF-8"), (b'"open', "not valid CSV"),
    (sheet(COLUMNS, [["9" * 200_000, 1, 1, 1, 1]]), "Row 1 is not valid CSV|Row 2 is not valid CSV"),
])
def test_invalid_csv_is_rejected(content, message):
    with pytest.raises(BadRecording, match=message):
        Recordings.read(content, "csv", profiles=PROFILES)


def swap_samples(rows):
    rows[1], rows[2] = rows[2], rows[1]


def decreasing_times(rows):
    for row in rows:
        row[1] = -row[1]


def other_times(rows):
    rows[6][1] += 1e-6


def swap_conditions(rows):
    rows[4:8], rows[8:12] = rows[8:12], rows[4:8]


def empty_cell(rows):
    rows[5][2] = ""


@pytest.mark.parametrize(("damage", "message"), [
    (swap_samples, r"Row 7, column 'time \[s\]': 0\.002 instead of 0\.004"),
    (other_times, r"Row 8, column 'time \[s\]'"),
    (decreasing_times, "time of the signals does not increase at sample 1"),
    (swap_conditions, "Row 6, column 'condition': 2 instead of 1"),
    (empty_cell, r"Row 7, column 'pressure \[bar\]': the cell is empty"),
    (lambda rows: rows.pop(), "11 rows, 4 of them of condition 0, for 3 conditions"),
    (lambda rows: rows.clear(), "signals file has no rows of numbers"),
])
def test_errors_of_signals_name_row_and_column(shipped, damage, message):
    rows = signal_rows(shipped, 3, 4)
    intact = sheet(SIGNALS, rows)
    damage(rows)
    recordings = sheet(COLUMNS, rows_of(shipped, 3))
    with pytest.raises(BadRecording, match=message):
        Recordings.read(recordings, "csv", sheet(SIGNALS, rows), PROFILES)
    signals = Recordings.read(recordings, "csv", intact, PROFILES).signals
    assert np.array_equal(signals.pressure, shipped.signals.pressure[:3, :4])


def test_the_examples_of_the_readme_are_valid_recordings(shipped_file):
    blocks = re.findall(r"(?:^    .*\n)+", (shipped_file.parent / "README.md").read_text(), re.MULTILINE)
    recordings, signals = (textwrap.dedent(block).encode() for block in blocks if "," in block)
    read = Recordings.read(recordings, "csv", signals, PROFILES)
    assert read.description == "Bench 2, oil at 80 degrees"
    assert read.signals.output_torque.tolist() == [[0.3, 0.1], [0.2, -0.1]]
