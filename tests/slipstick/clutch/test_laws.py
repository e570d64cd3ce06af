"""Measured laws: agreement with the reference, with effects that they tabulate, and what carries them."""

import csv
import io
import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.io import loadmat

from slipstick.bench import Bench, parameters
from slipstick.bench.conditions import Conditions
from slipstick.clutch import effects, ensemble, reference
from slipstick.clutch.effects.effect import SCALAR_DEPENDENCES, SENSORS
from slipstick.clutch.laws import DEPENDENCES, MOST_LAWS, MOST_POINTS, OF_SENSORS, QUANTITIES, MeasuredLaw
from slipstick.clutch.model import Model
from slipstick.errors import InvalidValue, UnknownName
from tests.benches import BENCHES, HEAVY, NOMINAL

FINEST = ensemble.Accuracy(2e-5, 1e-4)
SIGNALS = ("pressure", "input_speed", "output_speed", "output_torque", "piston_position")
DRAG = MeasuredLaw("load torque", "output speed", (0.0, 20.0, 60.0), (0.0, 2.0, 30.0), relative=False)

# Every quantity and every dependence, some of each twice.
PAIRS = [*zip((one for one in QUANTITIES if one not in SENSORS), SCALAR_DEPENDENCES, strict=True),
         ("line pressure", "pressure"), ("valve current", "time in contact"), ("contact pressure", "heat"),
         ("brake torque", "output speed")]
OF_SENSOR = [*zip([*SENSORS, *SENSORS][:len(OF_SENSORS)], OF_SENSORS, strict=True),
             ("output torque sensor", "output torque"),
             ("pressure sensor", "run order"), ("input speed sensor", "input speed")]


def sizes(bench: Bench) -> dict[str, float]:
    """How large a quantity or dependence is on a bench, in its unit."""
    scales, names = bench.scales, ("input speed", "motor speed", "slip")
    return {**dict.fromkeys(names, scales.speed), "output speed": scales.load_speed,
            **dict.fromkeys(("pressure", "line pressure", "chamber pressure"), scales.pressure),
            "output torque": scales.load_torque, "pressure sensor": scales.pressure, "input speed sensor": scales.speed,
            "output speed sensor": scales.load_speed, "output torque sensor": scales.load_torque,
            **dict.fromkeys(("current", "valve current"), scales.current), "time": 0.6, "time in contact": 0.4,
            "run order": float(len(bench.conditions)), "heat": 0.5 * scales.energy, "piston gain": 1.0,
            **dict.fromkeys(("piston position", "clearance"), scales.stroke), "piston rate": scales.piston_rate,
            "contact pressure": 0.5e5 * scales.pressure, "film torque": 0.1 * scales.torque,
            "friction coefficient": bench.physics.nominal[parameters.index("friction_coefficient")],
            "converter torque": scales.torque,
            **dict.fromkeys(("brake torque", "load torque"), 0.3 * scales.load_torque)}


def ordered(bench: Bench) -> Conditions:
    return replace(bench.conditions, run_order=np.random.default_rng(4).permutation(len(bench.conditions)))


def law_on(bench: Bench, quantity: str, depends_on: str, relative: bool) -> MeasuredLaw:
    size = sizes(bench)
    scale = 0.1 if relative else 0.1 * size[quantity]
    at, change = np.array([0.1, 0.3, 0.5, 0.8]) * size[depends_on], np.array([0.2, 1.0, -0.5, 0.7]) * scale
    return MeasuredLaw(quantity, depends_on, tuple(at), tuple(change), relative)


def errors(model: Model, conditions: Conditions, condition: int) -> tuple[float, float]:
    """Largest errors against the reference: shifting time in s, signals as a fraction of their range."""
    times = np.linspace(0.0, 1.0, 40)
    shifting_time, signals = reference.simulate(model, conditions, condition, times, tolerance=1e-7)
    fast = ensemble.signals(model, conditions.take([condition]), times, accuracy=FINEST)
    found = np.stack([getattr(fast, name)[0, 0] for name in SIGNALS], axis=-1)
    return (abs(float(fast.shifting_time[0, 0]) - shifting_time),
            float((np.abs(found - signals).max(axis=0) / np.ptp(signals, axis=0)).max()))


@pytest.mark.parametrize(("quantity", "depends_on", "bench"), [
    pytest.param(*pair, bench, id=f"{' over '.join(pair)}, {bench.name}",
                 marks=[pytest.mark.slow] * ((place + other) % 2))
    for place, pair in enumerate(PAIRS) for other, bench in enumerate(BENCHES)])
def test_agrees_with_the_reference_implementation(bench: Bench, quantity: str, depends_on: str) -> None:
    conditions, nominal = ordered(bench), Model(bench.physics)
    fastest = int(np.nanargmin(ensemble.shifting_times(nominal, conditions)[0]))
    law = law_on(bench, quantity, depends_on, relative=PAIRS.index((quantity, depends_on)) % 2 == 0)
    time, signals = errors(nominal.with_law(law), conditions, fastest)
    assert time < 1e-5
    assert signals < 2e-4
    without, default = (ensemble.shifting_times(model, conditions)[0] for model in (nominal, nominal.with_law(law)))
    assert np.nanmax(np.abs(default - without)) > 1e-4
    few = conditions.take(range(0, len(conditions), 6))
    tight = ensemble.shifting_times(nominal.with_law(law), few, accuracy=FINEST)[0]
    assert np.nanmax(np.abs(default[:, ::6] - tight)) < 2e-4


@pytest.mark.parametrize(("quantity", "depends_on"), OF_SENSOR, ids=[" over ".join(pair) for pair in OF_SENSOR])
def test_a_law_of_a_sensor_agrees_with_the_reference_and_changes_nothing_but_its_reading(quantity: str,
                                                                                         depends_on: str) -> None:
    conditions, nominal, times = ordered(HEAVY).take([3, 200]), Model(HEAVY.physics), np.linspace(0.0, 1.0, 40)
    law = law_on(HEAVY, quantity, depends_on, relative=OF_SENSOR.index((quantity, depends_on)) % 2 == 0)
    model = nominal.with_effect(f"{quantity} lag".replace(" ", "_"), {"lag": 0.02}).with_law(law)
    time, signals = errors(model, conditions, 1)
    assert time < 1e-5
    assert signals < 2e-4
    read, true = (ensemble.signals(one, conditions, times) for one in (model, nominal))
    np.testing.assert_array_equal(read.shifting_time, true.shifting_time)
    changed = {name for name in SIGNALS if not np.array_equal(getattr(read, name), getattr(true, name))}
    assert changed == {quantity.removesuffix(" sensor").replace(" ", "_")}


def test_every_quantity_and_dependence_is_compared_with_the_reference() -> None:
    assert {pair[0] for pair in (*PAIRS, *OF_SENSOR)} == {*QUANTITIES}
    assert {pair[1] for pair in (*PAIRS, *OF_SENSOR)} == {*DEPENDENCES}
    assert {pair[1] for pair in OF_SENSOR} == {*OF_SENSORS}


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
def test_laws_act_in_their_order_after_the_effects(bench: Bench) -> None:
    conditions = ordered(bench)
    pairs = (("friction coefficient", "heat", True), ("friction coefficient", "slip", False),
             ("line pressure", "motor speed", True), ("friction coefficient", "piston rate", True))
    laws = tuple(law_on(bench, *pair) for pair in pairs)
    model = Model(bench.physics, laws=laws)
    for name in ("thermal_fade", "stribeck_friction", "supply_droop", "converter_lag"):
        its = effects.find(name).on(bench.scales).coefficients
        model = model.with_effect(name, {one.name: one.typical for one in its})
    fastest = int(np.nanargmin(ensemble.shifting_times(model, conditions)[0]))
    time, signals = errors(model, conditions, fastest)
    assert time < 1e-5
    assert signals < 1e-3
    exchanged = replace(model, laws=(laws[1], laws[0], *laws[2:]))
    assert exchanged.digest != model.digest
    assert not np.array_equal(*(ensemble.shifting_times(one, conditions)[0] for one in (model, exchanged)))


Tabulated = Callable[[np.ndarray, float], np.ndarray]


@pytest.mark.parametrize(("effect", "depends_on", "relative", "change"), [
    ("quadratic_load_drag", "output speed", False, lambda x, drag: drag * x * x),
    ("thermal_fade", "heat", True, lambda x, fade: 1 / (1 + fade * x) - 1),
    ("supply_droop", "motor speed", True, lambda x, droop: -droop * (200 / x - 1)),
])
@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)
def test_a_law_that_tabulates_an_effect_gives_its_shifting_times_and_of_opposite_sign_others(
        bench: Bench, effect: str, depends_on: str, relative: bool, change: Tabulated) -> None:
    its, nominal = effects.find(effect).on(bench.scales), Model(bench.physics)
    typical = its.coefficients[0].typical
    largest = 2 * sizes(bench)[depends_on]
    x = np.linspace(bench.conditions.motor_speed.min() if depends_on == "motor speed" else 0.0,
                    bench.conditions.motor_speed.max() if depends_on == "motor speed" else largest, MOST_POINTS)
    values = change(x, typical)
    right, wrong = (nominal.with_law(MeasuredLaw(its.quantity, depends_on, tuple(x), tuple(sign * values), relative))
                    for sign in (1, -1))
    expected = ensemble.shifting_times(nominal.with_effect(effect, {its.coefficients[0].name: typical}),
                                       bench.conditions)[0]
    found, opposite = (ensemble.shifting_times(model, bench.conditions)[0] for model in (right, wrong))
    assert np.abs(found - expected).max() < 1e-3
    assert not np.nanmax(np.abs(opposite - expected)) < 1e-2


def test_a_law_is_linear_between_its_points_and_constant_outside() -> None:
    assert [DRAG.changed(100.0, x) for x in (-1.0, 10.0, 60.0, 99.0)] == [100.0, 101.0, 130.0, 130.0]
    assert replace(DRAG, relative=True).changed(100.0, 10.0) == 200.0


def test_a_law_of_no_change_gives_the_papers_model() -> None:
    samples = np.linspace(0, 1.5, 20)
    zero = NOMINAL.with_law(replace(DRAG, change=(0.0, 0.0, 0.0)))
    for name in ("shifting_time", *SIGNALS):
        both = (getattr(ensemble.signals(model, HEAVY.conditions, samples), name) for model in (NOMINAL, zero))
        np.testing.assert_array_equal(*both)


def test_results_do_not_depend_on_threads_or_pairing() -> None:
    n, model = len(HEAVY.conditions), NOMINAL.with_law(DRAG).with_law(law_on(HEAVY, "clearance", "heat", True))
    vectors, coefficients = np.tile(model.parameters, (n, 1)), np.tile(model.coefficients(), (n, 1))
    pairs = ensemble.simulate(HEAVY.physics.converter, vectors, coefficients, HEAVY.conditions, threads=3, paired=True,
                              laws=model.laws)
    alone = ensemble.shifting_times(model, HEAVY.conditions, threads=1)[0][0]
    np.testing.assert_array_equal(pairs.shifting_time, alone)


def test_spec_survives_json_and_the_digest_of_a_model_without_laws_is_unchanged() -> None:
    assert "laws" not in NOMINAL.spec()
    model = NOMINAL.with_law(DRAG).with_law(law_on(HEAVY, "clearance", "run order", True))
    restored = Model.from_spec(json.loads(json.dumps(model.spec())))
    assert restored == model
    assert restored.digest == model.digest != NOMINAL.digest
    assert replace(model, laws=()).digest == NOMINAL.digest
    assert MeasuredLaw("load torque", "output speed", (0, 20, 60), (0, 2, 30), False).spec() == DRAG.spec()
    assert json.dumps(DRAG.spec()["units"]) == '{"at": "rad/s", "change": "N m"}'
    assert model.uses_run_order
    assert not NOMINAL.with_law(DRAG).uses_run_order


def test_a_spec_in_other_units_is_rejected() -> None:
    spec = {**DRAG.spec(), "units": {"at": "rpm", "change": "N m"}}
    with pytest.raises(InvalidValue, match="other units than rad/s and N m"):
        MeasuredLaw.from_spec(spec)


@pytest.mark.parametrize(("changed", "message"), [
    ({"quantity": "load torqe"}, "Did you mean 'load torque'"), ({"quantity": "stick torque"}, "no quantity"),
    ({"depends_on": "speed"}, "no dependence .of a measured law. 'speed'"),
    ({"change": (0.0, 1.0)}, "3 points and 2 values"), ({"at": (0.0,), "change": (1.0,)}, "Give 2 to 16 points"),
    ({"at": tuple(range(17)), "change": tuple(range(17))}, "Give 2 to 16 points"),
    ({"at": (0.0, 20.0, 20.0)}, "points that do not rise. Sort them"), ({"at": (0.0, 1e-12, 1.0)}, "do not rise"),
    ({"change": (0.0, float("nan"), 1.0)}, "not finite"), ({"at": (0.0, 1.0, float("inf"))}, "not finite"),
    ({"quantity": "line pressure", "depends_on": "piston rate"}, "has no solution"),
    ({"quantity": "pressure sensor", "depends_on": "slip"}, "a sensor can have. Let it depend on one of: motor"),
    ({"depends_on": "output torque"}, "a quantity can have. Let it depend on one of: motor"),
])
def test_a_law_that_is_none_is_rejected_with_a_remedy(changed: dict[str, object], message: str) -> None:
    with pytest.raises((InvalidValue, UnknownName), match=message):
        replace(DRAG, **changed)  # type: ignore[arg-type]


def test_too_many_laws_are_rejected() -> None:
    with pytest.raises(InvalidValue, match="at most 4 measured laws, not 5"):
        replace(NOMINAL, laws=(DRAG,) * (MOST_LAWS + 1))
    with pytest.raises(InvalidValue, match="5 measured laws are too many"):
        ensemble.simulate(HEAVY.physics.converter, np.array([NOMINAL.parameters]), NOMINAL.coefficients()[None],
                          HEAVY.conditions, laws=(DRAG,) * (MOST_LAWS + 1))


def test_a_law_as_csv_and_as_a_matlab_file() -> None:
    for law, column in ((DRAG, "load_torque_change [N m]"),
                        (replace(DRAG, relative=True), "load_torque_relative_change [1]")):
        heading, *rows = csv.reader(io.StringIO(law.export(".csv").decode()))
        assert heading == ["output_speed [rad/s]", column]
        np.testing.assert_array_equal(np.array(rows, float).T, [law.at, law.change])
        name = column.split(" ")[0]
        content = loadmat(io.BytesIO(law.export(".mat")), simplify_cells=True)
        np.testing.assert_array_equal(content["output_speed"], law.at)
        np.testing.assert_array_equal(content[name], law.change)
        assert (content["quantity"], content["depends_on"]) == ("load torque", "output speed")
        assert (content["output_speed_unit"], content[f"{name}_unit"]) == law.units
        assert content["relative"] == law.relative
