"""Open terms: what a study tries where no effect of the catalogue explains the recordings.

Each is a power of one signal added to one quantity, or as a share of it. A term is data, its coefficient, signal and
power, and so a part of a model like any effect, but it names no physics.
"""

from itertools import product

from slipstick.clutch.effects.effect import Coefficient, Effect, Signals
from slipstick.clutch.fastmath import compiled

SIGNALS = (("time", "0.5 s"), ("pressure", "5 bar"), ("input speed", "100 rad/s"), ("output speed", "30 rad/s"),
           ("plate slip", "50 rad/s"), ("motor speed", "150 rad/s"))
"""What a term may depend on, in the order of its number `signal`, and the value at which it counts as 1."""
_POWERS = (1.0, 2.0, 3.0)
_ADDED = {"line pressure": (1.0, "bar"), "chamber pressure": (1.0, "bar"), "piston rate": (1e-3, "m/s"),
          "converter torque": (10.0, "N m"), "load torque": (10.0, "N m")}
_LOOKED_AT = {"line pressure": (0, 1, 5)}  # the valve knows no speeds but its pump's
_SCALED = ("friction coefficient", "film torque")


@compiled
def _power(signals: Signals, signal: float, power: float) -> float:
    early = (signals.time * 2.0 if signal < 0.5 else signals.pressure * 0.2 if signal < 1.5
             else signals.input_speed * 0.01)
    late = (signals.output_speed / 30.0 if signal < 3.5 else abs(signals.plate_slip) * 0.02 if signal < 4.5
            else signals.motor_speed / 150.0)
    x = early if signal < 2.5 else late
    return x * (x if power > 1.5 else 1.0) * (x if power > 2.5 else 1.0)


@compiled
def _added(value: float, signals: Signals, c: tuple[float, ...]) -> float:
    return value + c[0] * _power(signals, c[1], c[2])


@compiled
def _scaled(value: float, signals: Signals, c: tuple[float, ...]) -> float:
    return value * (1.0 + c[0] * _power(signals, c[1], c[2]))


def _effect(quantity: str, typical: float, unit: str) -> Effect:
    scaled = quantity in _SCALED
    return Effect(
        name=f"open_{quantity.replace(' ', '_')}",
        title=f"Unlisted term in the {quantity}",
        quantity=quantity,
        law=f"{quantity} (1 + share x^power)" if scaled else f"{quantity} + size x^power",
        coefficients=(
            Coefficient("share" if scaled else "size", unit, 0.0, -10 * typical, 10 * typical,
                        "what it adds where x is 1", typical),
            Coefficient("signal", "1", 0.0, 0.0, len(SIGNALS) - 1.0,
                        "x: " + ", ".join(f"{i} {name} over {one}" for i, (name, one) in enumerate(SIGNALS)),
                        1.0, True),
            Coefficient("power", "1", 1.0, 1.0, 3.0, "of x", 1.0, True),
        ),
        source="none: a power of a measured signal",
        signature="whatever residuals the quantity causes that grow with the signal",
        formula=_scaled if scaled else _added,
        listed=False,
        forms=tuple(product((float(i) for i in _LOOKED_AT.get(quantity, range(len(SIGNALS)))), _POWERS)),
    )


EFFECTS = (*(_effect(quantity, *one) for quantity, one in _ADDED.items()),
           *(_effect(quantity, 0.1, "1") for quantity in _SCALED))
