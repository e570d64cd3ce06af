"""Measured laws in the compiled integrator: the numbers that describe them, and the kernels that apply them.

A law is its first value and a sum over its segments, change times clip((x - start)/width, 0, 1). Like the hinges of the
converter curves, and unlike a search in a table, that is turned into vector instructions; and where segments are steep,
no large terms cancel.
"""

from collections.abc import Sequence

import numpy as np

from slipstick.clutch.fastmath import inlined, kernel
from slipstick.clutch.lanes import (
    CONTACT,
    CONTACT_POSITION,
    CONTACT_TIME,
    CONTACT_TIME_RATE,
    FRICTION,
    GEAR,
    HEAT,
    HEAT_RATE,
    INPUT_SPEED,
    LANES,
    LAW_FACTOR,
    LAW_GROUP,
    LAW_HEAD,
    LAW_INPUT,
    LAW_OFFSET,
    LAW_SIZE,
    LAW_VALUE,
    LAWS,
    MOTOR_SPEED,
    OUTPUT_SPEED,
    PISTON_PRESSURE,
    PISTON_PRESSURE_RATE,
    PISTON_RETURN,
    PISTON_STATE,
    PRESSURE,
    PRESSURE_BIAS,
    PRESSURE_RATE,
    QUANTITY_ROW,
    RAMP,
    RUN,
    SEGMENT_CURRENT,
    SEGMENT_SLOPE,
    SEGMENT_TIME,
    SLIPPING,
    STAGE_TIME,
    TEMPERATURE_GAIN,
)
from slipstick.clutch.laws import MeasuredLaw

_ROWS = {"motor speed": MOTOR_SPEED, "input speed": INPUT_SPEED, "output speed": OUTPUT_SPEED, "pressure": PRESSURE,
         "time": STAGE_TIME, "heat": HEAT, "time in contact": CONTACT_TIME}
"""Rows of the dependences that have one."""
_SLIP, _CURRENT, _RUN, _POSITION, _RATE = range(-5, 0)
"""Codes of the others."""
_CODES = {"slip": _SLIP, "current": _CURRENT, "run order": _RUN, "piston position": _POSITION, "piston rate": _RATE}


def terms(laws: Sequence[MeasuredLaw]) -> np.ndarray:
    """The laws as numbers: how many, and of each row of the quantity, row or code of the dependence, whether relative,
    first value, groups of `LAW_GROUP` segments, and start, inverse width and change of each segment."""
    numbers = np.zeros(1 + len(laws) * LAW_SIZE)
    numbers[0] = len(laws)
    for law, block in zip(laws, numbers[1:].reshape(len(laws), LAW_SIZE), strict=True):
        segments = np.column_stack([law.at[:-1], 1 / np.diff(law.at), np.diff(law.change)])
        dependence = {**_ROWS, **_CODES}[law.depends_on]
        groups = -(-len(segments) // LAW_GROUP)
        block[:LAW_HEAD] = QUANTITY_ROW[law.quantity], dependence, law.relative, law.change[0], groups
        block[LAW_HEAD:LAW_HEAD + segments.size] = segments.ravel()
    return numbers


@kernel
def evaluate_laws(b):
    """Fill the rows LAW_FACTOR and LAW_OFFSET of each law, with which it changes its quantity."""
    for law in range(int(b[LAWS])):
        _evaluate(b, law)


@kernel
def evaluate_rate_laws(b):
    """As `evaluate_laws`, for the laws over the piston rate only.

    What laws depend on is known before any quantity, except that the piston rate needs the x2 that `valve` computes.
    """
    for law in range(int(b[LAWS])):
        if b[LAWS + 1 + law * LAW_SIZE + 1] == _RATE:
            _evaluate(b, law)


@inlined
def _evaluate(b, law):
    k = LAWS + 1 + law * LAW_SIZE
    factor, offset = LAW_FACTOR + law * LANES, LAW_OFFSET + law * LANES
    _read_dependence(b, int(b[k + 1]))
    first, relative = b[k + 3], b[k + 2] > 0.0
    for i in range(LANES):
        b[LAW_VALUE + i] = first
    for group in range(int(b[k + 4])):
        s = k + LAW_HEAD + 3 * LAW_GROUP * group
        x0, w0, c0, x1, w1, c1 = b[s], b[s + 1], b[s + 2], b[s + 3], b[s + 4], b[s + 5]
        x2, w2, c2, x3, w3, c3 = b[s + 6], b[s + 7], b[s + 8], b[s + 9], b[s + 10], b[s + 11]
        for i in range(LANES):
            x = b[LAW_INPUT + i]
            p0, p1 = min(1.0, max(0.0, (x - x0) * w0)), min(1.0, max(0.0, (x - x1) * w1))
            p2, p3 = min(1.0, max(0.0, (x - x2) * w2)), min(1.0, max(0.0, (x - x3) * w3))
            b[LAW_VALUE + i] += c0 * p0 + c1 * p1 + c2 * p2 + c3 * p3
    for i in range(LANES):
        value = b[LAW_VALUE + i]
        b[factor + i] = 1.0 + value if relative else 1.0
        b[offset + i] = 0.0 if relative else value


@kernel
def apply_laws(b, row):
    """Apply the laws on the quantity of a `row` in their order. Unsigned, its numbers need no check for a sign."""
    for law in range(int(b[LAWS])):
        if b[LAWS + 1 + law * LAW_SIZE] == row:
            for i in range(LANES):
                k = row + np.uint64(i)
                b[k] = b[k] * b[LAW_FACTOR + law * LANES + i] + b[LAW_OFFSET + law * LANES + i]


@kernel
def law_memory_rates(b):
    """Compute the rates of heat in kW and of the time in contact."""
    for i in range(LANES):
        slip = b[INPUT_SPEED + i] - b[GEAR + i] * b[OUTPUT_SPEED + i]
        power = b[SLIPPING + i] * b[RAMP + i] * b[FRICTION + i] * b[CONTACT + i] * abs(slip)
        b[HEAT_RATE + i] = 1e-3 * power
        b[CONTACT_TIME_RATE + i] = b[RAMP + i]


@kernel
def _read_dependence(b, dependence):
    """Fill the row LAW_INPUT from the row or code of a dependence."""
    if dependence == _SLIP:
        for i in range(LANES):
            b[LAW_INPUT + i] = abs(b[INPUT_SPEED + i] - b[GEAR + i] * b[OUTPUT_SPEED + i])
    elif dependence == _CURRENT:
        for i in range(LANES):
            b[LAW_INPUT + i] = (b[SEGMENT_CURRENT + i]
                                + b[SEGMENT_SLOPE + i] * (b[STAGE_TIME + i] - b[SEGMENT_TIME + i]))
    elif dependence == _RUN:
        for i in range(LANES):
            b[LAW_INPUT + i] = 100.0 * b[RUN + i]
    elif dependence == _POSITION:
        for i in range(LANES):
            position = max(0.0, b[TEMPERATURE_GAIN + i] * b[PISTON_STATE + i])
            b[LAW_INPUT + i] = min(b[CONTACT_POSITION + i], position)
    elif dependence == _RATE:
        for i in range(LANES):
            b[LAW_INPUT + i] = (
                b[PISTON_PRESSURE + i] * (b[PRESSURE + i] - b[PRESSURE_BIAS + i])
                + b[PISTON_PRESSURE_RATE + i] * b[PRESSURE_RATE + i] - b[PISTON_RETURN + i] * b[PISTON_STATE + i])
    else:
        for i in range(LANES):
            b[LAW_INPUT + i] = b[np.uint64(dependence) + np.uint64(i)]
