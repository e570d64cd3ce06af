"""Layout of the working memory of the compiled integrator: one column (lane) per engagement.

One flat buffer consists of rows of `LANES` numbers. Row names are offsets known at compile time, so that a loop over
the lanes of a few rows compiles to vector instructions. With separate arrays, LLVM could not exclude overlap and would
emit scalar code.
"""

from itertools import count

from slipstick.bench.converter import MOST_TERMS
from slipstick.clutch import effects
from slipstick.clutch.effects.effect import QUANTITIES
from slipstick.clutch.laws import MOST_LAWS, MOST_POINTS

LANES = 48
"""Engagements per loop: pairs of AVX-512 vectors, too many for LLVM to unroll, few enough for the L1 cache."""

_rows = count()


def _row(length: int = 1) -> int:
    first = next(_rows)
    for _ in range(length - 1):
        next(_rows)
    return first * LANES


STATE_SIZE = 5
"""Length of the state vector of the model: pressure, pressure_rate, piston_state, input_speed, output_speed."""

MEMORIES = tuple(effect.name for effect in effects.CATALOGUE if effect.memory)
"""Effects with a memory, in the order in which their memories follow the five model states in the state vector."""

LAW_MEMORIES = ("heat", "time in contact")
"""Dependences of measured laws that are integrated; they follow the memories of the effects in the state vector."""

EFFECT_STATE_SIZE = STATE_SIZE + len(MEMORIES)
FULL_STATE_SIZE = EFFECT_STATE_SIZE + len(LAW_MEMORIES)

# Indices into the flags of active effects: one flag per effect (active), per quantity (has an active effect or a law),
# one for any law, one for laws that depend on heat or time in contact, one for changes of eq. 1, and one for any memory
# in use.
QUANTITY_FLAG = {quantity: len(effects.CATALOGUE) + i for i, quantity in enumerate(QUANTITIES)}
LAW_FLAG = len(effects.CATALOGUE) + len(QUANTITIES)
LAW_MEMORY_FLAG = LAW_FLAG + 1
HYDRAULICS_FLAG = LAW_MEMORY_FLAG + 1
MEMORY_FLAG = HYDRAULICS_FLAG + 1

HYDRAULICS = ("valve current", "line pressure", "chamber pressure", "piston rate")
"""Quantities in eq. 1."""

# State vectors at the start of the step, at the current stage, and at the end of the step.
START, STAGE, END = _row(FULL_STATE_SIZE), _row(FULL_STATE_SIZE), _row(FULL_STATE_SIZE)
# Rates of the state vector: at the current stage, at the first stage, and the sum of the two middle stages.
RATE, FIRST, MIDDLE = _row(FULL_STATE_SIZE), _row(FULL_STATE_SIZE), _row(FULL_STATE_SIZE)
# Pressure, its rate and piston state in the middle of the step.
MIDPOINT = _row(3)
# What effects and laws add to their rates at the first stage, and the sum of its changes at the middle stages and its
# change at the present one.
FORCE, FORCE_MIDDLE, FORCE_LAST = _row(3), _row(3), _row(3)

PRESSURE, PRESSURE_RATE, PISTON_STATE, INPUT_SPEED, OUTPUT_SPEED = (STAGE + i * LANES for i in range(STATE_SIZE))
HEAT, CONTACT_TIME = (STAGE + (EFFECT_STATE_SIZE + i) * LANES for i in range(len(LAW_MEMORIES)))
HEAT_RATE, CONTACT_TIME_RATE = (RATE + (EFFECT_STATE_SIZE + i) * LANES for i in range(len(LAW_MEMORIES)))

TIME, STAGE_TIME, STEP, END_TIME, EVENT = (_row() for _ in range(5))

# Discrete state, constant during a step: slip or stick state, load moving or at rest, sign of the slip.
SLIPPING, MOVING, DIRECTION = _row(), _row(), _row()

# Event functions, positive where the load breaks away from rest and where sticking plates release.
BREAKAWAY, RELEASE = _row(), _row()
BREAKAWAY_FIRST, RELEASE_FIRST = _row(), _row()

# Active segment of the current profile: start, current, slope, end, and history (`conditions.reversals`).
SEGMENT_TIME, SEGMENT_CURRENT, SEGMENT_SLOPE, SEGMENT_END = _row(), _row(), _row(), _row()
SEGMENT_DIRECTION, SEGMENT_REVERSAL, SEGMENT_SWING = _row(), _row(), _row()
SEGMENT_TORQUE, SEGMENT_TORQUE_SLOPE = _row(), _row()

# Quantities that effects can change, and quantities derived from them.
QUANTITY_ROW = {name: _row() for name in QUANTITIES}
(CURRENT, LINE_PRESSURE, CHAMBER, PISTON_GAIN, PISTON_RATE, CLEARANCE, CONTACT, FRICTION, FILM, CONVERTER,
 BRAKING, LOAD, STICK) = QUANTITY_ROW.values()
CLEARANCE_CHANGE, RAMP, RIGID, CLUTCH_TORQUE = (_row() for _ in range(4))

PRESSURE_CHANGE = _row()
"""Change of the line pressure by effects, bar."""
MEMORY_INPUT = _row(len(MEMORIES))
"""Input value of the formula of each effect with a memory."""

# Parameters of the engagement, in the form used by the equations.
PRESSURE_STIFFNESS, PRESSURE_DAMPING, CURRENT_BIAS, PRESSURE_GAIN, SLOPE_GAIN = (_row() for _ in range(5))
VALVE_GAIN, VALVE_DELAY, INVERSE_STIFFNESS = (_row() for _ in range(3))
PISTON_PRESSURE, PISTON_PRESSURE_RATE, PISTON_RETURN, PRESSURE_BIAS = (_row() for _ in range(4))
TEMPERATURE_GAIN, CONTACT_POSITION, CONTACT_FACTOR = _row(), _row(), _row()
VALVE_TIME, EFFECT_TIME = _row(), _row()
"""Shortest time constants in s: of the delay of the current and the return of the piston, and of the effects."""
STIFFNESS = _row()
"""Rate in 1/s of the fastest decay of the speeds, as the last step showed it."""
PISTON_FROM_PRESSURE, PISTON_FROM_RATE = _row(), _row()
"""Parts of the deviations of pressure (m/bar) and pressure rate (m s/bar) in the piston state (`flow`)."""
RAMP_WIDTH, INVERSE_RAMP_WIDTH, FILM_COEFFICIENT, FRICTION_COEFFICIENT = (_row() for _ in range(4))
GEAR, INVERSE_GEAR, INPUT_COULOMB, INPUT_VISCOUS, OUTPUT_VISCOUS = (_row() for _ in range(5))
INPUT_INERTIA, INVERSE_INPUT_INERTIA, INVERSE_LOAD_INERTIA, INVERSE_TOTAL_INERTIA = (_row() for _ in range(4))
BRAKE, MOTOR_SPEED, INVERSE_MOTOR_SPEED, INPUT_TORQUE, RUN = (_row() for _ in range(5))

COEFFICIENTS = _row(len(effects.neutral()) + 4)
"""Effect coefficients, padded so that four can be read starting at any of them."""

RATIO, TORQUE_RATIO, CAPACITY = (_row() for _ in range(3))
"""Speed ratio of the torque converter, and its two curves at that ratio."""

LAW_INPUT, LAW_VALUE = _row(), _row()
"""What a measured law depends on, and the value of the law there."""
LAW_FACTOR, LAW_OFFSET = _row(MOST_LAWS), _row(MOST_LAWS)
"""Each law changes its quantity to factor times quantity + offset."""

CURVES = next(_rows) * LANES
"""The converter curves of the call, as `Converter.terms` gives them."""

LAWS = CURVES + MOST_TERMS
"""The measured laws of the call, as `law_terms.terms` gives them: their number, and `LAW_SIZE` numbers for each."""

LAW_GROUP = 4
"""Segments of a law that are evaluated together, so that the rows are read and written less often."""
LAW_HEAD = 5
"""Numbers of a law before its segments: quantity, dependence, relative, value before the first point, groups."""
LAW_SIZE = LAW_HEAD + 3 * (MOST_POINTS - 1 + -(MOST_POINTS - 1) % LAW_GROUP)

BUFFER_SIZE = LAWS + 1 + MOST_LAWS * LAW_SIZE
