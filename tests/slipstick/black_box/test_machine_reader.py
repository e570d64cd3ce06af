"""The file of a machine: what it says, and errors with key and line."""

import hashlib
import sys
import types
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

import h5py
import numpy as np
import pytest

from slipstick.black_box import BlackBox, BlackBoxDescription, Measurements
from slipstick.black_box.bridge import Bridge
from slipstick.black_box.measurements import MARK
from slipstick.errors import BadBench, BadRecording, SlipstickError, UnknownName
from slipstick.storage.library import Library

MOTOR = (Path(__file__).parents[3] / "docs" / "motor.toml").read_text()
SERVER = 'url = "http://127.0.0.1:4242"\nmodel = "motor"\n'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "motor.py").write_text("def run_up_time(**inputs):\n    return 1.0\n")
    return tmp_path


def read(folder: Path, *changes: tuple[str, str]) -> BlackBoxDescription:
    text = MOTOR
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    (folder / "motor.toml").write_text(text)
    return BlackBox.open(folder / "motor.toml").description


def test_a_machine_survives_its_spec(folder: Path) -> None:
    machine = read(folder)
    assert BlackBoxDescription.from_spec(machine.spec()) == machine
    assert [entry.name for entry in machine.inputs] == ["resistance", "friction"]
    assert machine.input("friction").nominal == 0.1
    assert BlackBox.open(folder / "motor.toml").cases.described(0) == "voltage 12 V, inertia 0.002 kg m²"


def test_the_digest_is_that_of_machine_and_simulator(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    digest = read(folder).digest
    assert read(folder, ("# uncertain", "# ")).digest == digest
    assert read(folder, ('"1.2 ohm"', '"1.3 ohm"')).digest != digest
    monkeypatch.setitem(sys.modules, "motor", types.ModuleType("motor"))  # as of another folder
    (folder / "motor.py").write_text("def run_up_time(**inputs):\n    return 2.0\n")
    assert read(folder).digest != digest
    compiled = folder / f"motor{EXTENSION_SUFFIXES[0]}"
    (folder / "motor.py").rename(compiled)
    assert read(folder).simulator.endswith(hashlib.sha256(compiled.read_bytes()).hexdigest())


def test_an_um_bridge_model_takes_its_arguments_by_name(folder: Path) -> None:
    def simulator(*lines: str) -> Bridge:
        read(folder, ('callable = "motor:run_up_time"', SERVER + "\n".join(lines)))
        found = BlackBox.open(folder / "motor.toml").simulator
        assert isinstance(found, Bridge)
        return found

    assert simulator().arguments == (("resistance", "friction", "voltage", "inertia"),)
    split = simulator('arguments = [["friction"], ["voltage", "resistance"]]', "config = { level = 2 }")
    assert split.arguments == (("friction",), ("voltage", "resistance"))
    assert split.config == {"level": 2}
    moved = simulator().identity
    read(folder, ('callable = "motor:run_up_time"', SERVER.replace("4242", "4343")))
    assert BlackBox.open(folder / "motor.toml").simulator.identity == moved  # a server may move


@pytest.mark.parametrize(("before", "after", "message"), [
    ("points = 17", "point = 17", r"line 15, inputs.resistance.point: the key is unknown.*Did you mean 'points'"),
    ("points = 17", "points = 1", "line 15, inputs.resistance.points: 1 is not a number of grid points"),
    ("range = [0.6, 1.4]", "range = [0.6]", "line 14, inputs.resistance.range: there are 1 numbers"),
    ("range = [0.6, 1.4]", "range = [1.4, 0.6]", "'resistance' is 1.2 ohm times 1.4 to 0.6"),
    ('"1.2 ohm"', '"0 ohm"', "Give a nominal value other than 0"),
    ('"1.2 ohm"', '"1.2ohm"', "inputs.resistance.nominal: '1.2ohm' has no unit. Write a number, a space and its unit"),
    ('"1.2 ohm"', '"1,2 ohm"', "Write a number with a decimal point, a space and its unit"),
    ('nominal = "1.2 ohm"\n', "", "inputs.resistance.nominal: the key is missing.*docs/any_machine.md"),
    ("[12, 12, 18, 18, 24, 24]", "[12, 12]", "line 24, conditions.inertia: there are 6 numbers, but 2 of 'voltage'"),
    ("voltage =", "friction =", "A name stands for more than one thing"),
    ("inertia =", "Inertia =", "'Inertia' is not a valid name"),
    ('"10 s"', '"10 V"', "simulator.timeout: the unit 'V' cannot be converted to s"),
    ('"10 s"', '"-1 s"', "simulator.timeout: the time is not positive"),
    ('callable = "motor:run_up_time"', "", "either a callable or an UM-Bridge model"),
    ('callable = "motor:run_up_time"', 'callable = "moter:run_up_time"', "there is no module 'moter'"),
    ('callable = "motor:run_up_time"', SERVER.replace("http", "file"), "is not the URL of a server"),
    ('callable = "motor:run_up_time"', SERVER + 'arguments = [["voltage"]]', "the input 'resistance' is missing"),
    ('callable = "motor:run_up_time"', SERVER + 'arguments = [["volts"]]', "'volts' is neither an input nor"),
])
def test_errors_name_the_key_and_the_line(folder: Path, before: str, after: str, message: str) -> None:
    with pytest.raises(SlipstickError, match=message) as refused:
        read(folder, (before, after))
    assert isinstance(refused.value, BadBench)


def test_measurements_are_in_the_units_of_the_machine(folder: Path) -> None:
    machine = read(folder)
    content = b"# a bench\ninertia [g m^2],voltage [V],run_up_time [ms]\n2,12,570\n2,12,590\n"
    found = Measurements.read_csv(content, machine)
    np.testing.assert_allclose(found.measured_time, [0.57, 0.59])
    np.testing.assert_allclose(found.conditions.values, [[12, 0.002]] * 2)
    again = Measurements.read(found.to_bytes())
    assert (again.digest, again.description) == (found.digest, "a bench")
    for change, message in ((b"[ms]", "'V' cannot be converted to s"), (b",590", "Row 4 has 2 cells")):
        with pytest.raises(BadRecording, match=message):
            Measurements.read_csv(content.replace(change, b"" if change == b",590" else b"[V]"), machine)


def test_an_uploaded_recordings_file_cannot_be_read_as_measurements(tmp_path: Path) -> None:
    shipped = (Path(__file__).parents[3] / "tables" / "measured-compact.h5").read_bytes()
    (tmp_path / "marked.h5").write_bytes(shipped)
    with h5py.File(tmp_path / "marked.h5", "r+") as file:
        file.attrs[MARK] = "run_up_time"
    content = (tmp_path / "marked.h5").read_bytes()
    (tmp_path / "marked.h5").unlink()
    library = Library(tmp_path)
    with pytest.raises(BadRecording, match="attribute 'measurements'"):
        library.add_recordings("mine", content, "h5")
    assert library.recordings() == []
    library.add_recordings("mine", shipped, "h5")
    assert library.recordings() == ["mine"]


def test_a_machine_in_the_folder_of_the_tables_is_no_bench(folder: Path) -> None:
    read(folder)
    (folder / "wrong.toml").write_text("simulator = 1")
    (folder / "damaged.toml").write_text("simulator = ")
    (folder / "bench.toml").write_bytes((Path(__file__).parents[3] / "tables" / "compact.toml").read_bytes())
    library = Library(folder)
    assert library.benches() == ["bench", "damaged"]
    with pytest.raises(UnknownName):
        library.bench("motor")
    with pytest.raises(FileExistsError):
        library.add_bench("motor", (folder / "bench.toml").read_bytes())
