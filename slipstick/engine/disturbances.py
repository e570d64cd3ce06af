"""The disturbances of a part: what its quantities do within a run for reasons that are not modelled.

They are first-order autoregressive, and reach the signals through the equations, as the noise of measured inputs does:
process noise (Ljung, System Identification, 1999, section 4.3). Without them, every small disturbance that a precise
sensor shows is significant. By what they leave, the noise of measured inputs is estimated as well.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from slipstick.engine.noise import HIGHEST, Noise, bound_noise
from slipstick.engine.part_fit import PartFit
from slipstick.engine.recordings import Part
from slipstick.engine.whitening import CarriedNoise, Whitening
from slipstick.machine.declaration import identifier_of

_LEAST = 1e-3
"""Least standard deviation of a disturbance or of a sensor, over the largest one: it is then as good as none."""
_LACKING = 1e3
"""Largest standard deviation of what is missing, over that of the noise of the input beside which it acts."""
_LASTING = 0.9, 0.9999
"""Autocorrelations of what is missing: slower than noise, and within the recordings."""


def estimate_input_noise(model: PartFit, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Return the mean of the noise (n, k) of some measured inputs, given what a fit leaves.

    What the model lacks is in this as well, and slower. Beside each of these inputs acts a slow disturbance therefore,
    with the standard deviation and correlation of the largest likelihood.
    """
    part, residual = model.part, model.residual
    carried = [(rows, noise) for rows, noise in model.find_carried() if noise is not None]
    places = [list(part.noise).index(name) for name in names]
    stds = np.array([part.noise[name].std for name in names])

    def filter_beside(rows: slice, noise: CarriedNoise, values: np.ndarray) -> Whitening:
        lacking = [Noise(float(std), float(rho)) for std, rho in zip(
            stds * np.exp(values[:len(names)]), np.tanh(values[len(names):]), strict=True)]
        directions = {name: np.concatenate([array, array[..., places]], axis=-1)
                      for name, array in (("F", noise.F), ("G", noise.G), ("E", noise.E))}
        loudness = np.concatenate([noise.loudness, np.ones((len(noise.loudness), len(names)))], axis=1)
        return Whitening.of(part.counted[rows], part.sensors, part.loudness[rows],
                            replace(noise, inputs=(*noise.inputs, *lacking), loudness=loudness, **directions))

    def lack(values: np.ndarray) -> float:
        return -sum(filter_beside(rows, noise, values).log_likelihood(residual[rows]) for rows, noise in carried)

    begin = np.concatenate([np.zeros(len(names)), np.full(len(names), np.arctanh(0.99))])
    bounds = [(float(np.log(_LEAST)), float(np.log(_LACKING)))] * len(names) + [
        (float(np.arctanh(_LASTING[0])), float(np.arctanh(_LASTING[1])))] * len(names)
    best = scipy.optimize.minimize(lack, begin, method="L-BFGS-B", bounds=bounds).x
    shown = np.concatenate([filter_beside(rows, noise, best).estimate_inputs(residual[rows])
                            for rows, noise in carried])
    # The residual has the noise of an input with the opposite sign.
    return {name: -shown[:, place] for name, place in zip(names, places, strict=True)}


def estimate_disturbances(model: PartFit) -> Part:
    """Return a part with the disturbances and the noise of sensors that give what a fit leaves the largest likelihood.

    Disturbances are no larger than declared, and the noise of a sensor than its signal shows: what is left beyond that
    is missing in the model.
    """
    part = model.part
    carried = [(rows, noise) for rows, noise in model.find_carried() if noise is not None]
    residual = model.residual
    disturbed = {identifier_of(each.name): each.disturbance for each in part.block.quantities if each.disturbance > 0}
    scaled = part.measured / part.loudness[:, :, None]

    def read(values: np.ndarray) -> tuple[tuple[Noise, ...], dict[str, Noise]]:
        """Return the noise of sensors and the disturbances with logarithms of shares, and correlations."""
        shares, correlations = np.exp(values[:len(values) // 2]), np.tanh(values[len(values) // 2:])
        noise = [Noise(float(share), float(rho)) for share, rho in zip(shares, correlations, strict=True)]
        sensors = tuple(replace(each, std=each.std * bound_noise(replace(each, std=np.inf), scaled[:, place]).std)
                        for place, each in enumerate(noise[:len(part.sensors)]))
        return sensors, {name: replace(each, std=each.std * largest) for (name, largest), each in zip(
            disturbed.items(), noise[len(sensors):], strict=True)}

    def lack(values: np.ndarray) -> float:
        sensors, disturbances = read(values)
        inputs = (*part.noise.values(), *disturbances.values())
        return -sum(Whitening.of(part.counted[rows], sensors, part.loudness[rows], replace(noise, inputs=inputs))
                    .log_likelihood(residual[rows]) for rows, noise in carried)

    before = (*part.sensors, *part.disturbances.values())
    largest = [bound_noise(replace(each, std=np.inf), scaled[:, place]).std for place, each in enumerate(part.sensors)]
    shares = [each.std / most for each, most in zip(before, (*largest, *disturbed.values()), strict=True)]
    begin = np.concatenate([np.log(np.clip(shares, _LEAST, 1.0)), np.arctanh([each.correlation for each in before])])
    most = float(np.arctanh(HIGHEST))
    bounds = [(float(np.log(_LEAST)), 0.0)] * len(before) + [(-most, most)] * len(before)
    sensors, disturbances = read(scipy.optimize.minimize(lack, begin, method="L-BFGS-B", bounds=bounds).x)
    return replace(part, sensors=sensors, disturbances=disturbances)
