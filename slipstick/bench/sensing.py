"""What is known about the measurements and the parameters of a bench before any recording: sensors and priors."""

from dataclasses import dataclass


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
