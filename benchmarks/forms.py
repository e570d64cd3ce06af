"""How far the unseen forms of the hidden test benches are from the formulas of the catalogue.

    python -m benchmarks.forms [LIST]

The forms are those of a list of cases (forms_LIST.csv, and forms.csv for `final`). Each form of a listed pair is
compared with each catalogue effect of the same pair, at its typical strength and on the benches on which the list may
have it: the RMS difference after the best fit of the effect's coefficients within their bounds, as a share of the range
of the form. Both are evenly spaced over the abscissae that twelve engagements with the form visit.

- Where the law is over one number, a second fit adds a constant, which a parameter of the model would take up.
- A lag, an offset or a compliance is compared as such, with the constant of the catalogue; zero counts to its range.
- Other responses of sensors are compared as the change of the reading, at the samples of the engagements where the form
  changes it by more than 1 % of its largest change; hysteresis as the change of the current of the profiles.
"""

import argparse
from collections.abc import Callable, Iterable

import numpy as np
from scipy.optimize import least_squares

from benchmarks.benches import BENCHES
from benchmarks.results import write
from slipstick.clutch.effects import Effect, matching
from slipstick.clutch.effects.effect import SCALAR_DEPENDENCES, Signals
from slipstick.clutch.lag import lagged_signal
from tests.validation.hidden import Case, simulate
from tests.validation.hidden.case import PLAYS
from tests.validation.hidden.effect import Effect as Form
from tests.validation.hidden.equations import MAGNET_TIME
from tests.validation.hidden.forms import BENCHES as ON
from tests.validation.hidden.forms import FORMS
from tests.validation.hidden.nominal import Setup
from tests.validation.hidden.pairs import listed, pair
from tests.validation.hidden.responses import RESPONSES
from tests.validation.hidden.run import Run
from tests.validation.hidden.valve import play, plays

LEAST = 0.1
ENGAGEMENTS, RUNS, SEED, POINTS, STARTS = 12, 54, 70, 100, 8
HEADER = ("form", "quantity", "depends on", "bench", "effect", "RMS difference [share of range]",
          "with a constant [share of range]", "less than 10 %")
SIGNAL = {"motor speed": "motor_speed", "input speed": "input_speed", "output speed": "output_speed",
          "slip": "plate_slip", "pressure": "pressure", "current": "current", "heat": "memory",
          "piston position": "piston_state"}
Law = Callable[[np.ndarray], np.ndarray]  # coefficients -> change at all points


def visited(form: Form, run: Run) -> np.ndarray:
    """The abscissae at which the form acts: the levels, or evenly spaced from the 1st to the 99th percentile."""
    if form.abscissa not in run.quantities or form.abscissa == "sequence":
        return np.linspace(0, 1, RUNS)
    if form.abscissa == "motor_speed":
        return np.unique(run.bench.motor_speed)
    before = run.bench.setup.time <= run.lock_time[:, None]
    acts = np.ones_like(before) if form.block == "pressure" or form.quantity.endswith("_sensor") else before
    if form.quantity.startswith("friction"):
        acts = before & (run.quantities["friction_torque"] > 0)
    elif form.abscissa == "twist":
        acts = ~before
    return np.linspace(*np.percentile(run.quantities[form.abscissa][acts], [1, 99]), POINTS)


def change(form: Form, run: Run, x: np.ndarray) -> np.ndarray:
    """The change by the form: relative for a ratio, else in the unit of the catalogue's quantity."""
    p, law = run.bench.setup.parameters, run.bench.change(form, form.typical, x)
    if form.quantity == "net_pressure":
        return p["b2"] / p["c2"] * law
    if form.quantity == "spring_rate":
        return -p["d2"] / p["c2"] * x * (law - 1)
    return law - 1 if form.kind == "ratio" else law


def formula(effect: Effect, form: Form, setup: Setup, x: np.ndarray) -> Law:
    """The change by the formula of an effect over the abscissae of a form, relative where that is a ratio."""
    p = setup.parameters
    relative = form.kind == "ratio" and form.quantity != "spring_rate"
    factor = {"sequence": (RUNS - 1) / 100, "slip": p["gr"], "energy": 1e-3, "heat": 1e-3}.get(form.abscissa, 1.0)
    name = "run" if form.abscissa == "sequence" else SIGNAL.get(effect.depends_on)
    value = {"clearance": p["z_contact"], "load torque": float(np.median(setup.brake_torque)),
             "piston rate": 0.0}.get(effect.quantity, 1.0)
    values = np.full(len(x), value)
    if effect.depends_on in ("piston rate", "direction"):
        values = x * (p["b2"] / p["c2"] if effect.depends_on == "direction" else 1.0)
    base = dict.fromkeys(Signals._fields, 0.0)
    points = [Signals(**(base | ({name: float(one * factor)} if name else {}))) for one in x]

    def law(coefficients: np.ndarray) -> np.ndarray:
        changed = np.array([effect.formula(v, s, tuple(coefficients)) for v, s in zip(values, points, strict=True)])
        return (changed - values) / (values if relative else 1.0)

    return law


def response(name: str, form: Form, run: Run) -> tuple[np.ndarray, Law]:
    """The change of a reading by a form, and by a lag of first order."""
    signal, time = run.quantities[name], run.bench.setup.time
    kind = form.quantity.rsplit("_", 1)[1]
    read = RESPONSES[kind](signal, form.typical, name, run.bench.setup) - signal
    moves = np.abs(read) > 0.01 * np.abs(read).max()

    def law(coefficients: np.ndarray) -> np.ndarray:
        return (lagged_signal(signal, time, np.full((len(signal), 1), coefficients[0])) - signal)[moves]

    return read[moves], law


def hysteresis(form: Form, run: Run) -> tuple[np.ndarray, Law]:
    """The change of the current of all profiles by a form, and by one play."""
    setup = run.bench.setup
    knots, time = (setup.profile_time, setup.profile_current), setup.time

    def sampled(times: np.ndarray, currents: np.ndarray) -> np.ndarray:
        return np.array([np.interp(time, t, c) for t, c in zip(times, currents, strict=True)])

    commanded = sampled(*knots)
    if form.quantity == "valve_plays":
        widths = setup.scale.get("valve_current", 1.0) * form.law(form.typical, PLAYS)
        changed = sampled(*plays(*knots, widths)) - commanded
    elif form.quantity == "valve_play":
        width = setup.scale.get("valve_current", 1.0)
        up, down = (width * float(form.law(form.typical, way)) for way in (1, -1))
        changed = sampled(*play(*knots, up, down)) - commanded
    else:
        lag = np.full((len(commanded), 1), MAGNET_TIME * setup.scale.get("time", 1.0))
        changed = run.bench.change(form, form.typical, commanded - lagged_signal(commanded, time, lag))
    return changed.ravel(), lambda c: (sampled(*play(*knots, c[0], c[0])) - commanded).ravel()


def distance(form: np.ndarray, law: Law, effect: Effect, size: float, free_level: bool = False) -> float:
    """The RMS difference after the best of several fits, as a share of a size."""
    def difference(coefficients: np.ndarray) -> np.ndarray:
        left = (form - law(coefficients)) / size
        return left - left.mean() if free_level else left

    lower, upper = (np.array([getattr(c, end) for c in effect.coefficients]) for end in ("lower", "upper"))
    random = np.random.default_rng(SEED)
    starts = [np.array(effect.typical), *(lower + random.random((STARTS, len(lower))) * (upper - lower))]
    return min(float(np.sqrt(np.mean(least_squares(
        difference, np.clip(start, lower + 1e-6 * (upper - lower), upper), bounds=(lower, upper),
        x_scale=upper - lower, diff_step=1e-5).fun ** 2))) for start in starts)


def shares(form: Form, effect: Effect, run: Run) -> tuple[float, float | str]:
    """The distances of a form from an effect of its pair on the bench of a run, without and with a constant."""
    quantity, depends_on = pair(form)
    effect = effect.on(BENCHES[run.bench.setup.name].scales)
    scalar, x = depends_on in SCALAR_DEPENDENCES, visited(form, run)
    if depends_on == "past current":
        law, of_effect = hysteresis(form, run)
    elif form.quantity.rsplit("_", 1)[-1] in RESPONSES:
        law, of_effect = response(quantity.removesuffix(" sensor").replace(" ", "_"), form, run)
    elif scalar or depends_on == "direction":
        law, of_effect = change(form, run, x), formula(effect, form, run.bench.setup, x)
    else:
        law, slope = change(form, run, x), x if depends_on == "gain" else np.ones_like(x)
        best = slope * (law @ slope) / (slope @ slope)
        return float(np.sqrt(np.mean((law - best) ** 2)) / np.ptp([*law, 0.0])), ""
    size = float(np.ptp(law))
    return distance(law, of_effect, effect, size), distance(law, of_effect, effect, size, True) if scalar else ""


def near(share: float, with_constant: float | str) -> str:
    """Whether a form is nearer than `LEAST`, and how."""
    if share < LEAST:
        return "yes"
    return "with a constant" if isinstance(with_constant, float) and with_constant < LEAST else ""


def forms_of(which: str) -> list[tuple[Form, tuple[str, ...]]]:
    """The listed forms of a list of cases, each with the benches on which the list may have it."""
    return [(form, ON[which][form.name]) for form in FORMS[which] if listed(form)]


def rows(forms: Iterable[tuple[Form, Iterable[str]]]) -> list[tuple[object, ...]]:
    """The rows of the table: each of the forms, bench and catalogue effect."""
    found: list[tuple[object, ...]] = []
    for form, benches in forms:
        for bench in benches:
            run = simulate(Case({form.name: form.typical}, seed=SEED, count=ENGAGEMENTS, bench=bench), relative=1e-5)
            found += [(form.name, *pair(form), bench, effect.name, *(both := shares(form, effect, run)), near(*both))
                      for effect in matching(*pair(form))]
            if not matching(*pair(form)):
                found.append((form.name, *pair(form), bench, "none of this pair", "", "", ""))
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.forms")
    parser.add_argument("which", choices=FORMS, nargs="?", default="final")
    which = parser.parse_args().which
    write("forms" if which == "final" else f"forms_{which}", HEADER, rows(forms_of(which)),
          f"python -m benchmarks.forms {which}")
