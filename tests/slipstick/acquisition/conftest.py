"""Files of one engagement as benches write them, in all formats: a made-up clutch whose lock-up is known."""

import io
import zipfile
from dataclasses import dataclass

import numpy as np
import pytest

from slipstick.bench import Bench, parameters
from tests.benches import COMPACT

GEAR = COMPACT.physics.nominal[parameters.NAMES.index("gear_ratio")]
LOCK = 0.6123
MAP = """
[signals]
pressure = { channel = "p_oil", unit = "kPa" }
input_speed = { channel = "n_in", unit = "rpm" }
output_speed = { channel = "n_out", unit = "rpm" }
output_torque = { channel = "M_out", unit = "N m", sign = -1 }
[time]
channel = "t"
unit = "ms"
[shift_command]
time = "100 ms"
[conditions]
current_profile = { value = 0 }
motor_speed = { value = "1500 rpm" }
load_inertia = { value = "0.4 kg m^2" }
brake_torque = { value = "5 N m" }
"""


@dataclass(frozen=True, eq=False)
class Run:
    """Channels of one engagement in the units of its file, `t` in ms, with the shift command at 100 ms."""

    columns: dict[str, np.ndarray]

    def without(self, name: str) -> "Run":
        return Run({key: values for key, values in self.columns.items() if key != name})

    def changed(self, **columns: np.ndarray) -> "Run":
        return Run({**self.columns, **columns})


def run(step: float = 1e-3, end: float = 1.2, lock: float = LOCK, seed: int = 1) -> Run:
    time = np.arange(round((end + 0.1) / step)) * step - 0.1
    noise = np.random.default_rng(seed)
    output = 60 * np.clip(time / lock, 0, None)
    slip = np.where(time < lock, 90 * (1 - np.clip(time, 0, None) / lock), 0)
    torque = np.where(time < lock, 100 * np.clip(time, 0, None), 20)
    pressure = 6 * (1 - np.exp(-np.clip(time, 0, None) / 0.2))
    return Run({"t": 1e3 * (time + 0.1), "p_oil": 100 * (pressure + noise.normal(0, 0.02, len(time))),
                "n_in": (slip + GEAR * output + noise.normal(0, 0.2, len(time))) * 30 / np.pi,
                "n_out": (output + noise.normal(0, 0.1, len(time))) * 30 / np.pi,
                "M_out": -(torque + noise.normal(0, 0.5, len(time)))})


def csv(one: Run, separator: str = ";", decimal: str = ",", units: str = "") -> bytes:
    rows = zip(*one.columns.values(), strict=True)
    lines = ["Bench 3", "", separator.join(one.columns), *([units] if units else [])]
    lines += [separator.join("" if np.isnan(value) else f"{value:.9g}" for value in row).replace(".", decimal)
              for row in rows]
    return "\n".join(lines).encode()


def archive(files: dict[str, bytes]) -> bytes:
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as target:
        for name, content in files.items():
            target.writestr(name, content)
    return memory.getvalue()


def opened(content: bytes) -> io.BytesIO:
    return io.BytesIO(content)


@pytest.fixture
def bench() -> Bench:
    return COMPACT
