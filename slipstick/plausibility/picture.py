"""The picture of one simulated engagement of a bench."""

import numpy as np

from slipstick.bench import Bench, parameters
from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.pictures import theme
from slipstick.pictures.engagement import panels
from slipstick.pictures.theme import Spec
from slipstick.plausibility.behaviour import SIGNALS, sample_times


def picture(bench: Bench, condition: int) -> Spec:
    """Current, pressure, piston position, speeds and torque over time, with contact and lock-up marked."""
    conditions = bench.conditions.take([condition])
    time, profile = sample_times(conditions), conditions.current_profile[0]
    response = ensemble.signals(Model(bench.physics), conditions, time)
    lines = {"current": np.interp(time, conditions.profile_time[profile], conditions.profile_current[profile]).tolist(),
             **{name: [float(value) if np.isfinite(value) else None for value in getattr(response, name)[0, 0]]
                for name in SIGNALS}}
    values = dict(zip(parameters.NAMES, bench.physics.nominal, strict=True))
    touching = response.piston_position[0, 0] > (1 - values["ramp_share"]) * values["contact_position"]
    touch = float(time[np.argmax(touching)]) if touching.any() else None
    lock = float(response.shifting_time[0, 0])
    locks = None if np.isnan(lock) else lock
    says = "never locks" if locks is None else f"locks at {theme.milliseconds(locks)}"
    return theme.picture(f"Condition {condition} of the bench “{bench.name}” {says}",
                         "Simulated at the nominal parameters. Shaded: phases. Dashed: shifting time.",
                         panels(time.tolist(), {"simulated": lines}, {"simulated": locks}, touch, values["gear_ratio"]))
