"""The truth about an effect in a common vocabulary: which quantity depends on what."""

from .effect import Effect

QUANTITY = {
    **dict.fromkeys(("valve_play", "valve_plays", "valve_current"), "valve current"), "valve_delay": "valve delay",
    "pressure_gain": "line pressure", "pressure_demand": "line pressure", "pressure_sensor": "pressure sensor",
    "chamber_pressure": "chamber pressure", "oil_temperature_gain": "piston gain", "clearance": "clearance",
    "spring_rate": "piston rate", "piston_feed": "piston rate", "net_pressure": "piston rate",
    "piston_rate": "piston rate", "contact_pressure": "contact pressure", "friction_lag": "friction coefficient",
    "friction_coefficient": "friction coefficient", "film_coefficient": "film torque",
    "output_torque_sensor": "output torque sensor", "shaft_compliance": "stick torque", "brake_torque": "load torque",
    "load_torque": "load torque", "output_speed_sensor": "output speed sensor",
    "converter_torque": "converter torque", "converter_lag": "converter torque", "input_drag": "input torque",
    "input_speed_sensor": "input speed sensor",
}
DEPENDS_ON = {
    "motor_speed": "motor speed", "sequence": "run order", "current": "current", "pressure": "pressure",
    "contact_pressure": "pressure", "driving_pressure": "direction", "input_speed": "input speed",
    "output_speed": "output speed", "slip": "slip", "energy": "heat", "contact_time": "time in contact", "time": "time",
    "pump_angle": "time", "free_piston_rate": "piston rate", "piston": "piston position",
    "piston_position": "piston position", "load_point": "motor speed", "output_position": "output position",
    "heat": "heat", "current_excess": "past current", "twist": "twist",
    "oil_temperature": "oil temperature",
}
LISTED = frozenset({
    ("line pressure", "motor speed"), ("valve current", "past current"), ("valve current", "current"),
    *((f"{signal} sensor", kind) for signal in ("pressure", "input speed", "output speed", "output torque")
      for kind in ("lag", "offset", "gain")),
    ("chamber pressure", "input speed"), ("piston gain", "run order"), ("clearance", "run order"),
    ("piston rate", "pressure"), ("piston gain", "pressure"), ("clearance", "pressure"),
    ("piston rate", "piston rate"), ("piston rate", "piston position"), ("piston rate", "direction"),
    ("friction coefficient", "slip"), ("friction coefficient", "pressure"), ("friction coefficient", "heat"),
    ("friction coefficient", "lag"), ("film torque", "run order"), ("stick torque", "twist"),
    ("converter torque", "lag"), ("load torque", "output speed"),
})
"""The pairs that a catalogue of effects of such a clutch would list."""


def pair(effect: Effect) -> tuple[str, str]:
    """Return the quantity in which the effect acts and what it depends on."""
    if effect.pair:
        return effect.pair
    quantity, abscissa = effect.quantity, effect.abscissa
    own = quantity.removesuffix("_lag").removesuffix("_sensor")
    if quantity.endswith("_sensor_lag"):
        return f"{own.replace('_', ' ')} sensor", "lag"
    if quantity.endswith("_lag"):
        return QUANTITY[quantity], "lag"
    if quantity.endswith("_sensor") and effect.name.endswith(("offset", "gain")):
        return QUANTITY[quantity], "gain" if abscissa == own else "offset"
    special = {"valve_play": "past current", "valve_plays": "past current", "shaft_compliance": "twist"}
    return QUANTITY[quantity], special.get(quantity) or DEPENDS_ON[abscissa]


def listed(effect: Effect) -> bool:
    """Return whether the pair of the effect is among those that a catalogue would list."""
    return pair(effect) in LISTED
