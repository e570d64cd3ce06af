"""The working memory of the compiled integrator: rows of lanes, one engagement a lane.

One flat buffer, cut into rows of `LANES` numbers. Row names are offsets known to the compiler, so that a loop over
the lanes of a few rows becomes vector instructions: separate arrays might overlap for all LLVM knows, and stay scalar.
"""

from itertools import count

from slipstick.clutch import effects
from slipstick.clutch.effects.effect import QUANTITIES

LANES = 48
"""Engagements advanced in one loop: pairs of AVX-512 vectors, more than LLVM unrolls, few enough for the L1 cache."""

_rows = count()


def _row(length: int = 1) -> int:
    first = next(_rows)
    for _ in range(length - 1):
        next(_rows)
    return first * LANES


STATES = 5
"""pressure, pressure_rate, piston_state, input_speed, output_speed: x1, x2, x3, Omega, omega."""

MEMORIES = tuple(effect.name for effect in effects.CATALOGUE if effect.memory)
"""The effects with a state of their own. These states come after the five, if one of them is active."""

ALL_STATES = STATES + len(MEMORIES)

# Places in the flags of a call: of each effect whether it is active, of each quantity whether an effect on it is, and
# whether one with a memory is.
ACTING = {quantity: len(effects.CATALOGUE) + place for place, quantity in enumerate(QUANTITIES)}
REMEMBERING = len(effects.CATALOGUE) + len(QUANTITIES)

# The states at the start of the step, at the stage being evaluated, and at the end of the step.
START, STATE, END = _row(ALL_STATES), _row(ALL_STATES), _row(ALL_STATES)
# Time derivatives: at the stage, and those kept of the stages of Runge-Kutta (the first, the middle two summed).
RATE, FIRST, MIDDLE = _row(ALL_STATES), _row(ALL_STATES), _row(ALL_STATES)

PRESSURE, PRESSURE_RATE, PISTON_STATE, INPUT_SPEED, OUTPUT_SPEED = (STATE + i * LANES for i in range(STATES))

TIME, STAGE_TIME, STEP, END_TIME, EVENT = (_row() for _ in range(5))

# Mode, frozen during a step: is the clutch slipping (else stuck), does the load move, which way does it slip.
SLIPPING, MOVING, DIRECTION = _row(), _row(), _row()

# Each row is above zero where its mode must end: the load breaks away, the stuck plates let go.
BREAKAWAY, RELEASE = _row(), _row()
BREAKAWAY_FIRST, RELEASE_FIRST = _row(), _row()

# The current's straight line in force, when it ends, and how the current came to it (`conditions.turns`).
LINE_TIME, LINE_CURRENT, LINE_SLOPE, LINE_END = _row(), _row(), _row(), _row()
LINE_DIRECTION, LINE_TURN, LINE_SWING = _row(), _row(), _row()

# What the effects change, and what is made of it.
QUANTITY = {name: _row() for name in QUANTITIES}
(CURRENT, LINE_PRESSURE, CHAMBER, PISTON_GAIN, PISTON_RATE, CLEARANCE, CONTACT, FRICTION, FILM, CONVERTER, LOAD,
 STICK) = QUANTITY.values()
CLEARANCE_CHANGE, RAMP, RIGID, CLUTCH_TORQUE = (_row() for _ in range(4))

PRESSURE_CHANGE = _row()
"""What effects add to the line pressure, bar."""
VALUE = _row(len(MEMORIES))
"""The quantity of each effect with a memory as its formula is given it."""

# Parameters of the lane's engagement, in the form the equations use them.
PRESSURE_STIFFNESS, PRESSURE_DAMPING, CURRENT_BIAS, PRESSURE_GAIN, SLOPE_GAIN = (_row() for _ in range(5))
PISTON_PRESSURE, PISTON_PRESSURE_RATE, PISTON_RETURN, PRESSURE_BIAS = (_row() for _ in range(4))
TEMPERATURE_GAIN, CONTACT_POSITION, CONTACT_FACTOR, RESPONSE_TIME = (_row() for _ in range(4))
INVERSE_RAMP_WIDTH, FILM_COEFFICIENT, FRICTION_COEFFICIENT = _row(), _row(), _row()
GEAR, INVERSE_GEAR, INPUT_COULOMB, INPUT_VISCOUS, OUTPUT_VISCOUS = (_row() for _ in range(5))
INPUT_INERTIA, INVERSE_INPUT_INERTIA, INVERSE_LOAD_INERTIA, INVERSE_TOTAL_INERTIA = (_row() for _ in range(4))
BRAKE, MOTOR_SPEED, INVERSE_MOTOR_SPEED, RUN = _row(), _row(), _row(), _row()

COEFFICIENTS = _row(len(effects.neutral()) + 4)
"""Effect coefficients, and room to read four from the last one on."""

RATIO, TORQUE_RATIO, CAPACITY = (_row() for _ in range(3))
"""Speed ratio of the converter, and its two curves there."""

SEGMENTS = next(_rows) * LANES
"""The converter curves: their number of segments, both values at the first point, then four numbers a segment."""
MOST_POINTS = 64
SIZE = SEGMENTS + 3 + 4 * MOST_POINTS
