"""Shaft compliance: plates that stick are joined to the load by a shaft that twists."""

import numpy as np

from slipstick.clutch.effects.effect import Coefficient, Effect, Memory, Signals
from slipstick.clutch.fastmath import compiled

_SOFTEST = 2e-5  # rad/(N m): below, rigid and compliant shaft are mixed, so that steps need not shrink to nothing
_FOLLOW = 4e-3  # s: how soon the twist is that of the torque while the plates slip
_STIFFNESS = 6.0  # 1/(kg m^2): about 1/J_i + g_r^2/J_o, which sets how fast the shafts swing against each other


@compiled
def _formula(torque: float, signals: Signals, c: tuple[float, ...]) -> float:
    compliance, damping = c[0], c[1]
    spring = (signals.memory + damping * signals.plate_slip) / max(_SOFTEST, compliance)
    return torque + min(1.0, compliance / _SOFTEST) * (spring - torque)


@compiled
def _twist(torque: float, signals: Signals, c: tuple[float, ...]) -> float:
    free = (max(_SOFTEST, c[0]) * signals.clutch_torque - signals.memory) / _FOLLOW
    rate = signals.plate_slip if signals.stuck > 0.0 else free
    return rate if c[0] > 0.0 else 0.0


def _time_constant(compliance: np.ndarray, damping: np.ndarray) -> np.ndarray:
    soft = np.maximum(_SOFTEST, compliance) / _STIFFNESS
    fastest = np.minimum(np.minimum(np.sqrt(soft), soft / damping), 2 * _FOLLOW)
    return np.where(compliance > 0, fastest, np.inf)


EFFECT = Effect(
    name="shaft_compliance",
    title="Shaft compliance",
    quantity="stick torque",
    law="(twist + damping twist') / compliance, twist' = plate slip; in slip the twist is compliance times torque",
    coefficients=(
        Coefficient("compliance", "rad/(N m)", 0.0, 0.0, 0.01, "twist by one N m, both at the input side", 1e-3),
        Coefficient("damping", "s", 5e-3, 1e-3, 2e-2, "retardation time of the shaft", 5e-3, True),
    ),
    source="Kiencke and Nielsen, Automotive Control Systems, chapter on drivelines with a flexible shaft",
    signature="after lock-up torque and speeds swing; before it nothing changes",
    formula=_formula,
    memory=Memory(_twist),
    time_constant=_time_constant,
)
