"""Lags, offsets and gain errors of sensors of the list `alpine`; part of `NINETEENTH` (nineteenth.py)."""

import numpy as np

from .nineteenth_shapes import avalanches, fano, folded, plucked, shadow, switchbacks
from .unseen_sensors import gain, lag, offset

NINETEENTH_SENSORS = (
    # A bore before the sensor is so narrow that its flow is turbulent: it goes with the root of what is missing
    lag("pressure_bore_is_turbulent", "pressure", "chokes", 0.01),
    # Old grease holds back the wheel of the output's sensor until it is wiped off by turning
    lag("output_speed_wheel_wipes_off_its_grease", "output_speed", "wipes", 0.012),
    # The light of the sensor passes an edge, which warms and moves out of its way
    offset("pressure_sensor_light_passes_an_edge", "pressure", "sequence", 0.3,
           lambda r: 0.1 + 1.0 * shadow(r, 0.24, 0.16)),
    # A chopper strikes the supply now and then, which rings
    offset("input_speed_supply_is_struck_and_rings", "input_speed", "time", 2.5,
           lambda t: 0.3 + 1.1 * plucked(t - 0.03, 0.46, 2, 0.22)),
    # The zero is corrected by hand, ever too much and to the other side
    offset("torque_zero_is_corrected_ever_too_much", "output_torque", "sequence", 18.0,
           lambda r: 0.2 + 1.0 * switchbacks(r, 0.04, 0.96, 1.5, 5)),
    # The membrane is read by light, whose fringes are counted to and fro
    gain("pressure_membrane_is_read_by_fringes", "pressure", 0.06, lambda x: 0.5 * folded(x, 1.5, 0.42)),
    # A part of the pulses comes by way of the housing, which resonates with the wheel
    gain("output_speed_pulses_come_by_two_ways", "output_speed", 0.07,
         lambda x: 0.6 * (fano(x, 0.3, 0.09, 1.1) - fano(0.0, 0.3, 0.09, 1.1))),
    # The gauge sleeve is wound up, and slips back by uneven amounts
    gain("torque_sleeve_slips_back_unevenly", "output_torque", 0.06,
         lambda x: -0.5 * np.sign(x) * avalanches(np.minimum(np.abs(x), 1), 4, 0.03, (0.21, 0.75), (0.37, 0.45),
                                                  (0.58, 1.0), (0.82, 0.9))),
)
