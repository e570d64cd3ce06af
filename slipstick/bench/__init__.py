"""Test benches as values: parameters, torque converter, sensors, current profiles and conditions, read from a file."""

from pathlib import Path

from slipstick.bench.bench import Bench, Prior, Sensor
from slipstick.bench.conditions import Conditions
from slipstick.bench.converter import Converter
from slipstick.bench.physics import Physics
from slipstick.bench.scales import Scales

TEMPLATE = Path(__file__).with_name("template.toml")
"""A commented bench file to start from."""

__all__ = ["TEMPLATE", "Bench", "Conditions", "Converter", "Physics", "Prior", "Scales", "Sensor",
           "parameters"]
