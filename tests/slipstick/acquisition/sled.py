"""Recordings of a made-up sled that is driven to and fro, with standstills between its moves."""

import io
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from slipstick.acquisition import import_runs, open_source, read_machine_mapping
from slipstick.acquisition.channel import Source
from slipstick.acquisition.result import ImportedRuns
from slipstick.machine import Block, Command, Condition, Machine, Parameter, Quantity, Sensor, SignalRange

REST, MOVE, STEP = 0.4, 1.0, 1e-3  # s

_drive = Block("drive", gives=("speed", "position"), reads=("drive voltage", "load"), states=("speed", "position"),
               parameters=(Parameter("gain", "m/(V s^2)", value=1.0),), quantities=(Quantity("friction", "m/s^2"),))


@_drive.rate
def _(x, u, q, p):  # type: ignore[no-untyped-def]
    return p.gain * u.drive_voltage - p.load - q.friction, x.speed


@_drive.output
def _(x, u, q, p):  # type: ignore[no-untyped-def]
    return x.speed, x.position


SLED = Machine("sled", (_drive,), (Sensor("speed", "m/s"), Sensor("position", "m")),
               commands=(Command("drive voltage", "V"),), conditions=(Condition("load", "N"),))
DRIVEN = replace(SLED, commands=(Command("drive voltage", "V", (((0.0, 3.5), (1.0, 3.5)),)),),
                 conditions=(Condition("load", "N", levels=(3.0,)),), duration=1.0, step=0.01)
"""The sled with experiments of its own, whose speed reaches 0.5 m/s."""
MAP = """
[signals]
speed = { channel = "v", unit = "mm/s" }
position = { channel = "x", unit = "mm" }
[commands]
"drive voltage" = { channel = "u", unit = "V" }
[conditions]
load = { value = "3 N" }
[time]
channel = "t"
unit = "ms"
"""
STANDSTILLS = '[runs]\ncut = "standstills"\nchannel = "v"\nbelow = 20\nfor = "0.3 s"\n'


def recording(moves: int = 5, seed: int = 1, step: float = STEP) -> dict[str, np.ndarray]:
    """Channels in ms, mm/s, mm and V: a rest, and after each move another one; every second move goes back."""
    time = np.arange(round((REST + moves * (REST + MOVE)) / step)) * step
    place, within = np.divmod(time, REST + MOVE)
    moving = np.clip(within - REST, 0, None) / MOVE
    sign = np.where(place % 2 == 0, 1.0, -1.0)
    noise = np.random.default_rng(seed)
    travel = (1 - np.cos(np.pi * moving)) / 2
    return {"t": 1e3 * time, "v": 500 * sign * np.sin(np.pi * moving) + noise.normal(0, 0.5, len(time)),
            "x": np.where(sign > 0, travel, 1 - travel) * 1000 / np.pi + noise.normal(0, 0.02, len(time)),
            "u": np.where((moving > 0) & (moving < 0.5), 5 * sign, 0.0)}


def as_csv(columns: dict[str, np.ndarray]) -> bytes:
    rows = (",".join("" if np.isnan(value) else f"{value:.9g}" for value in row)
            for row in zip(*columns.values(), strict=True))
    return "\n".join([",".join(columns), *rows]).encode()


def source(columns: dict[str, np.ndarray], name: str = "sled.csv") -> Source:
    return open_source(name, io.BytesIO(as_csv(columns)))


def imported(*files: dict[str, np.ndarray] | Source, text: str = MAP + STANDSTILLS, plan: bytes | None = None,
             machine: Machine = SLED, ranges: Sequence[SignalRange] = ()) -> ImportedRuns:
    sources = [source(file, f"sled{number}.csv") if isinstance(file, dict) else file
               for number, file in enumerate(files)]
    return import_runs(sources, read_machine_mapping(text.encode(), "channels.toml", machine), machine, plan,
                       ranges)
