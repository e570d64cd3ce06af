"""Findings about sensors and sample time, beside what the simulated engagements do."""

import numpy as np

from slipstick.bench import Sensor
from slipstick.plausibility.behaviour import Behaviour
from slipstick.plausibility.finding import Finding
from slipstick.plausibility.physics import SteadyStates
from slipstick.recordings.signals import SIGNAL_UNITS


def sensing_findings(steady: SteadyStates, behaviour: Behaviour, known: np.ndarray) -> list[Finding]:
    """Samples too rare for the model's time constants, and sensors that cannot see their signal.

    The size of a signal is taken from the conditions that lock and that nothing else explains (`known`, (n,)).
    """
    findings, usual = _sampling(steady, bool(known.all())), behaviour.locked & ~known
    if not usual.any():
        return findings
    lowest, highest = behaviour.lowest[usual], behaviour.highest[usual]
    spans = dict(zip(SIGNAL_UNITS, highest.max(axis=0) - lowest.min(axis=0), strict=True))
    times = behaviour.shifting_time[usual]
    for name, unit in SIGNAL_UNITS.items():
        findings += _sensor(name, steady.bench.sensors[name], float(spans[name]), unit)
    if len(times) > 1:
        findings += _sensor("shifting_time", steady.bench.sensors["shifting_time"], float(np.ptp(times)), "s")
    return findings


def _sensor(name: str, sensor: Sensor, span: float, unit: str) -> list[Finding]:
    return [Finding(f"sensors.{name}", f"the {kind} of {name}, {value:.4g} {unit}, is not less than the whole range of "
                    f"the simulated values, {span:.4g} {unit}", "the recordings say nothing about this quantity",
                    "Check the unit: noise is a standard deviation, resolution the smallest difference")
            for kind, value in (("noise", sensor.noise), ("resolution", sensor.resolution))
            if value is not None and value >= span]


def _sampling(steady: SteadyStates, piston_known: bool) -> list[Finding]:
    """Eq. 1 has two time constants: tau of the valve, and c2/d2 of the piston."""
    step = steady.bench.sample_time
    constants = {"current_delay": steady["current_delay"]}
    if not piston_known:
        constants["piston_inertia/piston_return"] = steady["piston_inertia"] / steady["piston_return"]
    short = {name: value for name, value in constants.items() if value < step}
    if not short:
        return []
    named = " and ".join(f"{name}, {1e3 * value:.4g} ms," for name, value in short.items())
    return [Finding("sensors.sample_time", f"{named} {'is' if len(short) == 1 else 'are'} shorter than the sample "
                    f"time, {1e3 * step:.4g} ms", "the recordings cannot determine what passes between two samples",
                    "Check the units of sample_time and of these parameters")]
