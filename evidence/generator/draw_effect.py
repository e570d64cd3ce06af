"""Draws the law of an effect: a form of random shape over the range that the nominal runs of a bench visit."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .dependences import CONSTANT_IN_A_RUN, Dependence
from .effect import Effect
from .forms import Curve, draw_curve, draw_drift, draw_friction, draw_lag, draw_memory, draw_size
from .run import Run
from .states import SLIP, STICK

_OF_PISTON = ("oil_temperature_gain", "clearance", "spring_rate", "piston_feed", "net_pressure", "piston_rate",
              "film_coefficient")
"""Quantities that change nothing once the plates are pressed together."""
_TEMPERATURES = (40.0, 92.0)
"""Oil temperatures in °C between which runs are; see temptations.py."""
_LEAST_RATIO = 0.05


@dataclass(frozen=True)
class DrawnEffect:
    """An `effect`, and a `typical` amplitude, at which it is plausible and its consequences are small."""

    effect: Effect
    typical: float


def draw_effect(dependence: Dependence, nominal: Run, random: np.random.Generator) -> DrawnEffect:
    """Draw a law for a dependence on the bench of these nominal runs."""
    draw = _DRAWS[dependence.law]
    return draw(dependence, nominal, random)


def collect_visited(quantity: str, abscissa: str, run: Run) -> np.ndarray:
    """Return the abscissas (m,) where an effect on the quantity acts.

    These are, for friction, the samples of slip in contact, and for the piston those before full contact.
    """
    if abscissa == "oil_temperature":
        return np.linspace(*_TEMPERATURES, 100)
    if abscissa == "sequence":
        return np.linspace(0, 1, 100)
    if abscissa == "twist":  # there is none in nominal runs: that of the torque at the typical compliance
        stuck = run.phase[1] == STICK
        return np.abs(run.quantities["output_torque"][stuck]) * _typical_compliance(run)
    values, mode = run.quantities[abscissa], run.phase[1]
    if quantity in ("friction_coefficient", "friction_lag", "contact_pressure"):
        return values[(mode == SLIP) & (run.quantities["friction_torque"] > 0)]
    if quantity in _OF_PISTON:
        return values[(mode != STICK) & (run.quantities["piston_position"] < run.quantities["clearance"])]
    return values[mode != STICK] if not quantity.endswith("_sensor") else values.ravel()


def bounds_of(values: np.ndarray) -> tuple[float, float]:
    """Return the range in which nearly all of the values (m,) are."""
    low, high = np.quantile(values, (0.01, 0.99))
    return float(low), float(high) if high > low else float(low) + 1.0


def size_of(quantity: str, run: Run) -> float:
    """Return the size of a quantity: the 90th percentile of its magnitude before lock-up."""
    values = run.quantities[quantity.removesuffix("_sensor")]
    return float(np.percentile(np.abs(values[run.phase[1] != STICK]), 90))


def _draw_form(dependence: Dependence, random: np.random.Generator) -> tuple[Curve, np.ndarray]:
    """Draw a form, and its value where the model is right."""
    form = draw_drift(random) if dependence.abscissa == "sequence" else draw_curve(random)
    return form, form(np.array(random.random()))


def _over(dependence: Dependence, nominal: Run, magnitude: bool = False) -> Callable[[np.ndarray], np.ndarray]:
    """Return the map of an abscissa, or its magnitude, to the share of the visited range."""
    values = collect_visited(dependence.quantity, dependence.abscissa, nominal)
    low, high = bounds_of(np.abs(values) if magnitude else values)
    return lambda x: ((np.abs(x) if magnitude else x) - low) / (high - low)


def _effect(dependence: Dependence, kind: str, law: Callable, form: Curve, **others: object) -> Effect:
    return Effect(dependence.pair, dependence.block, dependence.quantity, dependence.abscissa, kind, law, form.family,
                  form.trend, **others)


def _draw_ratio(dependence: Dependence, nominal: Run, random: np.random.Generator) -> DrawnEffect:
    share = _over(dependence, nominal, magnitude=dependence.abscissa == "free_piston_rate")
    form, zero = _draw_form(dependence, random)
    return DrawnEffect(_effect(dependence, "ratio", lambda amplitude, x: np.maximum(
        1 + amplitude * (form(share(x)) - zero), _LEAST_RATIO), form), 0.1)


def _draw_exponent(dependence: Dependence, nominal: Run, random: np.random.Generator) -> DrawnEffect:
    share = _over(dependence, nominal)
    form, zero = _draw_form(dependence, random)
    return DrawnEffect(_effect(dependence, "ratio", lambda amplitude, x: np.exp(
        np.clip(amplitude * (form(share(x)) - zero), -6, 6)), form), 0.5)


def _draw_difference(dependence: Dependence, nominal: Run, random: np.random.Generator) -> DrawnEffect:
    share = _over(dependence, nominal)
    form, zero = _draw_form(dependence, random)
    if dependence.pair[1] == "gain":
        zero = form(share(np.zeros(1)))[0]
    elif dependence.pair[1] == "offset":  # mostly there from the first run on
        zero = zero + random.choice([-1, 1]) * random.uniform(0.5, 2)
    return DrawnEffect(_effect(dependence, "difference", lambda amplitude, x: amplitude * (form(share(x)) - zero),
                               form), 0.05 * size_of(dependence.quantity, nominal))


def _draw_size(dependence: Dependence, nominal: Run, random: np.random.Generator) -> DrawnEffect:
    share, form = _over(dependence, nominal), draw_size(random)
    pace = nominal.engagements.bench.pace
    sign, typical = {"piston_feed": (-1, 0.2 * _feed(nominal)), "friction_lag": (1, 0.02 * pace),
                     "converter_lag": (1, 0.05 * pace), "shaft_compliance": (1, _typical_compliance(nominal))}[
        dependence.quantity]
    return DrawnEffect(_effect(dependence, "difference", lambda amplitude, x: sign * amplitude * form(share(x)), form),
                       typical)


def _feed(nominal: Run) -> float:
    """Return the stroke of the piston over the size of the pressure, in m/bar."""
    return nominal.engagements.bench.parameters["z_contact"] / size_of("pressure", nominal)


def _typical_compliance(nominal: Run) -> float:
    """Return a compliance in rad/(N m) with which the shafts ring with a tenth of the shifting time as period."""
    engagements = nominal.engagements
    p = engagements.bench.parameters
    inertia = 1 / (1 / np.mean(engagements.load_inertia) + 1 / (p["Ji"] * p["gr"] ** 2))
    return float((0.1 * engagements.bench.pace / (2 * np.pi)) ** 2 / inertia)


def _draw_friction(dependence: Dependence, nominal: Run, random: np.random.Generator) -> DrawnEffect:
    """Draw a force against the driving one, which it cannot exceed."""
    share, form = _over(dependence, nominal, magnitude=True), draw_friction(random)
    return DrawnEffect(_effect(dependence, "difference", lambda amplitude, x: -np.sign(x) * np.minimum(
        np.abs(x), amplitude * form(share(x))), form), 0.1 * size_of(dependence.quantity, nominal))


def _draw_current(dependence: Dependence, nominal: Run, random: np.random.Generator) -> DrawnEffect:
    """Draw a smooth difference, because the pressure depends on the rate of the valve's current."""
    share = _over(dependence, nominal)
    form = draw_curve(random, smooth=True)
    zero = form(share(np.zeros(1)))[0] if dependence.abscissa == "current_excess" else form(np.array(random.random()))
    return DrawnEffect(_effect(dependence, "difference", lambda amplitude, x: amplitude * (form(share(x)) - zero),
                               form), 0.03 * float(np.ptp(nominal.engagements.knot_current)))


def _draw_plays(dependence: Dependence, nominal: Run, random: np.random.Generator) -> DrawnEffect:
    memory = draw_memory(random)
    form = f"{len(memory.widths)} play{'s' if len(memory.widths) > 1 else ''}"
    effect = Effect(dependence.pair, dependence.block, dependence.quantity, dependence.abscissa, "difference",
                    lambda amplitude, x: 0 * x, form, "neither",
                    plays=(memory.widths, memory.weights, memory.asymmetry))
    return DrawnEffect(effect, 0.02 * float(np.ptp(nominal.engagements.knot_current)))


def _draw_sensor_lag(dependence: Dependence, nominal: Run, random: np.random.Generator) -> DrawnEffect:
    lag = draw_lag(random)
    effect = Effect(dependence.pair, dependence.block, dependence.quantity, dependence.abscissa, "difference",
                    lambda amplitude, x: amplitude + 0 * x, lag.family, "neither", response=lag)
    return DrawnEffect(effect, 0.01 * nominal.engagements.bench.pace)


_DRAWS: dict[str, Callable[[Dependence, Run, np.random.Generator], DrawnEffect]] = {
    "ratio": _draw_ratio, "exponent": _draw_exponent, "difference": _draw_difference, "size": _draw_size,
    "friction": _draw_friction, "current": _draw_current, "past current": _draw_current, "plays": _draw_plays,
    "sensor lag": _draw_sensor_lag,
}


def can_act_in_few_runs(effect: Effect) -> bool:
    """Return whether the effect may be absent in a run, and differ within one."""
    return (effect.abscissa not in CONSTANT_IN_A_RUN and not effect.quantity.endswith(("_lag", "shaft_compliance"))
            and effect.plays is None)
