"""What a machine declares as data: nothing of it is lost but the equations, and any other text is refused."""

import dataclasses
import json

import numpy as np
import pytest

from slipstick.acquisition.machine_mapping import read_machine_mapping
from slipstick.errors import InvalidValue
from slipstick.machine import (
    Block,
    Command,
    Condition,
    Effect,
    Kind,
    Machine,
    MachineDescription,
    Parameter,
    Quantity,
    Sensor,
    channels_of,
    describe_machine,
    list_experiments,
    open_machine,
)
from slipstick.machine.description import LARGEST, _adapter
from slipstick.storage.shipped import FOLDER

SHIPPED = sorted(path.stem for path in (FOLDER / "machines").glob("*.py"))
MAPPING = """
[signals]
"air speed" = { channel = "v", unit = "m/s" }
temperature = { channel = "T", unit = "degC" }
[commands]
"fan voltage" = { channel = "u1", unit = "V" }
"heater voltage" = { channel = "u2", unit = "V" }
[conditions]
"room temperature" = { value = "20 degC" }
"""


@pytest.mark.parametrize("name", SHIPPED)
def test_a_description_is_the_same_after_json(name: str) -> None:
    described = describe_machine(open_machine(name))
    assert described.blocks
    assert described.sensors
    assert MachineDescription.from_json(described.to_json()) == described


@pytest.mark.parametrize("name", SHIPPED)
def test_the_number_of_experiments_is_that_of_their_list(name: str) -> None:
    machine = open_machine(name)
    assert describe_machine(machine).experiments == len(list_experiments(machine))


def test_names_take_the_place_of_functions() -> None:
    described = describe_machine(open_machine("dc_motor"))
    shaft = described.blocks[1]
    assert (shaft.reads, shaft.gives, shaft.states) == (("current", "load torque"), ("speed",), ("speed", "position"))
    assert (shaft.switches, shaft.derived) == (("speed",), ("angle",))
    assert [each.name for each in shaft.parameters][:2] == ["motor constant", "rotor inertia"]


def heater(**more: object) -> Machine:
    block = Block("plate", gives="temperature", reads=("power",), parameters=(Parameter("gain", "K/W", value=1.0),),
                  quantities=(Quantity("loss", "K"),))
    block.output(lambda x, u, q, p: p.gain * u.power - q.loss)
    return Machine("heater", (block,), (Sensor("temperature", "degC"),),
                   **{"commands": (Command("power", "W"),), **more})


def test_effects_have_the_names_of_their_kinds() -> None:
    own = Kind("fourth power", ("factor",), (4,), lambda x, _: [x**4])
    machine = heater(effects=(Effect("radiation", "loss", "temperature", own),
                              Effect("offset", "loss", "power", "constant")))
    assert [each.kind for each in describe_machine(machine).effects] == ["fourth power", "constant"]


def test_a_machine_that_is_not_simulated_has_no_experiments() -> None:
    assert describe_machine(heater()).experiments == 0


def test_numbers_of_numpy_are_written_as_such() -> None:
    corners = np.array([[0.0, 0.0], [1.0, 2.0]])
    machine = heater(commands=(Command("power", "W", profiles=(corners,)),), duration=np.float64(2),
                     step=np.float32(0.5), conditions=(Condition("room", "degC", levels=(*np.arange(18, 26, 6),)),))
    read = MachineDescription.from_json(describe_machine(machine).to_json())
    assert read.commands[0].profiles == (((0.0, 0.0), (1.0, 2.0)),)
    assert (read.duration, read.step, read.conditions[0].levels) == (2.0, 0.5, (18.0, 24.0))


def test_the_channels_suffice_for_a_mapping() -> None:
    machine = open_machine("heated_plate")
    channels = channels_of(MachineDescription.from_json(describe_machine(machine).to_json()))
    assert not channels.blocks
    assert read_machine_mapping(MAPPING.encode(), "a.toml", channels) == read_machine_mapping(
        MAPPING.encode(), "a.toml", machine)
    assert len(list_experiments(channels)) == len(list_experiments(machine))


def test_further_signals_keep_their_names_and_refuse_to_be_computed() -> None:
    channels = channels_of(describe_machine(heater(signals={"rise": lambda measured: measured.temperature})))
    assert list(channels.signals) == ["rise"]
    with pytest.raises(InvalidValue, match="no equations"):
        channels.signals["rise"](None)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"name": "a"}', '{"name": 3, "blocks": [], "sensors": []}',
                                  '{"name": "a", "blocks": [], "sensors": [{"signal": "a", "noise": "loud"}]}'])
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(InvalidValue, match="cannot be read"):
        MachineDescription.from_json(text)


def test_names_that_collide_are_refused() -> None:
    described = dataclasses.replace(describe_machine(heater()), signals=("power",))
    with pytest.raises(InvalidValue, match="both become"):
        channels_of(described)


def test_descriptions_are_limited() -> None:
    corners = tuple((float(place), 0.0) for place in range(LARGEST // 8))
    large = describe_machine(heater(commands=(Command("power", "W", profiles=(corners,)),)))
    with pytest.raises(InvalidValue, match="the limit is"):
        large.to_json()
    with pytest.raises(InvalidValue, match="the limit is"):
        MachineDescription.from_json(json.dumps({"name": "a" * LARGEST}))




def test_the_form_of_descriptions_is_made_once() -> None:
    text = describe_machine(open_machine("dc_motor")).to_json()
    MachineDescription.from_json(text)
    made = _adapter.cache_info().misses
    for _ in range(3):
        MachineDescription.from_json(text).to_json()
    assert _adapter.cache_info().misses == made
