"""A test bench as a value: its physics, what is known about sensors and parameters, and its experiments."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from slipstick.bench import parameters
from slipstick.bench.conditions import Conditions
from slipstick.bench.physics import Physics
from slipstick.bench.scales import Scales
from slipstick.errors import InvalidValue
from slipstick.storage.shipped import file_of


@dataclass(frozen=True)
class Sensor:
    """A sensor by the standard deviation of its `noise`, its `resolution` and its `lag` in s.

    Noise and resolution are in the unit of the signal; None: unknown.
    """

    noise: float | None = None
    resolution: float | None = None
    lag: float | None = None


@dataclass(frozen=True)
class Prior:
    """What is known about one parameter, as multiples of its nominal value.

    An `uncertain` parameter is calibrated between `lower` and `upper`. `scatter` is the known standard deviation from
    run to run; None: unknown, to be estimated.
    """

    uncertain: bool = False
    lower: float = 0.5
    upper: float = 1.5
    scatter: float | None = None


@dataclass(frozen=True, eq=False)
class Bench:
    """A test bench.

    `name` identifies it in file names and answers, `title` and `source` describe it and where its numbers come from.
    `priors` has one entry a parameter, in the order of `PARAMETERS`; `sensors` one for each measured signal and one for
    `shifting_time`. `sample_time` is in s.
    """

    name: str
    title: str
    source: str
    physics: Physics
    priors: tuple[Prior, ...]
    sensors: Mapping[str, Sensor]
    sample_time: float
    conditions: Conditions

    @classmethod
    def open(cls, path: Path | str) -> "Bench":
        """Read the bench file at `path`, or a shipped bench by its name, such as "heavy".

        Raises `BadBench` with key and line, and `UnknownName` where there is no such file.
        """
        from slipstick.bench.reader import read_file

        return read_file(file_of(path, ".toml"))

    @property
    def uncertain(self) -> tuple[str, ...]:
        """Names of the parameters that a calibration estimates."""
        return tuple(name for name, prior in zip(parameters.NAMES, self.priors, strict=True) if prior.uncertain)

    @property
    def profiles(self) -> tuple[np.ndarray, ...]:
        """Times in s, currents in A and, where it is given, input torques in N m of the profiles: (p, k) each."""
        conditions = self.conditions
        given = () if conditions.profile_input_torque is None else (conditions.profile_input_torque,)
        return conditions.profile_time, conditions.profile_current, *given

    @cached_property
    def scales(self) -> Scales:
        """Magnitudes in which effects give bounds and typical values; raises `InvalidValue` without oil pressure."""
        return Scales.of(self.physics, self.conditions)

    def require(self, physics: Physics) -> None:
        """Raise `InvalidValue` where `physics`, that of a model, is not that of this bench."""
        if physics.digest != self.digest:
            raise InvalidValue(f"The model was made for another bench than '{self.name}': the digest of its physics is "
                               f"{physics.digest[:12]}, not {self.digest[:12]}",
                               "Give the bench file of the model, or a model of this bench")

    def prior(self, name: str) -> Prior:
        """The prior of a parameter; raises `UnknownName`."""
        return self.priors[parameters.index(name)]

    @property
    def digest(self) -> str:
        """SHA-256 of the physics: models and tables carry it."""
        return self.physics.digest

    @cached_property
    def sensing_digest(self) -> str:
        """SHA-256 of sensors, sample time and priors: calibrations, fits and studies carry it beside `digest`."""
        content = {"priors": {name: asdict(prior) for name, prior in zip(parameters.NAMES, self.priors, strict=True)},
                   "sensors": {name: asdict(sensor) for name, sensor in sorted(self.sensors.items())},
                   "sample_time": self.sample_time}
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
