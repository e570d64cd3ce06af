"""Current profiles and conditions of a bench file: inline, as CSV beside it, of any lengths."""

from pathlib import Path

import numpy as np
import pytest

from slipstick.bench import Bench
from slipstick.bench.experiments import read_profiles, stacked
from slipstick.bench.reader import read
from slipstick.errors import BadBench, InvalidValue
from slipstick.recordings import Recordings
from tests.benches import COMPACT, TABLES

TEXT = (TABLES / "compact.toml").read_text()
HEAD = TEXT[:TEXT.index("# Every profile meets")]
FILES = HEAD + '[profiles]\nfile = "profiles.csv"\n\n[conditions]\nfile = "conditions.csv"\n'


def profiles_csv(factor: float = 1.0, unit: str = "s") -> str:
    time, current = COMPACT.profiles
    rows = [f"{p},{float(t * factor)!r},{i!r}" for p in range(len(time))
            for t, i in zip(time[p], current[p].tolist(), strict=True)]
    return "\n".join([f"profile,time [{unit}],current [A]", *rows]) + "\n"


def conditions_csv() -> str:
    c = COMPACT.conditions
    rows = [f"{p},{float(w * 30 / np.pi)!r},{j},{b}" for p, w, j, b in
            zip(c.current_profile, c.motor_speed, c.load_inertia, c.brake_torque, strict=True)]
    return "\n".join(["current_profile,motor_speed [rpm],load_inertia [kg m^2],brake_torque [N m]", *rows]) + "\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "bench").mkdir()
    (tmp_path / "bench" / "profiles.csv").write_text("# measured in May\n" + profiles_csv())
    (tmp_path / "bench" / "conditions.csv").write_text(conditions_csv())
    (tmp_path / "bench" / "compact.toml").write_text(FILES)
    return tmp_path / "bench"


def test_csv_files_give_the_same_bench_as_values_inline(folder: Path) -> None:
    bench = Bench.open(folder / "compact.toml")
    assert bench.conditions.digest == COMPACT.conditions.digest
    assert bench.digest == COMPACT.digest
    (folder / "profiles.csv").write_text(profiles_csv(1e3, "ms"))
    assert Bench.open(folder / "compact.toml").conditions.digest == COMPACT.conditions.digest


def test_a_run_order_may_stand_in_the_conditions(folder: Path) -> None:
    lines = conditions_csv().splitlines()
    order = np.random.default_rng(1).permutation(len(lines) - 1)
    with_order = [f"{lines[0]},run_order", *(f"{line},{k}" for line, k in zip(lines[1:], order, strict=True))]
    (folder / "conditions.csv").write_text("\n".join(with_order) + "\n")
    read_order = Bench.open(folder / "compact.toml").conditions.run_order
    assert read_order is not None
    np.testing.assert_array_equal(read_order, order)


@pytest.mark.parametrize(("name", "content", "key", "says"), [
    ("profiles.csv", profiles_csv().replace("0.06,", "0.001,", 1), "conditions", "do not rise strictly from 0"),
    ("profiles.csv", profiles_csv().replace("0,0.0,0.15", "0,0.001,0.15", 1), "conditions", "rise strictly from 0"),
    ("profiles.csv", "profile,time [s],current [A]\n0,0,0.1\n0,1,0.1\n2,0,0.1\n2,1,0.1\n", "profiles.file",
     "profiles.csv: The profiles are not numbered 0, 1, 2"),
    ("profiles.csv", "profile,time [s],current [A]\n0,0,0.1\n", "profiles.file", "fewer than two breakpoints"),
    ("profiles.csv", "profile,time [s],current [V]\n0,0,0.1\n", "profiles.file", "'V' cannot be converted to A"),
    ("profiles.csv", "profile,time [s]\n0,0\n", "profiles.file", r"'current \[A\]' is missing"),
    ("profiles.csv", "profile,time [s],current [A]\n0,0,fast\n", "profiles.file", "Row 2, column 'current"),
    ("conditions.csv", conditions_csv().replace("\n0,", "\n7,", 1), "conditions", "beyond the 5 profiles"),
    ("conditions.csv", conditions_csv().replace("[rpm]", "[bar]"), "conditions.file", "'bar' cannot be converted"),
    ("conditions.csv", conditions_csv().replace("brake_torque", "brake"), "conditions.file", "'brake .* is unknown"),
    ("conditions.csv", conditions_csv().replace("\n0,", "\n0.5,", 1), "conditions.file", "0.5 is not an integer"),
])
def test_errors_name_the_key_and_the_row(folder: Path, name: str, content: str, key: str, says: str) -> None:
    (folder / name).write_text(content)
    with pytest.raises(BadBench, match=rf"compact\.toml, line \d+, {key}: .*{says}"):
        Bench.open(folder / "compact.toml")


@pytest.mark.parametrize(("file", "says"), [
    ("../outside.csv", "lies outside the folder"), ("/etc/passwd", "lies outside the folder"),
    (".", "there is no file"), ("missing.csv", "there is no file 'missing.csv'"), ("link.csv", "lies outside"),
])
def test_files_lie_beside_the_bench(folder: Path, file: str, says: str) -> None:
    (folder.parent / "outside.csv").write_text(profiles_csv())
    (folder / "link.csv").symlink_to(folder.parent / "outside.csv")
    (folder / "compact.toml").write_text(FILES.replace("profiles.csv", file))
    with pytest.raises(BadBench, match=rf"line \d+, profiles.file: .*{says}"):
        Bench.open(folder / "compact.toml")
    # An upload has no folder, and may refer to no file at all.
    with pytest.raises(BadBench, match="an uploaded bench cannot refer to other files"):
        read(FILES.replace("profiles.csv", file).encode(), "compact.toml")


def test_profiles_of_different_lengths_keep_their_currents() -> None:
    rng = np.random.default_rng(3)
    ragged = []
    for k in (2, 3, 7, 40):
        time = np.concatenate([[0.0], np.cumsum(rng.uniform(0.01, 0.3, k - 1))])
        ragged.append((time, rng.uniform(0, 1, k)))
    times, currents = stacked(ragged)
    assert times.shape == currents.shape == (4, 40)
    assert np.all(np.diff(times, axis=1) > 0)
    for (time, current), whole, padded in zip(ragged, times, currents, strict=True):
        assert whole[-1] == time[-1]
        assert set(time) <= set(whole)  # every breakpoint is kept
        fine = np.linspace(0, time[-1], 2001)
        np.testing.assert_allclose(np.interp(fine, whole, padded), np.interp(fine, time, current), atol=1e-12)
    with pytest.raises(InvalidValue, match="fewer than two breakpoints"):
        stacked([(np.zeros(1), np.zeros(1))])


def test_profiles_of_a_file_may_differ_in_length() -> None:
    csv = b"profile,time [ms],current [mA]\n0,0,100\n0,500,700\n1,0,100\n1,20,300\n1,900,300\n"
    time, current = read_profiles(csv, {})
    np.testing.assert_allclose(time, [[0, 0.25, 0.5], [0, 0.02, 0.9]])
    np.testing.assert_allclose(current, [[0.1, 0.4, 0.7], [0.1, 0.3, 0.3]])


def test_a_bench_without_a_converter_states_its_input_torque() -> None:
    without = TEXT[:TEXT.index("[converter]")] + TEXT[TEXT.index("# Standard deviation of the noise"):]
    with pytest.raises(BadBench, match=r"conditions\.input_torque: the key is missing"):
        read(without.encode(), "my.toml")
    given = without.replace("[conditions]\n", '[conditions]\ninput_torque = { values = [30, 45], unit = "N m" }\n'
                            'initial_input_speed = { values = [1200], unit = "rpm" }\n')
    bench = read(given.encode(), "my.toml")
    assert bench.physics.converter is None
    assert len(bench.conditions) == 2 * len(COMPACT.conditions)
    assert bench.conditions.input_torque is not None
    assert bench.conditions.initial_input_speed is not None
    assert set(bench.conditions.input_torque) == {30.0, 45.0}
    np.testing.assert_allclose(bench.conditions.initial_input_speed, 40 * np.pi)


WITHOUT = HEAD[:HEAD.index("[converter]")] + HEAD[HEAD.index("# Standard deviation of the noise"):] + """[conditions]
motor_speed = { values = [1500], unit = "rpm" }
load_inertia = { values = [0.4], unit = "kg m^2" }
brake_torque = { values = [5], unit = "N m" }
initial_input_speed = { values = [1400, 1500], unit = "rpm" }

[[profiles]]
time = { values = [0, 0.5, 1], unit = "s" }
current = { values = [0.2, 0.5, 0.8], unit = "A" }
input_torque = { values = [0.02, 0.03, 0.01], unit = "kN m" }
"""


def test_the_input_torque_of_a_bench_without_a_converter_may_vary_over_the_profile() -> None:
    bench = read(WITHOUT.encode(), "without.toml")
    assert bench.physics.converter is None
    given = bench.conditions.profile_input_torque
    assert given is not None
    np.testing.assert_allclose(given, [[20.0, 30.0, 10.0]])
    assert bench.conditions.input_torque is not None
    assert bench.conditions.input_torque.tolist() == [0.0, 0.0]
    constant = WITHOUT.replace("input_torque = { values = [0.02, 0.03, 0.01]", "# input_torque = { values = [0.02]")
    with pytest.raises(BadBench, match="input_torque: the key is missing"):
        read(constant.encode(), "without.toml")
    with pytest.raises(BadBench, match=r"input_torque.*the key is unknown"):
        read((HEAD + WITHOUT[WITHOUT.index("[conditions]"):].replace("initial_input", "# initial")).encode(), "b.toml")


def test_recordings_keep_an_input_torque_that_varies() -> None:
    bench = read(WITHOUT.encode(), "without.toml")
    recordings = Recordings(bench.conditions, np.array([0.4, 0.5]))
    assert Recordings.read(recordings.to_bytes(), "h5").digest == recordings.digest
    csv = "current_profile,motor_speed [rpm],load_inertia [kg m^2],brake_torque [N m],shifting_time [s]," \
          "input_torque [N m],initial_input_speed [rpm]\n0,1500,0.4,5,0.4,0,1400\n0,1500,0.4,5,0.5,0,1500\n"
    again = Recordings.read(csv.encode(), "csv", profiles=bench.profiles)
    assert again.conditions.digest == recordings.conditions.digest


def test_no_condition_is_a_choice_of_conditions_too() -> None:
    assert len(COMPACT.conditions.take([])) == 0
