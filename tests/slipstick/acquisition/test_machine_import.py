"""Files become runs of any declared machine: cut, in its units, with commands as they were; what is flawed is said."""

import io
import re
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from asammdf import MDF, Signal
from scipy.io import savemat

from slipstick.acquisition import open_source, propose_for_machine, read_machine_mapping
from slipstick.acquisition.mapping import ChannelRef, Standstills
from slipstick.black_box.ranges import simulate_ranges
from slipstick.errors import BadRecording
from slipstick.machine import (
    Block,
    Command,
    Condition,
    Machine,
    Sensor,
    SignalRange,
    read_runs,
    require_runs,
    write_runs,
)
from tests.slipstick.acquisition.sled import DRIVEN, MAP, MOVE, REST, SLED, STANDSTILLS, as_csv, imported, recording

WHOLE = round((REST + MOVE) / 1e-3)  # samples from one standstill to the next
STROKES = '[runs]\ncut = "reversals"\nchannel = "x"\nlevel = 50\n'


def edited(old: str, new: str, text: str = MAP + STANDSTILLS) -> str:
    assert old in text
    return text.replace(old, new)


def as_mat(columns: dict[str, np.ndarray]) -> bytes:
    memory = io.BytesIO()
    savemat(memory, {name: values[:, None] for name, values in columns.items()})
    return memory.getvalue()


def as_mat_7_3(columns: dict[str, np.ndarray]) -> bytes:
    memory = io.BytesIO()
    with h5py.File(memory, "w") as file:
        for name, values in columns.items():
            file.create_dataset(name, data=values[None]).attrs["MATLAB_class"] = np.bytes_("double")
    return memory.getvalue()


def as_parquet(columns: dict[str, np.ndarray]) -> bytes:
    memory = io.BytesIO()
    pq.write_table(pa.table(columns), memory)
    return memory.getvalue()


def as_mdf(columns: dict[str, np.ndarray], path: Path, own: dict[str, np.ndarray] | None = None) -> bytes:
    """The channels but for the time, which is their master; those of `own` have their own instants in s."""
    file = MDF(version="4.10")
    for name, values in columns.items():
        if name != "t":
            file.append([Signal(values, (own or {}).get(name, columns["t"] / 1000), "", name)])
    return Path(file.save(path / "sled.mf4")).read_bytes()


@pytest.mark.parametrize("form", ["csv", "mat", "mat 7.3", "parquet", "mdf"])
def test_runs_of_every_format_have_the_units_of_the_machine(form: str, tmp_path: Path) -> None:
    columns = recording()
    content = {"csv": as_csv, "mat": as_mat, "mat 7.3": as_mat_7_3, "parquet": as_parquet,
               "mdf": lambda given: as_mdf(given, tmp_path)}[form](columns)
    found = imported(open_source("sled", io.BytesIO(content)))
    runs = found.runs
    assert len(runs) == 5
    begins = np.array([round(1000 * begin) for begin in found.begins])
    np.testing.assert_allclose(begins, 1000 * (REST / 2 + np.arange(5) * (REST + MOVE)), atol=10)
    assert WHOLE - 10 < len(runs.time) <= WHOLE
    for row, begin in enumerate(begins):
        inside = slice(begin, begin + len(runs.time))
        np.testing.assert_allclose(runs.signals["speed"][row], columns["v"][inside] / 1000, atol=1e-8)
        np.testing.assert_allclose(runs.signals["position"][row], columns["x"][inside] / 1000, atol=1e-8)
        np.testing.assert_allclose(runs.commands["drive voltage"].at(runs.time)[row], columns["u"][inside], atol=1e-6)
    assert runs.conditions["load"].tolist() == [3.0] * 5
    assert runs.order is not None
    assert runs.order.tolist() == [0, 1, 2, 3, 4]
    again = require_runs(SLED, read_runs(write_runs(runs, SLED)))
    assert again.digest == runs.digest


@pytest.mark.parametrize(("cut", "begins", "end"), [
    ('cut = "standstills"\nchannel = "x"\nwithin = 1\nfor = "0.2 s"', [0.2, 1.6, 3.0, 4.4, 5.8], 1.4),
    ('cut = "standstills"\nchannel = "v"\nbelow = 20\nfor = "0.3 s"\nfrom = "end"', [0.4, 1.8, 3.2, 4.6, 6.0], 1.4),
    ('cut = "reversals"\nchannel = "x"\nlevel = 50', [1.6, 3.0, 4.4], 1.4),
    ('cut = "reversals"\nchannel = "v"\nof = "sign"\nlevel = 50', [1.6, 3.0, 4.4], 1.4),
    ('cut = "reversals"\nchannel = "v"\nof = "sign"\nlevel = 50\ndirection = -1', [1.6, 4.4], 1.4),
    ('cut = "edges"\nchannel = "u"\nabove = 2.5\nlength = "1.3 s"', [0.4, 3.2, 6.0], 1.3),
    ('cut = "edges"\nchannel = "u"\nbelow = -2.5', [1.8, 4.6], 2.8),
    ('cut = "length"\nlength = "2 s"', [0.0, 2.0, 4.0], 2.0)])
def test_every_cut(cut: str, begins: list[float], end: float) -> None:
    found = imported(recording(), text=f"{MAP}[runs]\n{cut}\n")
    slack = 0.25 if "reversals" in cut else 0.02  # a standstill may reverse anywhere in it
    begins_found = found.begins[:len(begins)]
    np.testing.assert_allclose(begins_found, begins, atol=slack)
    assert len(found.runs) + len(found.set_aside) == len(begins)
    assert found.runs.time[-1] == pytest.approx(end, abs=2 * slack)


def test_runs_that_follow_each_other_share_no_sample() -> None:
    columns = recording()
    columns["x"] = np.arange(len(columns["t"])) * 1.0
    found = imported(columns, text=MAP + '[runs]\ncut = "length"\nlength = "100 ms"\n')
    counted = found.runs.signals["position"] * 1000
    np.testing.assert_allclose(counted.ravel(), np.arange(counted.size), atol=1e-6)
    assert counted.shape == (74, 100)


def test_each_file_is_a_run_from_its_first_sample_or_its_start() -> None:
    files = [recording(1, seed=1), recording(2, seed=2)]
    found = imported(*files, text=MAP)
    assert found.labels == ("sled0.csv", "sled1.csv")
    assert found.runs.time[-1] == pytest.approx(1.799)
    assert found.runs.order is None
    started = imported(*files, text=MAP + '[runs]\nstart = { channel = "u", above = 2.5 }\nlength = "1 s"\n')
    np.testing.assert_allclose(started.begins, 0.4, atol=2e-3)
    assert len(started.runs.time) == 1000
    later = imported(*files, text=MAP + '[runs]\nstart = { time = "0.3 s" }\n')
    assert later.begins.tolist() == [0.3, 0.3]
    marked, = imported(*files, recording(3), text=MAP + '[runs]\nstart = { channel = "u", above = 2.5 }\n').set_aside
    assert (marked.label, marked.reason) == ("sled2.csv", "its start is marked 2 times from 0 to 4.599 s")


@pytest.mark.parametrize("late", [0.3, 0.7])
def test_a_run_begins_with_the_first_sample_at_which_all_signals_are_known(late: float) -> None:
    columns = recording(1)
    columns = {**columns, "t": columns["t"] + 1_834_200, "t_bus": columns["t"] + 1_834_200 + late}
    found = imported(columns, text=edited('"x", unit = "mm"', '"x", unit = "mm", time = "t_bus"', MAP))
    assert found.begins.tolist() == pytest.approx([1834.201])
    np.testing.assert_allclose(found.runs.signals["speed"][0] * 1000, columns["v"][1:], atol=1e-6)
    read_late = np.interp(columns["t"][1:], columns["t_bus"], columns["x"])
    np.testing.assert_allclose(found.runs.signals["position"][0] * 1000, read_late, atol=1e-6)


def test_a_held_command_on_its_own_clock_jumps(tmp_path: Path) -> None:
    columns = recording()
    starts = np.flatnonzero(np.diff(columns["u"], prepend=-1.0))
    told = {**columns, "u": columns["u"][starts]}
    file = as_mdf(told, tmp_path, {"u": columns["t"][starts] / 1000})
    held = imported(open_source("sled.mf4", io.BytesIO(file)), text=edited('unit = "V"', 'unit = "V", held = true'))
    profile = held.runs.commands["drive voltage"]
    for row, begin in enumerate(held.begins):
        instants = begin + np.arange(0.0, held.runs.time[-1], 3.7e-3)
        truth = told["u"][np.searchsorted(columns["t"][starts] / 1000, instants + 1e-9, "right") - 1]
        np.testing.assert_allclose(profile.at(instants - begin)[row], truth, atol=1e-9)
    assert "drive voltage: each value is held until the next sample" in held.remarks
    with pytest.raises(BadRecording, match=r"The command 'u' of sled.mf4 has a sample every 500 ms, and") as error:
        imported(open_source("sled.mf4", io.BytesIO(file)))
    assert "held = true" in error.value.remedy


def test_a_command_that_a_logger_holds_is_no_ramp() -> None:
    columns = recording()
    columns["u"] = np.repeat(np.random.default_rng(1).normal(size=len(columns["u"]) // 20 + 1), 20)[:len(columns["u"])]
    found = imported(columns, text=MAP + '[runs]\ncut = "length"\nlength = "2 s"\n')
    between = found.runs.time[:-1] + 0.5e-3
    halfway = found.runs.commands["drive voltage"].at(between)
    kept = np.concatenate([columns["u"][round(1000 * begin):][:len(between)] for begin in found.begins])
    np.testing.assert_allclose(halfway.ravel(), kept, atol=1e-9)


def test_commands_keep_the_samples_of_their_own_clock(tmp_path: Path) -> None:
    columns = recording()
    told = {**columns, "u": columns["u"][3::10]}
    content = as_mdf(told, tmp_path, {"u": columns["t"][3::10] / 1000})
    text = edited('unit = "V"', 'unit = "V", held = false')
    found = imported(open_source("sled.mf4", io.BytesIO(content)), text=text)
    begin, profile = found.begins[1], found.runs.commands["drive voltage"]
    inside = (profile.time[1] >= 0) & (profile.time[1] <= found.runs.time[-1])
    given = columns["t"][3::10] / 1000 - begin
    assert not any("held" in remark for remark in found.remarks)
    np.testing.assert_allclose(profile.time[1][inside], given[(given >= 0) & (given <= found.runs.time[-1])], atol=1e-9)


def jittered(step: float, seed: int = 3) -> dict[str, np.ndarray]:
    """A recording at irregular instants, whose steps are 0.4 to 1.6 times the usual one."""
    fine, noise = recording(), np.random.default_rng(seed)
    time = np.cumsum(step * noise.uniform(0.4, 1.6, round(7.3 / step)))
    return {"t": 1000 * time, **{name: np.interp(1000 * time, fine["t"], fine[name]) for name in "vxu"}}


@pytest.mark.parametrize("step", [1 / 60, 2e-3])
def test_irregular_clocks_are_resampled_and_gaps_are_what_the_mapping_says(step: float) -> None:
    text = MAP + '[runs]\ncut = "length"\nlength = "1.2 s"\n'
    flawed = imported(jittered(step), text=text).set_aside if step > 0.01 else ()
    assert len(flawed) > 3 or step < 0.01
    assert all("has a gap" in entry.reason for entry in flawed)
    found = imported(jittered(step), text=f'{text}[clock]\ngap = "{2 * step} s"\n')
    assert len(found.runs) >= 5
    runs = found.runs
    np.testing.assert_allclose(np.diff(runs.time), step, rtol=0.05)
    fine = recording()
    for row, begin in enumerate(found.begins):
        truth = np.interp(1000 * (begin + runs.time), fine["t"], fine["x"]) / 1000
        np.testing.assert_allclose(runs.signals["position"][row], truth, atol=0.35 * step)
        assert np.isfinite(runs.signals["speed"][row]).all()


def test_rows_that_a_file_lacks_do_not_make_the_clock_slower() -> None:
    lacking = {name: np.delete(values, np.arange(2000, 2100)) for name, values in recording().items()}
    for files in ([lacking], [recording(), lacking]):
        np.testing.assert_allclose(np.diff(imported(*files).runs.time), 1e-3)


def _nan_gap(columns: dict[str, np.ndarray]) -> None:
    columns["v"][2000:2010] = np.nan


def _nan_command(columns: dict[str, np.ndarray]) -> None:
    columns["u"][2000:2010] = np.nan


def _nan_further(columns: dict[str, np.ndarray]) -> None:
    columns["T"] = np.where((columns["t"] > 2000) & (columns["t"] < 2010), np.nan, 20 + columns["t"] / 1000)


def _spike(columns: dict[str, np.ndarray]) -> None:
    columns["x"][2000] = 5000.0


@pytest.mark.parametrize(("flaw", "says"), [
    (_nan_gap, "speed ('v') has a gap from"), (_spike, "position ('x') has a spike from"),
    (_nan_command, "drive voltage ('u') has a gap from"), (_nan_further, "oil ('T') has a gap from")])
def test_a_flawed_run_is_set_aside_with_the_reason(flaw: object, says: str) -> None:
    columns = recording()
    flaw(columns)  # type: ignore[operator]
    text = MAP + STANDSTILLS.replace('"v"', '"x"').replace("below = 20", "within = 1").replace("0.3 s", "0.2 s")
    text += '[further.oil]\nchannel = "T"\nunit = "degC"\n' if "T" in columns else ""
    found = imported(columns, text=text)
    aside, = found.set_aside
    assert aside.label == "sled0.csv, run 1"
    assert re.fullmatch(rf"{re.escape(says)} 0\.(39|40?)\d* to 0\.4\d* s after the begin of the run.*", aside.reason)
    assert found.labels == found.runs.names == tuple(f"sled0.csv, run {number}" for number in (0, 2, 3, 4))
    assert found.runs.order is not None
    assert found.runs.order.tolist() == [0, 1, 2, 3]


def test_short_runs_do_not_shorten_the_others_and_a_length_is_kept() -> None:
    columns = recording()
    columns["b"] = np.isin(np.arange(len(columns["t"])), [*range(0, 7000, 1400), 2000, 2002, 2100]).astype(float)
    columns["b"][0] = 0
    text = MAP + '[runs]\ncut = "edges"\nchannel = "b"\nabove = 0.5\n'
    found = imported(columns, text=text)
    assert [entry.reason for entry in found.set_aside] == [
        "it lasts 0.0015 s, and the runs 0.599 s", "it lasts 0.0975 s, and the runs 0.599 s"]
    short = imported(columns, text=text + 'length = "1 s"\n')
    assert len(short.runs.time) == 1000
    assert len(short.set_aside) == 4
    with pytest.raises(BadRecording, match=r"None of the 7 runs can be used; sled0.csv, run 0: it lasts 0\.\d+ s"):
        imported(columns, text=text + 'length = "9 s"\n')


PLAN = b"file;run;load [kN];order\nsled0.csv;0;0.001;4\nsled0.csv;1;0.002;4\nsled1.csv;0;0.003;1\nsled1.csv;1;0.004;1\n"


def test_constants_come_from_values_names_sheets_and_channels() -> None:
    columns = [{**recording(2, seed), "T": np.full(3200, 20.0 + seed)} for seed in (1, 2)]
    text = edited('load = { value = "3 N" }', 'load = { column = "load" }\nrun_order = { column = "order" }\n'
                  "plan = \"plan.csv\"\npattern = 'sled(?P<n>[0-9])'") + 'begin_as = "time of cut"\n' + """
[further]
sled = { name = "n", unit = "1" }
width = { value = "3 mm", unit = "mm" }
"oil temperature" = { channel = "T", unit = "degC", mean = true }
oil = { channel = "T", unit = "degC" }
"""
    runs = imported(*columns, text=text, plan=PLAN).runs
    np.testing.assert_allclose(runs.conditions["load"], [1, 2, 3, 4])
    assert runs.order is not None
    assert runs.order.tolist() == [2, 3, 0, 1]
    assert runs.channels["sled"].tolist() == [0, 0, 1, 1]
    np.testing.assert_allclose(runs.channels["oil temperature"], [21, 21, 22, 22])
    np.testing.assert_allclose(runs.channels["time of cut"], [0.2, 1.6, 0.2, 1.6], atol=0.02)
    assert runs.channels["oil"].shape == runs.signals["speed"].shape
    assert {name: runs.units[name] for name in runs.channels} == {
        "sled": "1", "width": "mm", "oil temperature": "degC", "oil": "degC", "time of cut": "s"}
    per_file = b"file;load [N];order\nsled0.csv;1;4\nsled1.csv;3;1\n"
    assert imported(*columns, text=text, plan=per_file).runs.conditions["load"].tolist() == [1, 1, 3, 3]
    with pytest.raises(BadRecording, match=r"plan.csv has no row for run 1 of sled1.csv"):
        imported(*columns, text=text, plan=PLAN.rpartition(b"sled1")[0])


def test_a_constant_of_a_matlab_file_is_a_condition() -> None:
    memory = io.BytesIO()
    savemat(memory, {**recording(), "F": 0.004})
    memory.seek(0)
    text = edited('{ value = "3 N" }', '{ channel = "F", unit = "kN" }')
    assert imported(open_source("a.mat", memory), text=text).runs.conditions["load"] == pytest.approx([4.0] * 5)


def test_temperatures_have_another_zero() -> None:
    warm = replace(SLED, sensors=(*SLED.sensors, Sensor("temperature", "K")))
    columns = {**recording(), "T": 20 + np.sin(recording()["t"] / 100)}
    text = edited("[commands]", 'temperature = { channel = "T", unit = "degC" }\n[commands]')
    found = imported(columns, text=text, machine=warm)
    np.testing.assert_allclose(found.runs.signals["temperature"].mean(), 293.15, atol=0.1)


def test_a_channel_that_never_changes_looks_wrong() -> None:
    columns = {**recording(), "u": np.full(len(recording()["t"]), 4.0)}
    assert imported(columns).doubts == (
        "drive voltage ('u') has the same value in all runs, 4 V. Check its channel",)
    assert imported(recording()).doubts == ()




@pytest.mark.parametrize(("old", "new", "says"), [
    ('channel = "v", unit', 'channel = "w", unit', "sled0.csv has no channel 'w'"),
    (', unit = "mm/s"', "", "The channel 'v' of sled0.csv: the unit is missing; the model uses m/s"),
    ("below = 20", "below = 0.001", "No run can be cut from sled0.csv: the channel 'v' has 0 standstills by the level "
                                    "0.001, and lies between -50"),
    ('for = "0.3 s"', 'for = "3 s"', "the channel 'v' has 0 standstills"),
    (STANDSTILLS, STROKES.replace("50", "5000"), "the channel 'x' has 0 reversals by the level 5000"),
    (STANDSTILLS, '[runs]\ncut = "edges"\nchannel = "u"\nabove = 50\n', "'u' of sled0.csv never marks a run: it lies "
                                                                     "between -5 and 5"),
    (STANDSTILLS, '[runs]\ncut = "length"\nlength = "20 s"\n', "from sled0.csv: it is shorter than 20 s"),
    (STANDSTILLS, '[runs]\nlength = "1.5 ms"\n', "The runs last 0.001 s, and the clock has steps of 0.001 s"),
    ('for = "0.3 s"', 'for = "0.3 s"\nstart = { time = "2 s" }', "None of the 5 runs can be used"),
    ("[time]", '[clock]\nstep = "0.1 ms"\n[time]', "clock.step is 0.1 ms, and speed is sampled every 1 ms")])
def test_wrong_mappings_name_channel_and_file(old: str, new: str, says: str) -> None:
    with pytest.raises(BadRecording) as error:
        imported(recording(), text=edited(old, new))
    assert says in error.value.cause
    assert error.value.remedy


def test_what_has_nothing_in_common_or_nothing_at_all_is_refused(tmp_path: Path) -> None:
    columns = recording()
    apart = as_mdf(columns, tmp_path, {"x": columns["t"] / 1000 + 100})
    with pytest.raises(BadRecording, match=r"The signals of a.mf4 have no time in common: the last one begins at 100 "):
        imported(open_source("a.mf4", io.BytesIO(apart)))
    empty = {**columns, "w": np.full(len(columns["t"]), np.nan)}
    for cut in (STANDSTILLS, STROKES, STROKES + 'of = "sign"\n'):
        with pytest.raises(BadRecording, match=r"the channel 'w' has 0 (standstills|reversals)"):
            imported(empty, text=MAP + re.sub('channel = "."', 'channel = "w"', cut))
    with pytest.raises(BadRecording, match="No file was given"):
        imported()
    with pytest.raises(BadRecording, match=r"has (0|1) samples"):
        imported({name: values[:1] for name, values in columns.items()})


@pytest.mark.parametrize(("old", "new", "says"), [
    ("speed =", "sped =", "line 3, signals.sped: the key is unknown"),
    ('position = { channel = "x", unit = "mm" }\n', "", "line 2, signals: 'position' of the machine 'sled' is missing"),
    ('"drive voltage" =', '"drive current" =', "line 6, commands.drive current: the key is unknown"),
    ('unit = "V"', 'unit = "A"', "line 6, commands.drive voltage.unit: the unit 'A' cannot be converted to V"),
    ('load = { value = "3 N" }', "", "conditions: 'load' of the machine 'sled' is missing"),
    ('"3 N"', "3", "conditions.load.value: the unit is missing"),
    ('cut = "standstills"', 'cut = "stops"', "runs.cut: 'stops' is not known"),
    ("below = 20", "", "this does not say what a standstill is"),
    ("below = 20", "below = -20", "runs.below: -20 is not positive"),
    ('channel = "v"\n', "", "runs.channel: the key is missing"),
    ('for = "0.3 s"', 'from = "start"', "runs.from: 'start' is not known"),
    ("below = 20", "below = 20\nlevel = 3", "runs.level: the key is unknown"),
    ('cut = "standstills"', 'cut = "length"', "runs.channel: the key is unknown"),
    (STANDSTILLS, '[runs]\ncut = "length"\n', "runs.cut: the length of the parts is missing"),
    (STANDSTILLS, STROKES + "direction = 2\n", "runs.direction: 2 is neither 1 nor -1"),
    (STANDSTILLS, '[runs]\nbegin_as = "x"\n', "runs.begin_as: the key is unknown"),
    ('for = "0.3 s"', 'begin_as = "load"', "runs.begin_as: 'load' is 'load' already"),
    ("[time]", '[further."2 a"]\nchannel = "x"\n[time]', "further.2 a: '2 a' is not a valid name"),
    ("[time]", '[further.speed]\nchannel = "x"\n[time]', "further.speed: 'speed' is 'speed' already"),
    ("[time]", '[further.oil]\nchannel = "x"\nmean = true\n[time]', "further.oil.unit: the key is missing"),
    ("[time]", '[further.oil]\nname = "n"\n[time]', "further.oil: the pattern of file names has no group 'n'"),
    ("[time]", "[shift_command]\n[time]", "shift_command: the key is unknown")])
def test_what_a_mapping_has_wrong_has_key_and_line(old: str, new: str, says: str) -> None:
    with pytest.raises(BadRecording) as error:
        read_machine_mapping(edited(old, new).encode(), "channels.toml", SLED)
    assert says in error.value.cause
    assert error.value.cause.startswith("channels.toml")
    assert error.value.remedy


def test_the_documented_mapping_is_read() -> None:
    page = (Path(__file__).parents[3] / "docs" / "your_files.md").read_text()
    text = re.findall(r"```toml\n(.*?)```", page.partition("## Recordings of another machine")[2], re.DOTALL)[0]
    block = Block("rotor", gives="rotor speed", reads=("voltage",), output_function=lambda x, u, q, p: u.voltage)
    rotor = Machine("rotor", (block,), (Sensor("rotor speed", "rad/s"),), (Command("voltage", "V"),),
                    (Condition("load torque", "N m"), Condition("gain", "N/V")))
    mapping = read_machine_mapping(text.encode(), "channels.toml", rotor)
    assert mapping.cut == Standstills(ChannelRef("v"), 0.01, 0.2, at_end=True)
    assert (mapping.held, mapping.length, mapping.gap) == ({"voltage": True}, 1.2, 0.04)
    assert set(mapping.conditions) == {"load torque", "gain", "run_order", "width"}


def test_channels_that_equations_read_must_be_mapped() -> None:
    driven = replace(SLED, inputs=("slope",))
    with pytest.raises(BadRecording, match="the machine 'sled' reads 'slope', which is missing"):
        read_machine_mapping((MAP + STANDSTILLS).encode(), "channels.toml", driven)


def test_a_guess_for_a_machine_says_why_and_what_is_open() -> None:
    columns = recording()
    content = as_csv({"t [ms]": columns["t"], "sled_speed [mm/s]": columns["v"], "Positon [mm]": columns["x"],
                      "U_mot [mV]": columns["u"], "note": columns["u"]})
    proposal = propose_for_machine(open_source("a.csv", io.BytesIO(content)), SLED)
    assert {guess.name: guess.channel and guess.channel.name for guess in proposal.guesses} == {
        "time": "t", "speed": "sled_speed", "position": "Positon", "drive voltage": "U_mot"}
    assert "# GUESS: the unit 'mV', which no other channel has" in proposal.text
    assert proposal.open_keys == ("load",)
    filled = proposal.text.replace('# OPEN: "load" = { value = "1 N" }, or', 'load = { value = "1 N" } # or')
    found = imported(open_source("a.csv", io.BytesIO(content)), text=filled)
    assert len(found.runs) == 1
    assert np.abs(found.runs.commands["drive voltage"].value).max() == pytest.approx(5e-3)
    foreign = Machine("sled", SLED.blocks, SLED.sensors, (Command("drive voltage", "V"),), (Condition("load", "N"),))
    nothing = propose_for_machine(open_source("b.csv", io.BytesIO(b"a;b\n1;2\n2;3\n")), foreign)
    assert all(guess.channel is None for guess in nothing.guesses)
    assert nothing.guesses[1].reason == ("no channel has such a name, or such a unit alone; "
                                         "the file has 'a' [no unit], 'b' [no unit]")
    assert '# unit = "m/s" # only of a channel for which the file states none' in nothing.text


def test_the_unit_of_a_model_is_not_proposed_where_the_file_states_units() -> None:
    machine = Machine("sled", SLED.blocks, SLED.sensors, SLED.commands, SLED.conditions)
    proposal = propose_for_machine(open_source("b.csv", io.BytesIO(b"t [s];a [kPa];b [kPa]\n0;1;2\n1;2;3\n")), machine)
    assert "the file has 't' [s], 'a' [kPa], 'b' [kPa]" in proposal.text
    assert "unit = " not in proposal.text


def test_a_missing_condition_may_be_a_value_a_part_of_the_file_name_or_a_column() -> None:
    with pytest.raises(BadRecording) as error:
        read_machine_mapping(edited('load = { value = "3 N" }', "").encode(), "channels.toml", SLED)
    assert error.value.remedy == (
        'Add [conditions."load"] with value = "1 N", name = a group of the pattern of file names, '
        "column = a column of the plan, or a channel, or declare the machine without it")


@pytest.mark.parametrize(("value", "expected"), [("3 N", 0), ("3 kN", 1)])
def test_a_condition_and_a_command_of_another_order_than_declared_are_doubted(value: str, expected: int) -> None:
    machine = replace(SLED, conditions=tuple(replace(each, levels=(2.0, 5.0)) for each in SLED.conditions))
    text = edited("3 N", value)
    found = imported(recording(6), text=text, machine=machine)
    assert sum("Check its unit" in doubt for doubt in found.doubts) == expected
    assert any(remark.startswith("load is 3") for remark in found.remarks)


@pytest.mark.parametrize(("unit", "doubts"), [("mm/s", ()), (
    "m/s", ("speed reaches 501.22 m/s in the runs, and 0.5 m/s in the experiments that the machine declares. Check its "
            "unit",))])
def test_a_signal_of_another_order_than_in_the_experiments_of_the_machine_is_doubted(
        unit: str, doubts: tuple[str, ...]) -> None:
    assert imported(recording(), text=edited("mm/s", unit), machine=DRIVEN,
                    ranges=simulate_ranges(DRIVEN)).doubts == doubts


@pytest.mark.parametrize(("duration", "step", "expected"), [
    (1e3, 1.0, 1), (1e-3, 1e-6, 1), (1.0, 1e-3, 0), (1e3, 1e-3, 0), (1.0, 1.0, 0)])
def test_a_clock_of_another_order_than_that_of_experiments_is_doubted(
        duration: float, step: float, expected: int) -> None:
    """Runs of another length, or with other steps, are none: a unit of time changes both."""
    machine = replace(DRIVEN, duration=duration, step=step)
    doubts = imported(recording(), machine=machine).doubts
    assert sum("Check the unit of time" in doubt for doubt in doubts) == expected


@pytest.mark.parametrize(("lowest", "highest", "doubted"), [(-5.0, -1.0, True), (-5.0, 0.3, True), (-5.0, 1.0, False),
                                                            (0.0, 5.0, False)])
def test_a_signal_on_the_other_side_of_zero_is_doubted(lowest: float, highest: float, doubted: bool) -> None:
    bare = recording()
    positive = {**bare, "v": np.abs(bare["v"])}
    found = imported(positive, machine=DRIVEN, ranges=[SignalRange("speed", lowest, highest)]).doubts
    assert [doubt for doubt in found if "sign" in doubt] == [
        "speed is positive in the runs, and negative in the experiments that the machine declares. Check its sign and "
        "its unit"] * doubted


@pytest.mark.parametrize(("channel", "says"), [
    ("u [V]", "has the unit V, which is no unit of a quantity in m/s. Check that it is the right channel"),
    ("u", "the unit is missing; the model uses m/s. State the unit of its numbers, such as m/s")])
def test_a_channel_of_another_quantity_and_one_without_a_unit_are_told_apart(channel: str, says: str) -> None:
    content = as_csv({channel if name == "u" else name: values for name, values in recording().items()})
    with pytest.raises(BadRecording, match=re.escape(f"The channel 'u' of a.csv{':' * (channel == 'u')} {says}")):
        imported(open_source("a.csv", io.BytesIO(content)), text=edited('"v", unit = "mm/s"', '"u"'))
