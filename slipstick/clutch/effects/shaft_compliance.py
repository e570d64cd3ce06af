"""Shaft compliance: sticking plates drive the load through a torsionally elastic shaft."""

import numpy as np

from slipstick.clutch.effects.effect import Coefficient, Effect, Memory, Signals
from slipstick.clutch.fastmath import compiled

_MIN_COMPLIANCE = 2e-5  # rad/(N m): below it the shaft is blended with a rigid one to keep steps long
_SLIP_TIME_CONSTANT = 4e-3  # s: time constant with which the twist follows the torque in the slip state
_INVERSE_INERTIA = 6.0  # 1/(kg m^2): about 1/J_i + g_r^2/J_o, which sets the natural frequency of the shafts


@compiled
def _formula(torque: float, signals: Signals, c: tuple[float, ...]) -> float:
    compliance, damping = c[0], c[1]
    spring = (signals.memory + damping * signals.plate_slip) / max(_MIN_COMPLIANCE, compliance)
    return torque + min(1.0, compliance / _MIN_COMPLIANCE) * (spring - torque)


@compiled
def _twist(torque: float, signals: Signals, c: tuple[float, ...]) -> float:
    following = (max(_MIN_COMPLIANCE, c[0]) * signals.clutch_torque - signals.memory) / _SLIP_TIME_CONSTANT
    rate = signals.plate_slip if signals.stuck > 0.0 else following
    return rate if c[0] > 0.0 else 0.0


def _time_constant(compliance: np.ndarray, damping: np.ndarray) -> np.ndarray:
    effective = np.maximum(_MIN_COMPLIANCE, compliance) / _INVERSE_INERTIA
    fastest = np.minimum(np.minimum(np.sqrt(effective), effective / damping), 2 * _SLIP_TIME_CONSTANT)
    return np.where(compliance > 0, fastest, np.inf)


EFFECT = Effect(
    name="shaft_compliance",
    title="Shaft compliance",
    quantity="stick torque",
    depends_on="twist",
    law="(twist + damping twist') / compliance, twist' = plate slip; twist = compliance * torque in the slip state",
    coefficients=(
        Coefficient("compliance", "rad/(N m)", 0.0, 0.0, 4.5, "twist per torque, referred to the input side", 0.45,
                    scale={"torque": -1}),
        Coefficient("damping", "s", 5e-3, 0.02, 0.4, "retardation time of the shaft", 0.1, True, {"time": 1}),
    ),
    source="Kiencke and Nielsen, Automotive Control Systems, chapter on drivelines with a flexible shaft",
    signature="torque and speeds oscillate after lock-up; nothing changes before it",
    formula=_formula,
    memory=Memory(_twist),
    time_constant=_time_constant,
)
