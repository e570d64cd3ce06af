"""Whether the lag of the torque while the plates close is that of its sensor, which load and input would show as well.

While the plates close, the lag of the friction behind the pressure and that of the torque sensor are the same. The
shafts follow the true torque: what drives load and input is read late if the sensor is, and not if the friction is.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from slipstick.engine.linear_model import estimate
from slipstick.naming.block import Pair
from slipstick.naming.curved import CurvedFit
from slipstick.naming.fit import BlockFit
from slipstick.naming.linear_model import joined, part_of

OF_FRICTION: Pair = ("contact pressure", "lag")
OF_SENSOR: Pair = ("output torque sensor", "lag")


def gained_elsewhere(clutch: CurvedFit, others: Mapping[str, BlockFit]) -> np.ndarray:
    """What the likelihood (n,) of all blocks gains in nats if the lag of a `clutch` is that of the torque sensor.

    It has the same coefficients in the linear models of all blocks then. It is 0 without blocks that the torque drives.
    """
    driven = [fit for fit in others.values() if OF_SENSOR in fit.block.pairs() and OF_SENSOR not in fit.laws]
    driven = [fit for fit in driven if fit.block.name != "contact"]  # its samples are some of those of the clutch
    if not driven:
        return np.zeros(len(clutch.points))
    clutch_part = part_of(clutch.block, clutch.columns(clutch.laws), clutch.noise)
    clutch_part = replace(clutch_part, places={OF_SENSOR if law == OF_FRICTION else law: places
                                               for law, places in clutch_part.places.items()})
    parts = [*(part_of(fit.block, fit.columns((*fit.laws, OF_SENSOR)), fit.noise) for fit in driven), clutch_part]
    laws = list(dict.fromkeys(law for part in parts for law in part.places))
    variance = np.concatenate([fit.fitted.variance for fit in (*driven, clutch)])
    together = estimate(joined(parts, laws).gram, variance, fixed=True)
    return np.asarray(together.likelihood - sum(fit.fitted.likelihood for fit in (*driven, clutch)))
