"""Open terms: candidates for a study in which no effect of the catalogue explains the recordings.

Each term adds a power of one signal to one quantity, or scales the quantity by it. A term is part of a model like any
effect, described by its coefficient, signal and power, but it has no physical interpretation.
"""

from itertools import product

from slipstick.clutch.effects.effect import QUANTITIES, Coefficient, Effect, Signals
from slipstick.clutch.fastmath import compiled

SIGNALS = (("time", "0.5 s"), ("pressure", "5 bar"), ("input speed", "100 rad/s"), ("output speed", "30 rad/s"),
           ("plate slip", "50 rad/s"), ("motor speed", "150 rad/s"))
"""Signals that a term may depend on, indexed by its coefficient `signal`, with their reference values: x is 1 there."""
_CHOICES = ", ".join(f"{i} {name} over {reference}" for i, (name, reference) in enumerate(SIGNALS))
_POWERS = (1.0, 2.0, 3.0)
_ADDED = {"line pressure": (0.07, "pressure"), "chamber pressure": (0.07, "pressure"),
          "piston rate": (0.045, "piston_rate"), "converter torque": (0.022, "torque"),
          "load torque": (0.007, "load_torque")}
"""The typical value of a term, as a multiple of a scale of the bench."""
_ALLOWED_SIGNALS = {"line pressure": (0, 1, 5)}  # of the speeds, only that of the pump affects the valve
_SCALED = ("friction coefficient", "film torque")


@compiled
def _power(signals: Signals, signal: float, power: float) -> float:
    first_three = (signals.time * 2.0 if signal < 0.5 else signals.pressure * 0.2 if signal < 1.5
                   else signals.input_speed * 0.01)
    last_three = (signals.output_speed / 30.0 if signal < 3.5 else abs(signals.plate_slip) * 0.02 if signal < 4.5
                  else signals.motor_speed / 150.0)
    x = first_three if signal < 2.5 else last_three
    return x * (x if power > 1.5 else 1.0) * (x if power > 2.5 else 1.0)


@compiled
def _added(value: float, signals: Signals, c: tuple[float, ...]) -> float:
    return value + c[0] * _power(signals, c[1], c[2])


@compiled
def _scaled(value: float, signals: Signals, c: tuple[float, ...]) -> float:
    return value * (1.0 + c[0] * _power(signals, c[1], c[2]))


def _effect(quantity: str, typical: float, scale: str | None) -> Effect:
    scaled = scale is None
    return Effect(
        name=f"open_{quantity.replace(' ', '_')}",
        title=f"Unlisted term in the {quantity}",
        quantity=quantity,
        depends_on="time",  # or another of SIGNALS, which the coefficient `signal` chooses
        law=f"{quantity} (1 + share x^power)" if scaled else f"{quantity} + size x^power",
        coefficients=(
            Coefficient("share" if scaled else "size", "1" if scaled else QUANTITIES[quantity], 0.0, -10 * typical,
                        10 * typical, "value of the term at x = 1", typical, scale={scale: 1} if scale else {}),
            Coefficient("signal", "1", 0.0, 0.0, len(SIGNALS) - 1.0, f"x: {_CHOICES}", 1.0, True),
            Coefficient("power", "1", 1.0, 1.0, 3.0, "power of x", 1.0, True),
        ),
        source="none: an empirical power of a signal",
        signature="residuals of the quantity that grow with the signal",
        formula=_scaled if scaled else _added,
        listed=False,
        forms=tuple(product((float(i) for i in _ALLOWED_SIGNALS.get(quantity, range(len(SIGNALS)))), _POWERS)),
    )


EFFECTS = (*(_effect(quantity, typical, scale) for quantity, (typical, scale) in _ADDED.items()),
           *(_effect(quantity, 0.1, None) for quantity in _SCALED))
