"""The states of an engagement, their absolute tolerances, and its modes.

States: pressure and its rate, piston position, input and output speed, and the states of effects: dissipated energy,
contact time, lagged friction and converter torque, shaft twist, output position, lagged current, and heat that is left
in the plates. The latter have no influence unless an effect uses them.
"""

import numpy as np

REST, SLIP, STICK = range(3)
(PRESSURE, RATE, PISTON, INPUT, OUTPUT, ENERGY, CONTACT, FRICTION, CONVERTER, TWIST, POSITION, MAGNET, HEAT) = range(13)
TOLERANCE = np.array([1e-6, 1e-4, 1e-10, 1e-6, 1e-6, 1e-3, 1e-7, 1e-4, 1e-4, 1e-9, 1e-5, 1e-7, 1e-3])[:, None]

Quantities = dict[str, np.ndarray]
