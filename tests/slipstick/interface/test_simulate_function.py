"""`slipstick.simulate`: effects in three forms, engagements, files, and what is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slipstick.clutch import effects
from slipstick.errors import BadRecording, InvalidValue, SlipstickError, UnknownName
from slipstick.interface.simulate import simulate
from slipstick.machine import Machine
from slipstick.recordings import Recordings
from slipstick.recordings.simulated import simulated_recordings
from tests.benches import COMPACT, HEAVY, NOMINAL

FEW = COMPACT.conditions.take(range(0, 90, 9))


def test_effects_are_names_multiples_or_coefficients() -> None:
    on_bench = effects.find("stribeck_friction").on(COMPACT.scales)
    typical = {entry.name: entry.typical for entry in on_bench.coefficients}
    forms: list[Any] = ["stribeck_friction", ["stribeck_friction"], {"stribeck_friction": 1.0},
                        {"stribeck_friction": typical}]
    digests = {simulate(COMPACT, form, conditions=FEW, seed=3).digest for form in forms}
    assert len(digests) == 1
    assert simulate(COMPACT, conditions=FEW, seed=3).digest not in digests
    assert simulate(COMPACT, forms[0], conditions=FEW, seed=4).digest not in digests
    strength = next(entry for entry in on_bench.coefficients if not entry.shape)
    half = {**typical, strength.name: strength.neutral + 0.5 * (strength.typical - strength.neutral)}
    assert (simulate(COMPACT, {"stribeck_friction": 0.5}, conditions=FEW).digest
            == simulate(COMPACT, {"stribeck_friction": half}, conditions=FEW).digest)


def test_it_is_the_simulation_of_the_model_under_the_conditions() -> None:
    model = NOMINAL.with_parameters({"gear_ratio": 3.0})
    few = HEAVY.conditions.take([3, 100])
    given = simulate(HEAVY, model=model, conditions=Recordings(few, np.ones(2)), scatter=0.01, noise=0.5, seed=2)
    assert given.digest == simulated_recordings(HEAVY, model, few, 0.01, 0.5, 2).digest
    assert len(simulate(COMPACT, engagements=7)) == 7
    twice = simulate(COMPACT, conditions=FEW, engagements=20)
    np.testing.assert_array_equal(twice.conditions.motor_speed[:10], twice.conditions.motor_speed[10:])
    assert twice.run_order is not None
    assert sorted(twice.run_order) == list(range(20))


@pytest.mark.parametrize("engagements", [24, 36, 54])
def test_few_engagements_have_all_levels_of_every_condition(engagements: int) -> None:
    taken = simulate(HEAVY, engagements=engagements).conditions
    for name in ("current_profile", "motor_speed", "load_inertia", "brake_torque"):
        levels, counts = np.unique(getattr(taken, name), return_counts=True)
        assert len(levels) == len(np.unique(getattr(HEAVY.conditions, name))), name
        assert counts.max() <= 2 * counts.min(), name


@pytest.mark.parametrize(("given", "message"), [
    ({"engagements": 1 << 46}, "takes more memory than there is .*Give smaller numbers"),
    ({"effects": ["stribek_friction"]}, "Did you mean 'stribeck_friction'"),
    ({"effects": {"stribeck_friction": 99}}, "99 times its typical value, .* Take it between"),
    ({"effects": {"stribeck_friction": {"strength": 99}}}, "is 99. Take it between -0.3 and 1[.]"),
    ({"effects": {"return_spring": 1e6}}, r" m/s\. Take it between -?[0-9.]+ and [0-9.]+ m/s\."),
    ({"effects": {"stribeck_friction": {"strenght": 0.1}}}, "Did you mean 'strength'"),
    ({"effects": {"stribeck_friction": "strong"}}, "Give a multiple of its typical amplitudes"),
    ({"effects": {"stribeck_friction": True}}, "Give a multiple of its typical amplitudes"),
    ({"effects": {"stribeck_friction": float("nan")}}, "Take it between"),
    ({"engagements": 0}, "0 engagements are too few"), ({"scatter": -1.0}, "0 or more"),
    ({"noise": float("nan")}, "0 or more"), ({"seed": -1}, "The seed is -1"),
    ({"model": "missing.json"}, "Cannot read a model"), ({"model": NOMINAL}, "another bench than 'compact'"),
    ({"runs": 3}, "runs is about a declared machine"),
])
def test_what_cannot_be_simulated_is_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(SlipstickError, match=message):
        simulate(COMPACT, **{"conditions": FEW, **given})


@pytest.mark.parametrize("given", [{"effects": "stribeck_friction"}, {"engagements": 7}, {"noise": 0.0}])
def test_what_is_about_a_bench_is_refused_of_a_machine(given: dict[str, Any]) -> None:
    with pytest.raises(InvalidValue, match=f"{next(iter(given))} is about a bench"):
        simulate(Machine.open("two_tanks"), **given)


def test_recordings_are_saved_and_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recordings = simulate(COMPACT, conditions=FEW)
    path = recordings.save(str(tmp_path / "new" / "mine.h5"))
    assert path == tmp_path / "new" / "mine.h5"
    assert Recordings.open(path).digest == Recordings.open(str(path)).digest == recordings.digest
    for name in ("mine.csv", "mine", "new"):
        with pytest.raises(InvalidValue, match=r"Give a path that ends in \.h5"):
            recordings.save(tmp_path / name)
    monkeypatch.chdir(tmp_path / "new")
    assert len(Recordings.open("measured")) == 216  # the shipped ones
    with pytest.raises(UnknownName, match=r"no recordings file 'messured'.*Did you mean 'measured'"):
        Recordings.open("messured")
    with pytest.raises(BadRecording, match="is neither an"):
        Recordings.open("mine.mat")
