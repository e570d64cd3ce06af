"""Two tanks: a pump fills the first, which drains, and spills over a weir, into the second, which drains away.

The equations are, with levels h1 and h2 in m and the voltage V of the pump,

    area 1 h1' = pump gain (V + dV) - flow - spill - leak 1       flow = outlet 1 sqrt(h1)
    area 2 h2' = flow + spill - outlet 2 sqrt(h2) - leak 2        spill = WEIR max(h1 - BRIM, 0)^1.5

where dV and the leaks, in m^3/s, are zero, and each of the other flows is multiplied by 1, without an effect.
"""

import numpy as np

from .runs import PAST, Abscissas, Inputs, Runs

PARAMETERS = {"pump gain": 0.92e-3, "outlet 1": 8e-3, "outlet 2": 9e-3, "area 1": 0.05, "area 2": 0.06}
"""Typical parameters in m^3/(s V), m^2.5/s and m^2."""
SIGNALS = {"level 1": "m", "level 2": "m"}
WEIR = 0.02  # m^1.5/s
BRIM = 0.6  # m
RATIOS = ("pump flow", "outflow 1", "outflow 2", "overflow")
"""Quantities that change by a share of themselves; "voltage" in V, "leak 1" and "leak 2" change by a difference."""
FINE, COARSE = 16, 2
"""Steps of the integrator in a sampling period for recordings, and for the strength of effects."""


def integrate(runs: Runs, inputs: Inputs) -> dict[str, np.ndarray]:
    """Return the levels and the other abscissas (n, K + 1) on the grid of the inputs, by the Runge-Kutta method."""
    time, step = inputs.time, inputs.step
    levels = np.empty((len(time), 2, len(runs.order)))
    levels[0] = runs.conditions["start level 1"], runs.conditions["start level 2"]
    ends = np.stack([inputs.commanded, inputs.applied, inputs.past], axis=1)
    middles = 0.5 * (ends[1:] + ends[:-1])
    for index, begin in enumerate(time[:-1]):
        now, half = levels[index], begin + 0.5 * step
        first = rates(runs, inputs.fixed, begin, ends[index], now)
        second = rates(runs, inputs.fixed, half, middles[index], now + 0.5 * step * first)
        third = rates(runs, inputs.fixed, half, middles[index], now + 0.5 * step * second)
        fourth = rates(runs, inputs.fixed, begin + step, ends[index + 1], now + step * third)
        levels[index + 1] = now + step / 6.0 * (first + 2.0 * (second + third) + fourth)
    return {"level 1": levels[:, 0].T, "level 2": levels[:, 1].T}


def rates(runs: Runs, fixed: Abscissas, time: float, voltage: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Return the rates (2, n) of the levels (2, n) in m/s; `voltage` (3, n) is commanded, applied and past in V."""
    first, second = levels
    values, abscissas = runs.values, {
        **fixed, "time": np.full(len(first), time), "voltage": voltage[0], PAST: voltage[2], "level 1": first,
        "level 2": second}

    def changed(quantity: str) -> np.ndarray | float:
        return runs.evaluate(quantity, abscissas)

    above = np.maximum(first - BRIM, 0.0)
    inflow = values["pump gain"] * (voltage[1] + changed("voltage")) * (1.0 + changed("pump flow"))
    between = values["outlet 1"] * (1.0 + changed("outflow 1")) * np.sqrt(np.maximum(first, 0.0))
    between = between + WEIR * above * np.sqrt(above) * (1.0 + changed("overflow"))
    away = values["outlet 2"] * (1.0 + changed("outflow 2")) * np.sqrt(np.maximum(second, 0.0))
    result = np.empty_like(levels)
    result[0] = (inflow - between - changed("leak 1")) / values["area 1"]
    result[1] = (between - away - changed("leak 2")) / values["area 2"]
    return result
