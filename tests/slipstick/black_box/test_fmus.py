"""FMUs as simulators: outputs beside those of the equations, units, trouble, and what a file gets wrong."""

import sys
import time
from pathlib import Path

import numpy as np
import pytest

from slipstick.black_box import BlackBox, Workers
from slipstick.black_box.function import NoResult
from slipstick.errors import BadBench, InvalidValue
from slipstick.interface.build import build
from slipstick.storage.library import Library
from tests.fmus import DESCRIPTION, build_co_simulation, build_fmi_3, build_model_exchange, pack

CO_SIMULATION = '''
title = "A lag"
simulator = { fmu = "Lag.fmu", parameters = { constant = "tau" }, duration = "2 s", step = "0.01 s", timeout = "2 s" }
output = { name = "rise", unit = "ms", of = "level", above = 1.0 }
inputs.gain = { nominal = 2, range = [0.2, 2] }
inputs.constant = { nominal = "0.5 s", range = [0.5, 1.5] }
conditions.drive = [1, 2]
'''
EXCHANGE = '''
title = "A lag"

[simulator]
fmu = "lag.fmu"
parameters = { gain = "lag.gain", constant = "lag.T" }

[output]
name = "level"
unit = "m"

[inputs]
gain = { nominal = 2, range = [0.5, 1.5] }
constant = { nominal = "500 ms", range = [0.5, 1.5] }

[conditions]
drive = { values = [1, 2], unit = "m" }
'''


@pytest.fixture(scope="module")
def slave(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("slave")
    build_co_simulation(folder, "Lag")
    return folder


@pytest.fixture(scope="module")
def exchange(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exchange")
    build_model_exchange(folder)
    return folder


def read(folder: Path, text: str, *changes: tuple[str, str]) -> BlackBox:
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    (folder / "lag.toml").write_text(text)
    return BlackBox.open(folder / "lag.toml")


def test_a_time_of_a_co_simulation_is_that_of_the_equations(slave: Path) -> None:
    file = read(slave, CO_SIMULATION)
    table = build(file, {"gain": (0.2, 1.2, 3), "constant": (0.5, 1.5, 3)}, threads=1, progress=False)
    gain, constant, drive = np.meshgrid([0.4, 1.4, 2.4], [250, 500, 750], [1, 2], indexing="ij")
    with np.errstate(invalid="ignore"):
        expected = -constant * np.log(1 - 1 / (gain * drive))
    expected[~(expected < 2000)] = np.nan  # the level stays below 1
    np.testing.assert_allclose(table.times, expected, atol=0.2)  # linear between samples of 10 ms
    assert np.isnan(table.times).sum() == 6
    level = read(slave, CO_SIMULATION, ('unit = "ms", of = "level", above = 1.0', 'unit = "m", of = "level"'))
    [end, _] = level.simulator.run({"gain": 2.0, "constant": 5.0}, level.cases)
    assert end == pytest.approx(2 * (1 - np.exp(-2 / 5)))  # in the unit of the file: the FMU declares none


@pytest.mark.parametrize(("gain", "reason"), [
    (1.3, "the FMU ended at 0 s"), (1.4, "FMICallException: fmi2DoStep failed"), (1.6, "no result within 2 s"),
    (1.9, "the FMU crashed its process")])
def test_trouble_is_a_failed_run(slave: Path, gain: float, reason: str) -> None:
    file = read(slave, CO_SIMULATION)
    begin = time.monotonic()
    [first, second] = file.simulator.run({"gain": 2 * gain, "constant": 0.5}, file.cases)
    assert isinstance(first, NoResult)
    assert reason in str(first)
    assert str(second) == str(first)
    assert time.monotonic() - begin < 20
    [healthy, _] = file.simulator.run({"gain": 2.0, "constant": 0.5}, file.cases)
    assert healthy == pytest.approx(500 * np.log(2), abs=0.2)


def test_fmi_3_is_simulated(tmp_path: Path) -> None:
    build_fmi_3(tmp_path, "Lag3")
    file = read(tmp_path, CO_SIMULATION, ("Lag.fmu", "Lag3.fmu"))
    found = np.array(file.simulator.run({"gain": 2.0, "constant": 0.4}, file.cases))
    np.testing.assert_allclose(found, 400 * np.log(np.array([2, 4 / 3])), atol=0.2)


def test_a_build_goes_on_after_a_crash(slave: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = read(slave, CO_SIMULATION)
    table = build(file, {"gain": (1.0, 1.9, 2)}, threads=2, out=tmp_path / "t.h5", progress=False)
    assert table.status.tolist() == [[0, 0], [2, 2]]
    assert "The first that failed: gain 3.8, drive 1: the FMU crashed its process" in capsys.readouterr().err
    (tmp_path / "service").mkdir()
    assert Library(tmp_path / "service").add_table("lag", (tmp_path / "t.h5").read_bytes())


def test_whole_numbers_are_conditions(slave: Path) -> None:
    file = read(slave, CO_SIMULATION, ("drive = [1, 2]", "teeth = [1, 1.5]"))
    [whole, other] = file.simulator.run({"gain": 2.0, "constant": 0.5}, file.cases)
    assert whole == pytest.approx(500 * np.log(2), abs=0.2)
    assert "'teeth' takes whole numbers" in str(other)
    with pytest.raises(BadBench, match="'teeth' of the FMU is of type Integer"):
        read(slave, CO_SIMULATION, ("inputs.gain", "inputs.teeth"))


def test_a_model_exchange_is_integrated_in_its_units(exchange: Path) -> None:
    file = read(exchange, EXCHANGE)  # m and ms here, mm and s there; duration and step are those of the FMU
    with Workers(file, 1) as workers:
        found, _ = workers.simulate(("gain", "constant"), np.array([[1.0, 1.0], [1.2, 0.5]]), file.cases)
    expected = [[gain * drive * (1 - np.exp(-2 / constant)) for drive in (1, 2)]
                for gain, constant in ((2.0, 0.5), (2.4, 0.25))]
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    below = ('unit = "m"\n\n[inputs]', 'unit = "ms"\nof = "der(level)"\nbelow = 2000\n\n[inputs]')
    falls = read(exchange, EXCHANGE, below, ('name = "level"', 'name = "fall"')).simulator
    found = np.array(falls.run({"gain": 2.0, "constant": 500.0}, file.cases))
    np.testing.assert_allclose(found, 500 * np.log(np.array([2, 4])), atol=0.2)
    above = read(exchange, EXCHANGE, ('unit = "m"\n\n[inputs]', 'unit = "s"\nof = "level"\nabove = "1 m"\n\n[inputs]'),
                 ('name = "level"', 'name = "rise"')).simulator
    [rise, _] = above.run({"gain": 2.0, "constant": 500.0}, file.cases)
    assert rise == pytest.approx(0.5 * np.log(2), abs=2e-4)
    mean = read(exchange, EXCHANGE, ('unit = "m"\n\n[inputs]', 'unit = "m"\ntake = "mean"\n\n[inputs]')).simulator
    [average, _] = mean.run({"gain": 2.0, "constant": 500.0}, file.cases)
    assert average == pytest.approx(2 * (1 - 0.25 * (1 - np.exp(-4))), rel=5e-3)


def test_the_identity_is_that_of_bytes_and_settings(exchange: Path, tmp_path: Path) -> None:
    own = read(exchange, EXCHANGE).description.simulator
    (tmp_path / "moved.fmu").write_bytes((exchange / "lag.fmu").read_bytes())
    assert read(tmp_path, EXCHANGE, ("lag.fmu", "moved.fmu")).description.simulator == own
    step = ('fmu = "lag.fmu"', 'fmu = "lag.fmu"\nstep = "0.02 s"')
    assert read(exchange, EXCHANGE, step).description.simulator != own
    pack(tmp_path / "moved.fmu", DESCRIPTION.replace('start="0.5"', 'start="0.6"'), exchange / "lag.so")
    assert read(tmp_path, EXCHANGE, ("lag.fmu", "moved.fmu")).description.simulator != own


@pytest.mark.parametrize(("before", "after", "message"), [
    ('"lag.fmu"', '"lug.fmu"', "line 5, simulator.fmu: there is no file"),
    ('"lag.fmu"', '"lag.toml"', "line 5, simulator.fmu: 'lag.toml' is not an FMU: it is no ZIP archive"),
    ('"lag.gain"', '"lag.gian"', "line 6, simulator.parameters.gain: There is no variable 'lag.gian' in the FMU. Did "
                                 "you mean 'lag.gain'"),
    ("gain = {", "gian = {", "'gain': this is no input|gain: this is no input or condition"),
    ('"lag.gain"', '"level"', "'level' of the FMU is no parameter or input, but of the causality 'output'. Known: lag"),
    ('name = "level"', 'name = "levle"', "line 9, output.name: There is no variable 'levle' in the FMU. Did you mean"),
    ('"500 ms"', '"500 m"', "'lag.T' of the FMU is in 's', and here in 'm'"),
    ('unit = "m"\n\n[inputs]', 'unit = "kg"\n\n[inputs]', "line 10, output.unit: 'level' of the FMU is in 'mm'"),
    ('unit = "m"\n\n[inputs]', 'unit = "m"\nabove = 1\n\n[inputs]', "above: the unit 's' cannot be converted to m"),
    ('unit = "m"\n\n[inputs]', 'unit = "s"\nabove = "1 V"\n\n[inputs]', "the unit 'V' cannot be converted to mm"),
    ('unit = "m"\n\n[inputs]', 'unit = "m"\ntake = "last"\n\n[inputs]', "'last' cannot be taken of a variable"),
    ('unit = "m"\n\n[inputs]', 'unit = "s"\nabove = 1\nbelow = 2\n\n[inputs]', "an output is either a time or a value"),
    ('fmu = "lag.fmu"', 'fmu = "lag.fmu"\nstep = "0.3 s"', "simulator.step: a duration of 2 s is no multiple of 0.3 s"),
    ('fmu = "lag.fmu"', 'fmu = "lag.fmu"\nurl = "http://a"', "simulator.url: the key is unknown"),
])
def test_errors_name_the_key_and_the_line(exchange: Path, before: str, after: str, message: str) -> None:
    with pytest.raises(BadBench, match=message):
        read(exchange, EXCHANGE, (before, after))


def test_fmus_that_cannot_run_here_are_refused(exchange: Path, tmp_path: Path) -> None:
    library = exchange / "lag.so"
    for description, platform, message in (
            (DESCRIPTION, "win64", "has no binary for .*, but for: none"),
            (DESCRIPTION.replace('fmiVersion="2.0"', 'fmiVersion="4.0"'), "linux64", "cannot be read: .*4.0"),
            ("<fmiModelDescription", "linux64", "cannot be read")):
        pack(tmp_path / "lag.fmu", description, library, platform)
        with pytest.raises(BadBench, match=message):
            read(tmp_path, EXCHANGE)


def test_a_missing_package_is_named(exchange: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fmpy", None)
    with pytest.raises(BadBench, match=r"pip install 'slipstick\[fmu\]'"):
        read(exchange, EXCHANGE)


def test_an_fmu_that_is_removed_is_missed(slave: Path, tmp_path: Path) -> None:
    (tmp_path / "Lag.fmu").write_bytes((slave / "Lag.fmu").read_bytes())
    file = read(tmp_path, CO_SIMULATION)
    (tmp_path / "Lag.fmu").unlink()
    with pytest.raises(InvalidValue, match="There is no FMU at"):
        file.simulator.run({"gain": 2.0, "constant": 500.0}, file.cases)
