"""From files and archives to recordings: what is mapped comes out, and what cannot be used is set aside and said."""

import io
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from asammdf import MDF, Signal
from scipy.io import savemat

from slipstick.acquisition import import_sources, open_source, read_mapping
from slipstick.acquisition.archive import answer, import_archive
from slipstick.acquisition.open_questions import open_questions
from slipstick.acquisition.result import Imported
from slipstick.bench import parameters
from slipstick.errors import BadRecording
from slipstick.recordings import Recordings
from slipstick.storage.isolated import isolated
from tests.benches import COMPACT, TABLES
from tests.slipstick.acquisition.conftest import LOCK, MAP, Run, archive, csv, opened, run


def imported(*runs: Run, text: str = MAP, plan: bytes | None = None, names: tuple[str, ...] = ()) -> Imported:
    files = [open_source(names[number] if names else f"run{number}.csv", opened(csv(one)))
             for number, one in enumerate(runs)]
    return import_sources(files, read_mapping(text.encode(), "channels.toml"), COMPACT, plan)


def edited(old: str, new: str, text: str = MAP) -> str:
    assert old in text
    return text.replace(old, new)


def test_signals_come_in_the_units_signs_and_clock_of_the_model() -> None:
    one = run()
    found = imported(one, run(seed=2))
    signals, conditions = found.recordings.signals, found.recordings.conditions
    assert signals is not None
    assert found.step == pytest.approx(1e-3)
    assert signals.time[0] == 0
    np.testing.assert_allclose(signals.pressure[0], one.columns["p_oil"][100:] / 100, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(signals.output_torque[0], -one.columns["M_out"][100:], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(signals.input_speed[0], one.columns["n_in"][100:] * np.pi / 30, rtol=1e-6, atol=1e-4)
    assert found.recordings.measured_time == pytest.approx([LOCK, LOCK], abs=3e-3)
    assert found.computed
    assert np.all(found.error < 2e-3)
    assert conditions.motor_speed[0] == pytest.approx(1500 * np.pi / 30)
    assert found.doubts == ()
    again = Recordings.read(found.recordings.to_bytes(), "h5")
    assert again.digest == found.recordings.digest


def test_first_engagements_are_led_in_by_what_precedes_the_shift_command() -> None:
    first, later = run(), run(seed=2)
    later = Run({name: values[40:] - (40 if name == "t" else 0) for name, values in later.columns.items()})
    text = edited('time = "100 ms"', 'channel = "n_out"\nabove = 5')
    lead, signals = (found := imported(first, later, text=text)).led_in, found.recordings.signals
    assert signals is not None
    assert lead.time[-1] == pytest.approx(-1e-3)
    for row, one in enumerate((first, later)):
        whole = np.concatenate([lead.signals["pressure"][row], signals.pressure[row]])
        known = np.isfinite(whole)
        assert np.isnan(lead.signals["pressure"][row]).sum() == pytest.approx(40 * row, abs=2)
        np.testing.assert_allclose(whole[known], one.columns["p_oil"][:known.sum()] / 100, atol=1e-6)


def test_a_faster_channel_is_filtered_and_said() -> None:
    fast = run(step=2e-4)
    found = imported(fast, text=MAP + '[clock]\nstep = "1 ms"\n')
    assert found.step == 1e-3
    assert any("mean over one new step" in remark for remark in found.remarks)
    with pytest.raises(BadRecording, match=r"clock.step is 0.1 ms, and .* is sampled every 0.2 ms"):
        imported(fast, text=MAP + '[clock]\nstep = "0.1 ms"\n')


def test_lengths_may_differ_and_the_shortest_that_locks_ends_all() -> None:
    found = imported(run(end=1.2), run(end=0.9, seed=2), run(end=0.5, seed=3))
    signals = found.recordings.signals
    assert signals is not None
    assert signals.time[-1] == pytest.approx(0.899)
    assert [one.label for one in found.set_aside] == ["run2.csv"]
    assert any("run1.csv; the longest ends at 1.199 s" in remark for remark in found.remarks)
    assert any(remark.endswith("with all engagements") for remark in imported(run(), run(seed=2)).remarks)


def _gap(one: Run) -> Run:
    return Run({name: np.delete(values, slice(300, 320)) for name, values in one.columns.items()})


def _missing(one: Run) -> Run:
    return one.changed(p_oil=np.where(np.arange(len(one.columns["t"])) == 400, np.nan, one.columns["p_oil"]))


def _spike(one: Run) -> Run:
    return one.changed(M_out=np.where(np.arange(len(one.columns["t"])) == 400, 900.0, one.columns["M_out"]))


def _clipped(one: Run) -> Run:
    return one.changed(p_oil=np.minimum(one.columns["p_oil"], 450.0))


@pytest.mark.parametrize(("flaw", "says"), [
    (_gap, "gap from 0.199 to 0.22 s"), (_missing, "pressure ('p_oil') has a gap from 0.299 to 0.301 s"),
    (_spike, "output_torque ('M_out') has a spike from 0.3 to 0.3 s"), (_clipped, "has a saturation"),
    (lambda one: run(lock=2.0), "no lock-up")])
def test_a_flawed_engagement_is_set_aside_with_the_reason(flaw: object, says: str) -> None:
    found = imported(run(), flaw(run(seed=2)), run(seed=3))  # type: ignore[operator]
    assert found.labels == ("run0.csv", "run2.csv")
    aside, = found.set_aside
    assert (aside.label, says in aside.reason) == ("run1.csv", True), aside.reason


def test_a_flaw_after_the_recordings_end_does_not_matter() -> None:
    one = run(end=1.2)
    late = one.changed(M_out=np.where(one.columns["t"] == 1250, 900.0, one.columns["M_out"]))
    assert imported(late, text=MAP + '[clock]\nend = "1 s"\n').set_aside == ()
    with pytest.raises(BadRecording, match=r"None of the 1 engagements can be used; run0.csv: .* spike"):
        imported(late)


def test_many_engagements_in_a_file_are_cut_by_a_trigger() -> None:
    runs = [run(seed=seed) for seed in range(3)]
    whole = {name: np.concatenate([one.columns[name] for one in runs]) for name in runs[0].columns}
    whole["t"] = np.arange(len(whole["t"])) * 1.0
    n = len(runs[0].columns["t"])
    whole["trigger"] = np.tile((np.arange(n) > 20) & (np.arange(n) < 60), 3).astype(float)
    whole["step"] = np.repeat([5.0, 6.0, 7.0], n)
    cut = edited('time = "100 ms"', 'time = "79 ms"')  # after the trigger, which is at 21 ms
    found = imported(Run(whole), text=cut + '[trigger]\nchannel = "trigger"\nabove = 0.5\n[clock]\nend = "1.1 s"\n')
    assert found.labels == tuple(f"run0.csv, engagement {number}" for number in range(3))
    assert found.recordings.measured_time == pytest.approx([LOCK] * 3, abs=3e-3)
    by_change = imported(Run(whole), text=MAP + '[trigger]\nchannel = "step"\nchanges = true\n[clock]\nend = "1.1 s"\n')
    np.testing.assert_allclose(by_change.recordings.measured_time, found.recordings.measured_time, atol=2e-4)


def test_the_shift_command_is_where_a_channel_marks_it() -> None:
    one = run()
    marked = one.changed(valve=np.where(one.columns["t"] >= 100, 0.8, 0.1))
    command = edited('time = "100 ms"', 'channel = "valve"\nabove = 0.5')
    assert imported(marked, text=command).recordings.measured_time == pytest.approx([LOCK], abs=3e-3)
    with pytest.raises(BadRecording, match=r"'valve' of run0.csv never marks a shift command: .* between 0.1 and 0.8"):
        imported(marked, text=command.replace("0.5", "5"))


def test_conditions_come_from_names_sheets_and_channels() -> None:
    one = run()
    text = edited('load_inertia = { value = "0.4 kg m^2" }', 'load_inertia = { name = "J", unit = "kg m^2" }')
    text = edited('brake_torque = { value = "5 N m" }', 'brake_torque = { column = "brake" }', text)
    text = edited('{ value = "1500 rpm" }', '{ channel = "n_mot", unit = "rpm" }\nplan = "plan.csv"\n'
                  "pattern = 'J(?P<J>[0-9.]+)_'\nrun_order = { column = \"order\" }", text)
    plan = b"file;brake [N cm];order\nJ0.9_b.csv;1500;7\nJ0.4_a.csv;500;3\n"
    runs = [one.changed(n_mot=np.full(len(one.columns["t"]), speed)) for speed in (2200.0, 3000.0)]
    found = imported(*runs, text=text, plan=plan, names=("J0.4_a.csv", "J0.9_b.csv"))
    conditions = found.recordings.conditions
    assert conditions.load_inertia.tolist() == [0.4, 0.9]
    assert conditions.brake_torque == pytest.approx([5, 15])
    assert conditions.motor_speed == pytest.approx(np.array([2200, 3000]) * np.pi / 30)
    assert conditions.run_order is not None
    assert conditions.run_order.tolist() == [0, 1]
    with pytest.raises(BadRecording, match=r"The name 'J0,9_b.csv' does not match conditions.pattern"):
        imported(runs[0], text=text, plan=plan.replace(b"J0.9", b"J0,9"), names=("J0,9_b.csv",))
    with pytest.raises(BadRecording, match=r"plan.csv has no row for engagement 0 of J1_z.csv"):
        imported(runs[0], text=text, plan=plan, names=("J1_z.csv",))


def test_the_current_profile_is_the_nearest_one_or_refused() -> None:
    one, conditions = run(), COMPACT.conditions
    time = one.columns["t"] / 1000 - 0.1
    text = edited("current_profile = { value = 0 }", 'current_profile = { channel = "i", unit = "mA" }')
    followed = [one.changed(i=1000 * np.interp(time, conditions.profile_time[p], conditions.profile_current[p]))
                for p in range(3)]
    assert imported(*followed, text=text).recordings.conditions.current_profile.tolist() == [0, 1, 2]
    with pytest.raises(BadRecording, match="follows no current profile of the bench") as error:
        imported(one.changed(i=np.full(len(time), 300.0)), text=text)
    assert error.value.remedy.startswith("Check its unit and the shift command")
    with pytest.raises(BadRecording, match=r"from the shift command at 0\.3 s on") as error:
        imported(followed[1], text=text.replace('time = "100 ms"', 'time = "300 ms"'))
    assert error.value.remedy == ("Correct [shift_command], or leave the file out where its trigger alone is off: "
                                  "from 0.1 s on, the current follows profile 1")


def test_a_sheet_has_columns_of_unique_names_and_one_decimal_sign() -> None:
    text = edited('brake_torque = { value = "5 N m" }', 'brake_torque = { column = "brake (set)" }\nplan = "plan.csv"')
    plan = b"file;brake (set) [N m];brake (measured) [N m];note\nrun0.csv;5,5;7,5;\n"

    def brake(text: str = text, plan: bytes = plan) -> float:
        return float(imported(run(), text=text, plan=plan).recordings.conditions.brake_torque[0])

    assert (brake(), brake(text.replace("(set)", "(measured)"))) == (5.5, 7.5)
    with pytest.raises(BadRecording, match=r"it is '1.000', not a number with a decimal comma"):
        brake(plan=plan.replace(b"5,5", b"1.000"))
    with pytest.raises(BadRecording, match=r"it is '1,000', not a number with a decimal point"):
        brake(plan=plan.replace(b";", b",").replace(b"5,5", b'"1,000"').replace(b"7,5", b"7.5"))
    twice = plan.replace(b"(measured)", b"(set)")
    with pytest.raises(BadRecording, match=r"plan.csv has 2 channels 'brake \(set\)'"):
        brake(plan=twice)
    assert brake(text.replace("(set)", "(set) [N m]@3"), twice) == 7.5


@pytest.mark.parametrize("time", ['"t_slow"', '{ channel = "t_slow", unit = "ms" }'])
@pytest.mark.parametrize("form", ["matlab", "csv with columns of several lengths", "csv with empty cells"])
def test_channels_of_several_rates_in_one_file(form: str, time: str) -> None:
    columns = run(seed=2).columns
    slow = {"t_slow": columns["t"][::5], "n_out": columns["n_out"][::5]}
    text = edited('channel = "n_out", unit = "rpm"', f'channel = "n_out", unit = "rpm", time = {time}')
    count = len(columns["t"])
    if form == "matlab":
        memory = io.BytesIO()
        savemat(memory, columns | slow)
        source = open_source("a.mat", opened(memory.getvalue()))
    elif form == "csv with empty cells":
        text = MAP
        source = open_source("a.csv", opened(csv(Run(columns | {"n_out": np.where(
            np.arange(count) % 5 == 0, columns["n_out"], np.nan)}))))
    else:
        padded = {name: np.append(values, np.full(count - len(values), np.nan)) for name, values in slow.items()}
        source = open_source("a.csv", opened(csv(Run(columns | padded))))
    found = import_sources([source], read_mapping(text.encode(), "channels.toml"), COMPACT)
    signals = found.recordings.signals
    assert signals is not None
    assert (found.step, found.set_aside) == (5e-3, ())
    expected = np.interp(signals.time, columns["t"] / 1e3 - 0.1, columns["n_out"] * np.pi / 30)
    np.testing.assert_allclose(signals.output_speed[0], expected, atol=1.0)  # noise of 0.1 and 2 ms beside its samples
    assert found.recordings.measured_time == pytest.approx([LOCK], abs=5e-3)


def test_values_that_a_logger_holds_are_used_at_their_own_rate() -> None:
    columns = run().columns
    places = np.arange(len(columns["t"]))
    found = imported(Run(columns | {"n_out": columns["n_out"][places - places % 10]}))
    assert (found.step, found.set_aside) == (0.01, ())
    assert any(remark.startswith("output_speed ('n_out'): its values are held on a faster clock") and
               remark.endswith("every 10 ms") for remark in found.remarks)
    assert found.recordings.measured_time == pytest.approx([LOCK], abs=5e-3)


def test_samples_without_a_time_are_gaps() -> None:
    one = run()
    count = np.arange(len(one.columns["t"]))
    first = imported(one.changed(t=np.where(count == 0, np.nan, one.columns["t"])))
    assert first.set_aside == ()  # before the shift command
    with pytest.raises(BadRecording, match=r"has a gap from 0.299 to 0.301 s"):
        imported(one.changed(t=np.where(count == 400, np.nan, one.columns["t"])))


def test_where_t_0_was_put_is_said() -> None:
    one = run()
    early = one.changed(t=one.columns["t"] - 100)  # a pre-trigger: 0 is the shift command
    assert "t = 0 was put at 0 s on the clock of run0.csv, 0.1 s after its first sample at -0.1 s; in all " \
        "engagements, 0.1 to 0.1 s after the first sample" in imported(early, early).remarks
    assert "t = 0 was put at 0.1 s on the clock of run0.csv, 0.1 s after its first sample at 0 s" in \
        imported(one).remarks


@pytest.mark.parametrize(("time", "count"), [('channel = "time"\nunit = "s"', 1), ('step = "1 ms"', 1), (None, 0)])
def test_a_group_of_mdf_without_master_needs_times(tmp_path: Path, time: str | None, count: int) -> None:
    columns = run().columns
    clock = columns["t"] / 1e3
    file = MDF(version="4.10")
    file.append([Signal(columns[name], clock, "", name) for name in ("p_oil", "n_in", "n_out", "M_out")])
    file.groups[0].channels[0].sync_type = file.groups[0].channels[0].channel_type = 0
    path = Path(file.save(tmp_path / "a.mf4"))
    text = edited('[time]\nchannel = "t"\nunit = "ms"', f"[time]\n{time}" if time else "")
    with path.open("rb") as content:
        source = open_source("a.mf4", content)
        if time is None:
            with pytest.raises(BadRecording, match="no times of its own: its group 0 has no master channel"):
                import_sources([source], read_mapping(text.encode(), "channels.toml"), COMPACT)
            return
        found = import_sources([source], read_mapping(text.encode(), "channels.toml"), COMPACT)
    assert found.recordings.measured_time == pytest.approx([LOCK], abs=3e-3)


def test_further_channels_are_kept_with_their_unit_and_gaps() -> None:
    one = run()
    oil = np.where(one.columns["t"] < 1200, 80 + one.columns["t"] / 1000, np.nan)
    found = imported(one.changed(T_oil=oil), text=MAP + '[further.oil_temperature]\nchannel = "T_oil"\nunit = "degC"\n')
    again = Recordings.read(found.recordings.to_bytes(), "h5")
    kept = again.further["oil_temperature"]
    assert kept.unit == "degC"
    np.testing.assert_allclose(kept.values[0, 1:900], oil[101:1000], rtol=1e-6)
    assert np.isnan(kept.values[0, -1])
    without = Recordings(again.conditions, again.measured_time, again.signals, again.run_order)
    assert again.digest != without.digest


LINES = {line.split(" = ")[0]: f"{line}\n" for line in MAP.splitlines()[2:6]}
CHANNEL = {"pressure": "p_oil", "input_speed": "n_in", "output_speed": "n_out", "output_torque": "M_out"}


def mapped(*names: str, more: str = "") -> Imported:
    """An import of two engagements whose files have only the channels of these signals."""
    text, runs = MAP + more, [run(), run(seed=2)]
    for name in set(CHANNEL) - set(names):
        text, runs = edited(LINES[name], "", text), [one.without(CHANNEL[name]) for one in runs]
    return imported(*runs, text=text)


def test_a_missing_signal_closes_what_needs_it_and_leaves_the_others() -> None:
    found, whole = mapped("pressure", "input_speed", "output_speed"), imported(run(), run(seed=2))
    signals, every = found.recordings.signals, whole.recordings.signals
    assert signals is not None
    assert every is not None
    assert signals.missing == ("output_torque",)
    for name in signals.names:
        np.testing.assert_array_equal(signals[name], every[name])
    np.testing.assert_array_equal(found.recordings.measured_time, whole.recordings.measured_time)
    again = Recordings.read(found.recordings.to_bytes(), "h5")
    assert again.digest == found.recordings.digest != whole.recordings.digest
    holds, study, calibration = found.open_questions
    assert holds == ("output_torque not mapped: the recordings hold pressure, input_speed and output_speed only")
    assert study.startswith("A study tests the block valve. It cannot test contact (output_torque), clutch (outp")
    assert "lists the parameters that they do not determine" in calibration
    assert "Without pressure" not in calibration
    assert (whole.open_questions, found.doubts) == ((), ())


def test_without_pressure_the_linked_parameters_are_said_if_all_of_them_are_uncertain() -> None:
    found = mapped("input_speed", "output_speed", "output_torque")
    assert "Without pressure current_gain, pressure_bias, " in found.open_questions[2]
    assert "A study tests the blocks load, input and lock. It cannot test valve (pressure)" in found.open_questions[1]
    known = replace(COMPACT, priors=tuple(
        replace(prior, uncertain=False) if name == "current_gain" else prior
        for name, prior in zip(parameters.NAMES, COMPACT.priors, strict=True)))
    assert "Without pressure" not in open_questions(("input_speed",), known)[2]


def test_without_both_speeds_the_shifting_time_must_be_recorded() -> None:
    with pytest.raises(BadRecording, match="no shifting time is recorded, and to compute it both speeds are needed"):
        mapped("pressure", "output_speed")
    found = mapped("output_speed", more=f'[shifting_time]\nvalue = "{LOCK} s"\n[further.speed]\nchannel = "n_out"\n')
    signals = found.recordings.signals
    assert signals is not None
    assert signals.names == ("output_speed",)
    assert found.recordings.further["speed"].values.shape == signals["output_speed"].shape
    assert found.recordings.measured_time.tolist() == [LOCK, LOCK]
    assert "A study tests no block" in found.open_questions[1]


@pytest.mark.parametrize(("names", "wrong", "says"), [
    (("pressure", "output_torque"), {"M_out": -1.0}, "torque is negative"),
    (("pressure", "output_torque"), {"p_oil": -1.0}, "pressure does not rise"),
    (("input_speed", "output_torque"), {"n_in": 3.0}, "times the motor speed"),
    (("input_speed", "output_speed"), {"n_in": 2.0}, "gear ratio"),
])
def test_doubts_are_those_of_the_signals_that_there_are(
        names: tuple[str, ...], wrong: dict[str, float], says: str) -> None:
    text, one = MAP + f'[shifting_time]\nvalue = "{LOCK} s"\n', run()
    for name in set(CHANNEL) - set(names):
        text = edited(LINES[name], "", text)
    assert imported(one, text=text).doubts == ()
    changed = one.changed(**{name: factor * one.columns[name] for name, factor in wrong.items()})
    assert any(says in doubt for doubt in imported(changed, text=text).doubts)


@pytest.mark.parametrize(("late", "says"), [
    (0.0, ""), (0.004, ""), (0.02, r"equal (19|20)\S* ms after the recorded shifting time, in the median of 5 "
                                   r"engagements\. If a delay of the trigger .* put t = 0 that much later"),
    (-0.02, r"equal (19|20)\S* ms before .* put t = 0 that much earlier"),
])
def test_signals_that_are_late_beside_the_recorded_shifting_time_are_doubted(late: float, says: str) -> None:
    """The clocks of the sensors are known to one sample of 2 ms."""
    runs = [run(2e-3, 1.4, LOCK + late, seed) for seed in range(5)]
    doubts = imported(*runs, text=MAP + f'[shifting_time]\nvalue = "{LOCK} s"\n').doubts
    assert re.search(says, doubts[0]) if says else doubts == ()
    assert imported(*runs).doubts == ()


@pytest.mark.parametrize(("text", "says"), [
    (edited('channel = "p_oil", unit = "kPa"', 'channel = "n_in"'), "'n_in' of run0.csv: the unit is"),
    (edited(', unit = "kPa"', ""), "The channel 'p_oil' of run0.csv: the unit is missing"),
    (edited('channel = "t"', 'channel = "p_oil"'), "do not increase at sample"),
    (edited('[time]\nchannel = "t"\nunit = "ms"\n', ""), "has no times of its own"),
    (edited("{ value = 0 }", "{ value = 9 }"), "9 is not the number of a current profile"),
    (edited('motor_speed = { value = "1500 rpm" }\n', ""), "channels.toml, conditions: motor_speed is missing"),
    (MAP + 'input_torque = { value = "5 N m" }', "the bench has a torque converter"),
    (edited('"100 ms"', '"-1 s"'), "shift command of run0.csv is at -1 s, and its samples are from 0 to 1.299"),
    (edited('"100 ms"', '"5 s"'), "The shift command of run0.csv is at 5 s"),
    (MAP + '[clock]\nstep = "2 s"', "clock.step is 2 s, and the recordings end 1.199 s after"),
    (MAP + '[clock]\nend = "10000000 s"', "clock.end is 1e+07 s, and the longest engagement ends 1.199 s")])
def test_wrong_mappings_name_channel_and_file(text: str, says: str) -> None:
    with pytest.raises(BadRecording) as error:
        imported(run(), text=text)
    assert says in error.value.cause
    assert error.value.remedy


@pytest.mark.parametrize(("text", "says"), [
    (edited(", sign = -1", ""), "output torque is negative"),
    (edited('"1500 rpm"', '"1500 rad/s"'), ""), (edited('"1500 rpm"', '"15 rpm"'), "times the motor speed")])
def test_what_looks_wrong_is_said(text: str, says: str) -> None:
    found = imported(run(), text=text)
    assert any(says in doubt for doubt in found.doubts) if says else not found.doubts


def test_a_unit_in_the_file_that_the_mapping_overrules_is_said() -> None:
    one = run()
    content = csv(one).replace(b"p_oil", b"p_oil [bar]")
    mapping = read_mapping(MAP.encode(), "channels.toml")
    found = import_sources([open_source("a.csv", opened(content))], mapping, COMPACT)
    assert any("state the unit bar for 'p_oil', the mapping kPa" in remark for remark in found.remarks)


# An archive is checked before anything in it is read; the child process in which that happens has limits.


FILES = {"channels.toml": MAP.encode(), "runs/a.csv": csv(run())}
BENCH = TABLES / "compact.toml"


def asked(files: dict[str, bytes]) -> bytes:
    return json.dumps({"bench": str(BENCH)}).encode() + b"\n" + archive(files)


def test_an_archive_becomes_recordings_in_a_child_process() -> None:
    content, report = import_archive(archive(FILES), BENCH)
    assert Recordings.read(content, "h5").measured_time == pytest.approx([LOCK], abs=3e-3)
    assert (report.labels, report.computed, report.set_aside, report.doubts) == (("a.csv",), True, (), ())
    assert any("decimal commas" in remark for remark in report.remarks)


def test_what_systems_and_people_put_into_an_archive_is_left_out_and_said() -> None:
    beside = {"__MACOSX/runs/._a.csv": b"\0\5\x16\7", ".DS_Store": b"\0\0\0\1Bud1", "runs/Thumbs.db": b"\xd0\xcf",
              "other/Thumbs.db": b"\xd0", "runs/desktop.ini": b"[.ShellClassInfo]", "runs/protocol.pdf": b"%PDF\0"}
    _, report = import_archive(archive({**FILES, **beside}), BENCH)
    assert report.labels == ("a.csv",)
    assert report.remarks[-1] == "left out of the archive, because of their names: runs/Thumbs.db, other/Thumbs.db, " \
        "runs/desktop.ini, runs/protocol.pdf"
    _, report = import_archive(archive({"channels.toml": MAP.encode(), "runs\\a.csv": csv(run())}), BENCH)
    assert report.labels == ("a.csv",)


@pytest.mark.parametrize(("files", "says"), [
    ({"runs/a.csv": b"t;p\n1;2\n"}, "no file 'channels.toml'"),
    ({**FILES, "channels.toml": (MAP + 'plan = "p.csv"').encode()}, "no file 'p.csv', the sheet of conditions"),
    ({**FILES, "other/a.csv": b""}, "two files 'a.csv'"),
    ({"channels.toml": MAP.encode()}, "The archive has no file of a known kind")])
def test_a_wrong_archive_is_refused(files: dict[str, bytes], says: str) -> None:
    with pytest.raises(BadRecording, match=says):
        answer(asked(files))


def test_a_small_archive_of_a_huge_file_is_not_unpacked() -> None:
    bomb = asked({"a.csv": bytes(1 << 20)}).replace((1 << 20).to_bytes(4, "little"), (1 << 31).to_bytes(4, "little"))
    with pytest.raises(BadRecording, match="more than"):
        answer(bomb)


def test_a_child_that_dies_is_reported_as_a_failure() -> None:
    with pytest.raises(BadRecording, match="it failed"):
        isolated(b"x", "json:loads", BadRecording, 5, "it failed")
