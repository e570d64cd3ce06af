"""Simulated engagements for tests of naming: without noise, or with noise and scatter of the parameters."""

from dataclasses import replace

import numpy as np

from slipstick.bench import Bench, parameters
from slipstick.clutch import effects, ensemble
from slipstick.clutch.effects.effect import SENSORS
from slipstick.clutch.model import Model
from slipstick.naming.block import Block
from slipstick.naming.contact import ContactBlock
from slipstick.naming.input import InputBlock
from slipstick.naming.load import LoadBlock
from slipstick.naming.lock import LockBlock
from slipstick.naming.piston import ClutchBlock
from slipstick.naming.piston_laws import of_plates
from slipstick.naming.scene import Scene
from slipstick.naming.settings import NamingSettings
from slipstick.naming.valve import ValveBlock
from slipstick.recordings import Recordings, Signals
from slipstick.recordings.signals import SIGNAL_UNITS

SCATTER = {"current_gain": 0.005, "pressure_bias": 0.03, "initial_position": 0.05, "friction_coefficient": 0.005,
           "output_viscous": 0.02}
TIMER = 0.001  # s


def scene_of(bench: Bench, model: Model, count: int, seed: int | None = None) -> Scene:
    """`count` engagements of a model in a random order; with a `seed` parameters scatter and sensors have noise.

    The smooth signals are the true ones, before the sensors.
    """
    random = np.random.default_rng(seed)
    conditions = bench.conditions.take(np.linspace(0, len(bench.conditions) - 1, count).astype(int))
    conditions = replace(conditions, run_order=np.random.default_rng(count).permutation(count))
    vectors = np.tile(model.parameters, (count, 1))
    for name, std in SCATTER.items() if seed is not None else ():
        vectors[:, parameters.index(name)] *= 1 + std * random.standard_normal(count)
    time = np.arange(0.0, 1.7, bench.sample_time)
    def simulated(model: Model) -> ensemble.Response:
        return ensemble.simulate(bench.physics.curves, vectors, np.tile(model.coefficients(), (count, 1)), conditions,
                                 time, paired=True, laws=model.laws)

    exact = {name: values for name, values in model.effects.items() if effects.find(name).quantity not in SENSORS}
    true, response = simulated(replace(model, effects=exact)), simulated(model)
    noise = {name: bench.sensors[name].noise or 0.0 for name in SIGNAL_UNITS}
    measured, lock = [getattr(response, name) for name in SIGNAL_UNITS], response.shifting_time
    if seed is not None:
        measured = [values + noise[name] * random.standard_normal(values.shape)
                    for name, values in zip(SIGNAL_UNITS, measured, strict=True)]
        lock = lock + TIMER * random.standard_normal(count)
    return Scene(bench, Recordings(conditions, lock, Signals(time, *measured)), NamingSettings(),
                 {name: getattr(true, name) for name in SIGNAL_UNITS},
                 {name: (std, 0.0) for name, std in noise.items()}, np.array(bench.physics.nominal))


def with_plates(scene: Scene) -> Scene:
    """The scene with what the plates do at nominal parameters."""
    clutch = ClutchBlock(scene, scene.smooth["pressure"])
    return replace(scene, of_plates=of_plates(scene, clutch.contact(np.zeros((len(scene), 7)))))


def block_of(name: str, scene: Scene) -> Block:
    """A block at nominal parameters of the ones before it."""
    pressure, nothing = scene.smooth["pressure"], np.zeros((len(scene), 7))
    if name == "clutch":
        clutch = ClutchBlock(scene, pressure)
        clutch.in_contact = clutch.contact(nothing)
        return clutch
    if name == "contact":
        return ContactBlock(scene, pressure, nothing)
    if name == "lock":
        return LockBlock(scene, scene.smooth["output_speed"])
    return {"valve": ValveBlock, "load": LoadBlock, "input": InputBlock}[name](scene)
