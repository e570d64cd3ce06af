"""The study of a declared machine from its file to the report, against an effect that is known, and without one."""

import base64
import json
import re
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import slipstick
from slipstick.engine.doing import Doing
from slipstick.engine.simulation import simulate_runs
from slipstick.errors import BadRecording, InvalidValue, UnknownName
from slipstick.interface.machine_study import MachineCalibration, MachineStudy
from slipstick.machine import Effect, Kind, Machine, Runs, list_experiments, read_runs
from slipstick.machine_studies import MachineStudyResult, study_machine
from slipstick.machine_studies.study import calibrate_machine, end_early
from slipstick.machine_studies.words import name_run
from slipstick.pictures.machine_study import machine_pictures
from slipstick.report import made
from slipstick.report.calibration import calibration_page
from slipstick.report.machine_study import advise, coefficient_table, sections, warnings
from slipstick.report.study.parts import Items, Section, Table
from slipstick.storage.library import Library
from slipstick.storage.shipped import FOLDER
from slipstick.time_budget import TimeBudgetEnded
from worker import study_steps
from worker.__main__ import main

SOURCE = (FOLDER / "machines" / "heated_plate.py").read_text()
SLOPE = 0.002  # 1/K, of the cooling over the temperature beyond that of the room


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the machine (with longer steps), its bench with an effect, 24 runs of each, and 8 of the bench."""
    folder = tmp_path_factory.mktemp("machines")
    model = SOURCE.replace("step=0.5", "step=2.0")
    assert model != SOURCE
    (folder / "mine.py").write_text(model)
    (folder / "bench.py").write_text(model.replace("(1 + q.cooling)", f"(1 + q.cooling) * (1 + {SLOPE} * difference)"))
    for name in ("mine", "bench"):
        slipstick.simulate(Machine.open(folder / f"{name}.py"), runs=24, seed=4).save(folder / f"of_{name}.h5")
    slipstick.simulate(Machine.open(folder / "bench.py"), runs=8, seed=4).save(folder / "few.h5")
    return folder


def test_intervals_of_factors_are_those_of_their_logarithms(folder: Path) -> None:
    """What multiplies a nominal value keeps its sign, however little the recordings tell."""
    machine = Machine.open(folder / "mine.py")
    parameters, *_ = calibrate_machine(machine, read_runs(folder / "of_mine.h5").take(np.arange(8)))
    for each in parameters:
        if each.name == "first temperature":
            assert each.lower + each.upper == pytest.approx(2 * each.value)
        else:
            assert each.lower * each.upper == pytest.approx(each.value**2)
    capacity = next(each for each in parameters if each.name == "heat capacity")
    assert capacity.upper / capacity.lower > 1.05


def test_a_study_and_a_calibration_tell_first_that_a_unit_may_be_wrong(folder: Path) -> None:
    machine, runs = Machine.open(folder / "mine.py"), read_runs(folder / "of_mine.h5").take(np.arange(6))
    right, _ = study_machine(machine, runs)
    assert right.doubts == []
    said = list[Doing]()
    calibrate_machine(machine, replace(runs, signals={**runs.signals, "air speed": 100 * runs.signals["air speed"]}),
                      log=said.append)
    doubt = said[0].words.removeprefix("Doubtful: ")
    assert doubt.startswith("air speed reaches ")
    assert doubt.endswith("in the experiments that the machine declares. Check its unit")
    assert warnings(replace(right, doubts=[doubt]))[0] == ("Doubtful recordings:", f"{doubt}.")


def test_an_error_tells_that_a_unit_may_be_wrong_and_comes_before_anything_is_fitted(folder: Path) -> None:
    machine, runs = Machine.open(folder / "mine.py"), read_runs(folder / "of_mine.h5").take(np.arange(6))
    wrong = replace(runs, signals={**runs.signals, "air speed": 1000 * runs.signals["air speed"]})
    cause = r"^air speed reaches .* Check its unit\. The equations of “plate” have no finite solution"
    for attempt in (study_machine, calibrate_machine):
        said = list[Any]()
        with pytest.raises(InvalidValue, match=cause):
            attempt(machine, wrong, log=said.append)
        assert len(said) == 1  # the doubt
    with pytest.raises(TimeBudgetEnded, match=r"^air speed reaches .* The time budget of 0 s ended"):
        slipstick.study(machine, wrong, budget=0, progress=False)


def test_own_experiments_that_fail_stop_no_calibration(folder: Path) -> None:
    machine, runs = Machine.open(folder / "mine.py"), read_runs(folder / "of_mine.h5").take(np.arange(6))
    fan, plate = machine.blocks

    def begin(u: Any, q: Any, p: Any) -> Any:
        if np.any(p.room_temperature > 500):
            raise ArithmeticError
        return p.first_temperature

    hot = tuple(replace(each, levels=(1000.0,)) for each in machine.conditions)
    parameters, *_ = calibrate_machine(
        replace(machine, blocks=(fan, replace(plate, start_function=begin)), conditions=hot), runs)
    assert parameters


@pytest.mark.parametrize("counts", [lambda u: u.time < 60, lambda u: np.zeros(u.time.shape, bool)],
                         ids=["ends early", "never"])
def test_a_block_ends_where_no_sample_counts_any_more_and_is_shown_to_there(
        counts: Callable[[Any], Any]) -> None:
    opened = Machine.open("heated_plate")
    machine = replace(opened, blocks=tuple(replace(block, window=counts) if block.name == "fan" else block
                                           for block in opened.blocks))
    experiments = list_experiments(opened)
    runs = simulate_runs(opened, experiments.take(np.arange(12) % len(experiments)), seed=5)
    result, figures = study_machine(machine, runs)
    assert [block.name for block in result.blocks] == ["fan", "plate"]
    assert not result.findings
    pictures = machine_pictures(result, figures)
    assert "signals" in pictures
    for shown in figures.runs:
        ends = {signal: shown.time[len(values) - 1] for signal, values in shown.measured.items()}
        assert ends["temperature"] == shown.time[-1]
        assert ends["air speed"] == (pytest.approx(60, abs=12) if counts(SimpleNamespace(time=np.zeros(1)))
                                     else shown.time[-1])


@dataclass(frozen=True)
class Job:
    """A study by a worker: its `output`, what it `said` and `kept` on the way, and its `order`."""

    output: dict[str, Any]
    said: list[dict[str, Any]]
    kept: list[dict[str, Any]]
    order: dict[str, Any]


@pytest.fixture(scope="module")
def job(folder: Path) -> Job:
    order: dict[str, Any] = {"recordings": "of_bench", "machine": "heated plate", "settings": {}, "time_budget": 60.0,
                             "recordings_digest": Runs.open(folder / "of_bench.h5").digest}
    kept, said = list[dict[str, Any]](), list[dict[str, Any]]()
    report: Any = type("Report", (), {"__call__": lambda self, content: said.append(content),
                                      "keep": lambda self, content: kept.append(content)})()
    output = study_steps.study_declared(Library(folder), report, str(folder / "mine.py"), None, order)
    return Job(output, said, kept, order)


@pytest.fixture(scope="module")
def studied(job: Job) -> MachineStudy:
    return MachineStudy.from_dict({"recordings": "of_bench", **job.output})


def test_the_effect_is_named_measured_and_closes_the_gap_and_the_control_does_not(studied: MachineStudy) -> None:
    finding, = studied.findings
    assert (finding.quantity, finding.depends_on, finding.result.blocks) == ("cooling", "temperature", ["plate"])
    assert finding.result.confirmed
    assert finding.law is not None
    assert finding.law.x is not None
    x, change = np.array(finding.law.x), np.array(finding.law.change)
    slope = np.polyfit(x, change, 1)[0]
    mean = 1 + SLOPE * (np.interp(0, change, x) - 21)  # of the cooling, where the law is 0; rooms are at 18 and 24 degC
    assert slope == pytest.approx(SLOPE / mean, rel=0.05)
    gap = studied.result.gap
    assert gap is not None
    assert gap.closed == pytest.approx(1, abs=0.05)
    assert gap.control_closed is not None  # of an error of one sensor over what another one reads
    assert gap.control_closed < 0.5
    before = {block.name: block.before for block in studied.result.blocks}
    assert before["plate"] > 1.5 > 1.1 > before["fan"]
    assert all(block.chi_square < 1.1 for block in studied.result.blocks)


@pytest.mark.slow
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_law_of_an_effect_with_an_own_kind_is_called_by_its_name(folder: Path) -> None:
    root = Kind("root", ("growth",), (0,), lambda x, _: [np.sqrt(np.maximum(x - 21, 0))])
    effects = (Effect("free convection", "cooling", "temperature", root),
               Effect("radiation", "cooling", "temperature", "quadratic"))
    (folder / "root.py").write_text((folder / "bench.py").read_text().replace(
        f"(1 + {SLOPE} * difference)", "(1 + 0.05 * np.sqrt(np.maximum(difference, 0)))"))
    runs = slipstick.simulate(Machine.open(folder / "root.py"), runs=8, seed=4)
    result, _ = study_machine(replace(Machine.open(folder / "mine.py"), effects=effects), runs)
    finding, = result.findings
    assert (finding.effect, finding.kind, finding.equation) == ("free convection", "root", None)
    assert result.sentence == "Missing: free convection: cooling that depends on the temperature"
    assert finding.law is not None
    assert finding.law.formula is not None


@pytest.mark.parametrize(("effect", "cause"), [
    (Effect("a", "warmth", "temperature", "linear"), "'warmth', which is no quantity"),
    (Effect("a", "cooling", "temperature", "cubic"), "kind 'cubic' that does not exist")])
def test_an_effect_that_cannot_be_is_refused(folder: Path, effect: Effect, cause: str) -> None:
    with pytest.raises(InvalidValue, match=cause):
        replace(Machine.open(folder / "mine.py"), effects=(effect,))


def test_a_machine_without_the_effect_lacks_nothing(folder: Path) -> None:
    study = slipstick.study(Machine.open(folder / "mine.py"), folder / "of_mine.h5", progress=False)
    assert study.answer == "Nothing is missing that these recordings could show"
    assert (study.result.kind, study.result.gap, study.findings) == ("none", None, [])
    assert list(study.pictures()) == ["overlay", "signals"]
    entries = [lead for part in advise(study.result).parts if isinstance(part, Items) for lead, _ in part.entries]
    assert entries == ["Keep the model:", "Take over:", "Where it holds:", "Next experiment:"]


def test_the_box_has_conditions_new_parameters_and_numbers_of_the_law(studied: MachineStudy) -> None:
    result = studied.result
    text, rows = tell(advise(result))
    assert ("fan voltage 1 to 8 V, heater voltage 0 to 60 V and room temperature 18 to 24 °C: what was recorded."
            ) in text["Where it holds:"]
    finding, transfer = studied.findings[0], next(each for each in result.parameters if each.name == "transfer")
    assert finding.law is not None
    assert finding.law.x is not None
    assert finding.law.formula is not None
    # Beside this value the law is 0 where the report says so: together they are the bench's cooling there.
    zero = float(re.findall(r"it is 0 where the temperature is ([\d.]+) °C", text["Add:"])[0])
    assert np.interp(zero, finding.law.x, finding.law.formula) == pytest.approx(0, abs=1e-3)
    assert transfer.value == pytest.approx(0.5 * (1 + SLOPE * (zero - 21)), rel=0.05)
    assert ("transfer", f"{transfer.value:#.4g} W/K", f"{transfer.lower:#.4g} to {transfer.upper:#.4g} W/K",
            "0.5000 W/K") in rows
    rise, by_equation = (float(number) for number in re.findall(r"([\d.]+) %", text["Measured:"]))
    assert by_equation == pytest.approx(rise, rel=0.15)


def tell(section: Section) -> tuple[dict[str, str], list[tuple[str, ...]]]:
    """Return lead -> text of the entries of a section, and the rows of its tables."""
    entries = [entry for part in section.parts if isinstance(part, Items) for entry in part.entries]
    return dict(entries), [row for part in section.parts if isinstance(part, Table) for row in part.rows]


def test_the_report_compares_a_finding_with_the_next_best(studied: MachineStudy) -> None:
    finding, = studied.result.findings
    assert finding.next_best is not None
    assert finding.next_best.nats is not None
    assert finding.next_best.behind is not None
    assert finding.nats > finding.next_best.nats
    assert finding.next_best.behind > 2.5  # standard errors: or it would be a rival
    text, _ = tell(find_section(studied.result, "Finding: cooling that depends on the temperature (proportional)"))
    assert text["Rivals:"].startswith("no other pair that was fitted in full is close. The next best is ")
    assert f"({finding.next_best.nats:.4g} nats, behind by " in text["Rivals:"]
    tie = replace(finding, rivals=[replace(finding.next_best, depends_on="temperature", quantity="lost heat")])
    text, _ = tell(advise(replace(studied.result, findings=[tie])))
    assert "Record first what tells it apart from lost heat" in text["Do not add yet:"]
    assert "runs over the temperature alone do not tell cooling and lost heat apart" in text["Next experiment:"]


def find_section(result: MachineStudyResult, title: str) -> Section:
    return next(section for section in sections(result, []) if section.title == title)


def test_parameters_are_shown_with_and_without_the_findings_and_marked(studied: MachineStudy) -> None:
    marked = replace(studied.result.parameters[0], before=0.7, beyond_before=True, beyond=False, determined=False)
    result = replace(studied.result, parameters=[marked, *studied.result.parameters[1:]])
    table, = (part for part in find_section(result, "Parameters").parts if isinstance(part, Table))
    assert table.head[1:4] == ("declared", "mean without", "mean with the findings")
    assert (table.rows[0][2], table.rows[0][-1]) == ("0.7000 m/s/V (outside of what is declared)", "not determined")
    transfer = next(row for row in table.rows if row[0] == "transfer")
    before = next(each.before for each in result.parameters if each.name == "transfer")
    assert transfer[1:3] == ("0.5000 W/K", f"{before:#.4g} W/K")


def test_a_finding_whose_block_leaves_more_than_noise_is_not_to_be_added_yet(studied: MachineStudy) -> None:
    result = replace(studied.result, blocks=[replace(block, unexplained=block.name == "plate")
                                             for block in studied.result.blocks])
    text, _ = tell(advise(result))
    assert "With it, “plate” still leaves more than noise" in text["Do not add yet:"]
    assert "Add:" not in text
    estimate = replace(studied.findings[0].coefficients[0], lower=-1.0, upper=1.0)
    _, rows = coefficient_table(replace(studied.result.findings[0], coefficients=[estimate]))
    assert rows[0][-1].endswith(", contains 0")


def test_a_calibration_tells_parameters_and_what_is_left(folder: Path) -> None:
    machine = Machine.open(folder / "mine.py")
    fitted = slipstick.calibrate(machine, folder / "of_mine.h5", progress=False)
    known = {each.name: each for each in fitted.parameters}
    assert known["fan lag"].lower < 2.0 < known["fan lag"].upper
    assert all(chi < 1.1 for chi in fitted.chi_square.values())
    lacking = slipstick.calibrate(machine, folder / "of_bench.h5", progress=False)
    assert lacking.chi_square["plate"] > 1.5
    job = {"id": "a", "recordings": "of_bench", "recordings_digest": "d", "model_digest": None, "submitted": "",
           "ended": ""}
    for each, chi_square in ((lacking, 2.5), (fitted, 1.0)):
        result = {**each.to_dict(), "chi_square": {**each.chi_square, "plate": chi_square}}
        page = calibration_page(job, {"result": result, "seconds": {}, "processor_seconds": {}})
        assert ("An effect is missing:" in page) == (each is lacking)
        assert "0.5000 W/K" in page  # as declared
        assert "`" not in page


def test_a_study_is_saved_and_opened_with_its_pictures(studied: MachineStudy, tmp_path: Path) -> None:
    again = slipstick.open_result(studied.save(tmp_path / "study.json"))
    assert isinstance(again, MachineStudy)
    assert again.to_dict() == studied.to_dict()
    assert list(again.pictures()) == ["overlay", "law", "signals"]
    page = studied.report(tmp_path / "study.html").read_text()
    for text in ("cooling that depends on the temperature", "W/K", "°C", "with the control", "heated plate"):
        assert text in page
    finding, gap = studied.findings[0], studied.result.gap
    assert gap is not None
    assert gap.closed is not None
    box = page[page.index("What to do"):page.index("Machine heated plate · recordings")]
    for text in ("1/°C) * temperature, up to a constant", "Where it holds:", "Next experiment:", "instead of",
                 f"closes {100 * min(gap.closed, 1):.0f} % of its gap", *(
                     f"{each.lower:#.4g} to {each.upper:#.4g}" for each in finding.coefficients)):
        assert text in box
    csv = re.search(r'download="cooling_over_temperature.csv" href="data:text/csv[^"]*;base64,([^"]+)"', box)
    assert csv is not None
    files = [path.name for path in studied.save_laws(tmp_path / "laws")]
    assert base64.b64decode(csv[1]) == (tmp_path / "laws" / files[0]).read_bytes()
    assert files == [f"1_cooling_over_temperature{suffix}" for suffix in (".csv", ".mat", ".mo", ".h")]
    assert "temperature [degC]" in (tmp_path / "laws" / files[0]).read_text()
    assert finding.law is not None
    assert finding.law.save(tmp_path / "law.csv").read_bytes() == (tmp_path / "laws" / files[0]).read_bytes()
    assert finding.law.plot().spec == studied.pictures()["law"][0]


def test_commands_do_the_same(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runs, machine, named = str(folder / "few.h5"), str(folder / "mine.py"), tmp_path / "named.py"
    named.write_text(f"from slipstick.machine import Effect\n{(folder / 'mine.py').read_text()}".replace(
        "    duration=", """    effects=(Effect("free convection", "cooling", "temperature", "proportional"),
             Effect("radiation", "cooling", "temperature", "quadratic")),
    duration="""))
    assert main(["study", runs, "--machine", str(named), "--out", str(tmp_path / "s.json")]) == 0
    assert "Missing: free convection: cooling that depends on the temperature" in capsys.readouterr().out
    result = json.loads((tmp_path / "s.json").read_text())["result"]
    finding, = result["findings"]
    assert result["machine"] == "heated plate"
    assert (finding["effect"], finding["kind"]) == ("free convection", "proportional")
    assert finding["equation"] is not None
    assert finding["law"]["formula"] is not None
    assert main(["calibrate", "--recordings", runs, "--machine", machine]) == 0
    assert "fan lag" in capsys.readouterr().out
    assert main(["study", runs, "--machine", machine, "--extended", "x.json"]) == 1
    assert "is about a bench" in capsys.readouterr().err
    for command in (["study", runs], ["calibrate", "--recordings", runs], ["simulate"], ["build"]):
        with pytest.raises(SystemExit):
            main([*command, "--machine", machine, "--bench", "heavy"])
        assert "argument --bench: not allowed with argument --machine" in capsys.readouterr().err
    assert main(["calibrate", "--recordings", runs, "--machine", machine, "--time-budget", "0"]) == 1
    assert "The time budget of 0 s ended before the parameters were fitted" in capsys.readouterr().err
    for command in (["study", "sample"], ["calibrate"]):
        assert main([*command, "--dask", "tcp://127.0.0.1:1"]) == 1
        assert "--dask is about many runs of a declared machine, not about a bench. Leave it out." in (
            capsys.readouterr().err)
    assert main(["study", runs, "--bench", "heavy"]) == 1
    assert "has runs of a declared machine. Give its file as --machine" in capsys.readouterr().err
    assert main(["study", str(FOLDER / "sample.h5"), "--machine", machine]) == 1
    assert "has no runs of a declared machine" in capsys.readouterr().err


def test_the_worker_studies_runs_of_the_library_and_its_output_makes_the_report(job: Job) -> None:
    output, said = job.output, job.said
    assert output["result"]["sentence"].startswith("Missing: cooling")
    assert list(dict.fromkeys((entry["stage"], entry["step"], entry["steps"]) for entry in said)) == [
        ("name", 1, 5), ("name", 2, 5), ("confirm", 3, 5), ("confirm", 4, 5), ("confirm", 5, 5)]
    assert [entry["done"] for entry in said] == [(entry["step"] - 1) / 5 for entry in said]
    beginnings = {entry["step"]: entry["doing"] for entry in reversed(said)}
    assert beginnings[1] == "Fitting the parameters of “fan”"
    assert re.fullmatch(r"Comparing \d+ laws", beginnings[2])
    assert beginnings[4].startswith("Fitting the whole machine with laws; without them, chi-square ")
    partial = study_steps.end_declared(job.order, job.kept[-1], 60.0)
    assert partial["result"]["partial"]["missing"] == ["the simulation of the whole machine, and with it the gap"]
    assert partial["result"]["gap"] is None
    with pytest.raises(TimeBudgetEnded):
        study_steps.end_declared(job.order, None, 60.0)
    of = {"id": "a", "recordings": "of_bench", "recordings_digest": "d", "machine": "heated plate", "settings": {},
          "submitted": "", "ended": ""}
    for each in (output, {**partial, "seconds": {"study": 1.0}}):
        page = made.page(json.dumps({"kind": "study", "job": of, "output": each, "fits": None}).encode()).decode()
        assert ("Partial result" in page) == (each is not output)


def test_a_study_whose_budget_ends_at_once_has_nothing_to_show(folder: Path) -> None:
    with pytest.raises(TimeBudgetEnded):
        slipstick.study(Machine.open(folder / "mine.py"), folder / "of_bench.h5", budget=0, progress=False)


@pytest.mark.parametrize(("given", "error", "cause"), [
    ({"nats": "many"}, InvalidValue, "nats"), ({"level": 0.9}, UnknownName, "no setting 'level'"),
    ({"errors": -1}, InvalidValue, "errors is -1")])
def test_settings_that_are_none_of_the_engine_are_refused(folder: Path, given: dict[str, Any], error: type[Exception],
                                                           cause: str) -> None:
    with pytest.raises(error, match=cause):
        slipstick.study(Machine.open(folder / "mine.py"), folder / "of_bench.h5", settings=given, progress=False)


def test_runs_of_another_machine_are_refused(folder: Path) -> None:
    motor = Machine.open("dc_motor")
    runs = simulate_runs(motor, list_experiments(motor))
    with pytest.raises(BadRecording, match="lack the signal 'air speed'"):
        study_machine(Machine.open(folder / "mine.py"), runs)
    with pytest.raises(InvalidValue, match="not of a bench"):
        slipstick.study("heavy", runs)
    with ThreadPoolExecutor() as executor:
        for function in (slipstick.study, slipstick.calibrate):
            with pytest.raises(InvalidValue, match="not with a bench"):
                function("heavy", "sample", executor=executor)  # type: ignore[operator]
    with pytest.raises(InvalidValue, match="no model file"):
        slipstick.calibrate(motor, runs, model="model.json")  # type: ignore[call-overload]


def test_too_few_runs_are_refused(folder: Path) -> None:
    runs = Runs.open(folder / "of_mine.h5").take(np.arange(2))
    with pytest.raises(BadRecording, match="at least 3 runs that can agree, and the recordings have 2"):
        study_machine(Machine.open(folder / "mine.py"), runs)


def test_runs_that_are_far_off_are_set_aside_and_said(folder: Path) -> None:
    runs = Runs.open(folder / "of_mine.h5")
    signals = {name: values.copy() for name, values in runs.signals.items()}
    signals["temperature"][7, 40:] += 9.0
    names = tuple(f"plate.csv, run {number}" for number in range(len(runs)))
    named, machine = replace(runs, signals=signals, names=names), Machine.open(folder / "mine.py")
    result, figures = study_machine(machine, named)
    assert (result.set_aside, result.run_names) == ([7], list(names))
    assert result.findings == []
    assert "Set aside: run 7 (plate.csv, run 7)," in dict(warnings(result))
    first = figures.runs[0].run
    assert f"{first} (plate.csv, run {first})" in machine_pictures(result, figures)["signals"]["title"]["text"]
    fitted = slipstick.calibrate(machine, named, progress=False)
    assert "Runs set aside: 7 (plate.csv, run 7)." in fitted.summary()
    assert MachineCalibration.from_dict(fitted.to_dict()).summary() == fitted.summary()
    assert name_run(7, []) == "7"


def test_what_explains_runs_that_are_set_aside_is_a_finding_of_these_runs(folder: Path, tmp_path: Path) -> None:
    """An effect of the bench that three runs have alone; the others are those of the machine as it is declared."""
    machine, plain, other = (Machine.open(folder / "mine.py"), *(
        Runs.open(folder / f"of_{name}.h5") for name in ("mine", "bench")))
    rows = [6, 12, 20]
    signals = {name: values.copy() for name, values in plain.signals.items()}
    for name, values in signals.items():
        values[rows] = other.signals[name][rows]
    study = slipstick.study(machine, replace(plain, signals=signals), progress=False)
    assert study.result.set_aside == rows
    finding, = study.findings
    assert (finding.quantity, finding.depends_on, finding.runs) == ("cooling", "temperature", rows)
    assert study.answer.endswith("in the runs 6, 12, and 20 alone")
    assert finding.law is not None
    assert study.result.gap is None
    assert {shown.run for shown in study.figures.runs} == set(rows)
    assert MachineStudy.from_dict(study.to_dict()).findings[0].runs == rows
    assert "Find out what differs in these runs:" in study.report(tmp_path / "study.html").read_text()
    for findings, missing in ((study.findings, 1), ([], 2)):  # before these runs were searched, as well
        partial = end_early((replace(study.result, findings=findings), study.figures), 60.0)[0].partial
        assert partial is not None
        assert len(partial.missing) == missing


Change = Callable[[str], str]


@pytest.mark.parametrize(("change", "key", "what"), [
    (lambda text: text.replace("- q.lost_heat", ""), "lost heat", "no signal changes with it"),
    (lambda text: text.replace("return p.first_temperature", "return 0 * u.heater_voltage"), "first temperature",
     "no signal changes with it"),
    (lambda text: text.replace("noise=0.05", "noise=80.0"), "temperature", "its noise is"),
    (lambda text: text.replace('without=("air speed",)', 'without=("air sped", "past fan voltage")'), "power",
     "it names 'air sped'"),
    (lambda text: text.replace("noise=0.05", "noise=0.0"), "temperature", "has no noise"),
    (lambda text: text.replace("above=60.0", "above=100.0"), "warm_up_time", "have no such output"),
    (lambda text: text.replace("quantities=(air,)", "quantities=()").replace("* (1 + q.air)", ""), "fan",
     "has no quantity"),
    (lambda text: text.replace("value=2.0)", "value=0.3)").replace("step=0.5", "step=2.0"), "air speed",
     "half the step"),
    (lambda text: text.replace("np.maximum(u.air_speed, 0)", "np.nan_to_num(u.air_speed)").replace(
        "step=0.5", "step=5.0"), "plate", "its rate cannot be recorded: they call nan_to_num"),
    (lambda text: text.replace("value=50.0)", "value=50.0, scatter=10.0)"), "heat capacity",
     "its `scatter` is 1000 % of its value"),
])
def test_a_check_tells_what_is_implausible(tmp_path: Path, capsys: pytest.CaptureFixture[str], change: Change, key: str,
                                           what: str) -> None:
    (tmp_path / "mine.py").write_text(change(SOURCE))
    assert main(["machine", "check", str(tmp_path / "mine.py")]) == 0
    said = capsys.readouterr().out
    assert f"{key}: " in said
    assert what in said


def test_the_template_and_shipped_machines_have_nothing_implausible(tmp_path: Path,
                                                                    capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["machine", "new", str(tmp_path / "new.py")]) == 0
    for name in (str(tmp_path / "new.py"), "two_tanks", "dc_motor"):
        assert main(["machine", "check", name]) == 0
        assert "Nothing implausible was found." in capsys.readouterr().out
    assert main(["machine", "new", str(tmp_path / "new.py")]) == 1
    assert "already exists" in capsys.readouterr().err


def test_equations_that_end_in_no_number_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.py").write_text(SOURCE.replace("return (heating", "return np.log(-1 - heating) + (heating"))
    assert main(["machine", "check", str(tmp_path / "mine.py")]) == 1
    assert "error: " in capsys.readouterr().err


def test_a_picture_of_the_experiments_is_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["machine", "check", "two_tanks", "--picture"]) == 0
    assert "level 1 [m]" in (tmp_path / "two_tanks.svg").read_text()


def test_fits_that_have_not_converged_and_blocks_that_are_worse_with_the_findings_are_warned_about(
        studied: MachineStudy) -> None:
    result = studied.result
    assert not [lead for lead, _ in warnings(result) if "block" in lead]
    first, *others = result.blocks
    worse = replace(first, chi_square=1.5 * first.before, converged=False)
    said = dict(warnings(replace(result, blocks=[worse, *others])))
    assert "`switches`" in said[f"Not converged: block “{first.name}”."]
    assert f"Worse with the findings: block “{first.name}”." in said
    switching = replace(first, converged=False, switches=["fan speed"])
    again = dict(warnings(replace(studied.result, blocks=[switching, *others])))
    assert again[f"Not converged: block “{first.name}”."].endswith("may be those of the fit.")
