"""A mapping is read with its lines; what it has wrong is refused with key and line."""

import numpy as np
import pytest

from slipstick.acquisition import open_source, propose, read_mapping
from slipstick.acquisition.csv_layout import CsvOptions
from slipstick.acquisition.mapping import ChannelRef, Marker, TimeRef
from slipstick.errors import BadRecording
from tests.benches import COMPACT
from tests.slipstick.acquisition.conftest import MAP, csv, opened, run


def test_a_mapping_is_a_value() -> None:
    mapping = read_mapping(MAP.encode(), "channels.toml")
    assert mapping.signals["output_torque"] == ChannelRef("M_out", "N m", -1.0)
    assert mapping.shift_command == 0.1
    text = MAP.replace('time = "100 ms"', 'channel = "x"\nbelow = 3').replace(
        'sign = -1', 'limits = ["0 N m", "2 kN m"]')
    mapping = read_mapping(text.encode(), "channels.toml")
    assert mapping.shift_command == Marker(ChannelRef("x"), 3.0, rising=False)
    assert mapping.signals["output_torque"].limits == (0.0, 2000.0)
    own = MAP.replace("sign = -1", 'time = { channel = "t2", unit = "ms" }') + "[csv]\nheader = 3\n"
    assert read_mapping(own.encode(), "channels.toml").signals["output_torque"].time == TimeRef("t2", "ms")
    assert read_mapping(own.encode(), "channels.toml").csv == CsvOptions(header=3)


@pytest.mark.parametrize(("old", "new", "says"), [
    ("[signals]", "[signal]", "signal: the key is unknown"),
    ("pressure =", "presure =", "line 3, signals.presure: the key is unknown"),
    ('"kPa"', '"V"', "line 3, signals.pressure.unit: the unit 'V' cannot be converted to bar"),
    ("sign = -1", "sign = 2", "line 6, signals.output_torque.sign: 2 is neither 1 nor -1"),
    ("sign = -1", 'limits = ["1 N m"]', "is not a pair"),
    ('time = "100 ms"', "", "shift_command: this does not say what marks the instant"),
    ('time = "100 ms"', "time = 100", "shift_command.time: the unit is missing"),
    ('{ value = "0.4 kg m^2" }', "{}", "conditions.load_inertia: no source is given"),
    ('{ value = "0.4 kg m^2" }', '{ name = "J", unit = "kg m^2" }', "no group 'J'"),
    ('{ value = "0.4 kg m^2" }', '{ column = "J" }', "no sheet with the column 'J'"),
    ("[conditions]", "[conditions]\npattern = '('", "not a regular expression"),
    ("[conditions]", '[csv]\ndecimal = ";"\n[conditions]', "line 13, csv.decimal: ';' is neither . nor ,"),
    ("[conditions]", '[clock]\nstep = "-1 ms"\n[conditions]', "clock.step: -0.001 s is not positive"),
    ("[conditions]", '[further.Oil]\nchannel = "x"\n[conditions]', "further.Oil: this is not a valid name"),
    ("[conditions]", "[csv]\nheader = 0\n[conditions]", "line 13, csv.header: 0 is not the number of a row"),
    ("sign = -1", 'time = { chanel = "t2" }', "signals.output_torque.time.chanel: the key is unknown"),
    ("[signals]", "[signals", "is not TOML")])
def test_what_is_wrong_has_key_and_line(old: str, new: str, says: str) -> None:
    assert old in MAP
    with pytest.raises(BadRecording) as error:
        read_mapping(MAP.replace(old, new).encode(), "channels.toml")
    assert says in error.value.cause
    assert error.value.cause.startswith("channels.toml")
    assert error.value.remedy


def test_a_guess_says_why_and_what_is_open() -> None:
    heading = csv(run()).replace(b"p_oil", b"Oeldruck [kPa]").replace(b"n_in", b"nTurbine [1/min]").replace(
        b"n_out", b"nAbtrieb [1/min]").replace(b"M_out", b"Drehmoment [Nm]").replace(b"t;", b"Zeit [ms];", 1)
    proposal = propose(open_source("a.csv", opened(heading)), COMPACT)
    chosen = {guess.name: guess.channel and guess.channel.name for guess in proposal.guesses}
    assert chosen == {"time": "Zeit", "pressure": "Oeldruck", "input_speed": "nTurbine", "output_speed": "nAbtrieb",
                      "output_torque": "Drehmoment", "motor_speed": None, "current": None, "oil_temperature": None,
                      "shift_command": None}
    assert set(proposal.open_keys) == {"shift_command", "current_profile", "motor_speed", "load_inertia",
                                       "brake_torque"}
    assert "# GUESS: '1/min' are revolutions\nunit = \"rpm\"" in proposal.text
    with pytest.raises(BadRecording, match="shift_command"):  # what is open is not guessed
        read_mapping(proposal.text.encode(), "channels.toml")


def test_the_shift_command_is_a_digital_channel_or_a_current_that_rises_once() -> None:
    one, conditions = run(), COMPACT.conditions
    time = one.columns["t"] / 1000 - 0.1
    current = np.interp(time, conditions.profile_time[0], conditions.profile_current[0])
    current += np.random.default_rng(1).normal(0, 0.005, len(time))
    started = (time >= 0).astype(float)

    def section(**columns: np.ndarray) -> str:
        content = csv(one.changed(**columns))
        for name, unit in (("i_valve", "mA"), ("i_ampere", "A")):
            content = content.replace(name.encode(), f"{name} [{unit}]".encode())
        return propose(open_source("a.csv", opened(content)), COMPACT).text.partition("[shift_command]\n")[2]

    assert 'channel = "shift_request"\nabove = 0.5\n' in section(i_ampere=current, shift_request=started)
    # The profiles begin at 0.15 A and never fall below 0.27 A again.
    assert 'channel = "i_ampere"\nabove = 0.21\n' in section(i_ampere=current, shift_request=current)
    assert 'channel = "i_valve"\nabove = 210\n' in section(i_valve=1000 * current)
    twice = section(i_ampere=np.concatenate([current, current])[::2])
    assert twice.startswith("# OPEN: 'i_ampere' rises 2 times through 0.21 A")


def test_a_guess_goes_on_without_a_channel_that_cannot_be_read() -> None:
    content = csv(run()).replace(b"M_out\n", b"M_out;shift_request\n").split(b"\n")
    rows = [row + b";0" if number > 2 else row for number, row in enumerate(content)]
    rows[900] = rows[900].removesuffix(b"0") + b"ON"
    proposal = propose(open_source("a.csv", opened(b"\n".join(rows))), COMPACT)
    assert proposal.guesses[-1].channel is None


def test_nothing_is_guessed_where_no_name_fits() -> None:
    proposal = propose(open_source("a.csv", opened(b"a [V];b [V]\n1;2\n2;3\n")), COMPACT)
    assert all(guess.channel is None for guess in proposal.guesses)
