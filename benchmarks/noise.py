"""The noise of sensors as it is estimated, beside the true one, on recordings of the hidden benches.

    python -m benchmarks.noise

writes noise.csv: the power at low frequencies over the true one, as the signals by themselves show it, and as the
blocks leave it, on every tenth of the final cases without their bad runs (two minutes on one core).
"""

from collections.abc import Iterator

import numpy as np
from numba import set_num_threads

from benchmarks.benches import BENCHES
from benchmarks.naming import recorded
from benchmarks.results import write
from slipstick.blocks.sensor_noise import Noise, power
from slipstick.naming.scene import Scene
from slipstick.naming.settings import NamingSettings
from slipstick.naming.start import begin
from slipstick.recordings import Recordings
from tests.validation.hidden import cases
from tests.validation.hidden.case import bad_runs_of, simulate

EVERY = 10
WITHIN = (1.2, 2.0)


def ratios() -> Iterator[tuple[str, float, float]]:
    """Yield a signal, and the estimated power over the true one without and with the blocks."""
    for identity in list(cases.LISTS["final"])[::EVERY]:
        case = cases.LISTS["final"][identity]
        run, recordings = simulate(case, relative=1e-6), Recordings.open(recorded("final", identity))
        assert recordings.signals is not None
        good = np.setdiff1d(np.arange(len(recordings)), [bad.run for bad in bad_runs_of(case, run.conditions)])
        scene = Scene.of(BENCHES[case.bench], recordings, NamingSettings()).take(good)
        found = begin(scene, lambda _: None).noise
        for name in recordings.signals.names:
            true = power(shown((recordings.signals[name].astype(float) - run.readings[name])[good]))
            yield name, power(scene.noise[name]) / true, power(found[name]) / true


def shown(noise: np.ndarray) -> Noise:
    """Standard deviation and correlation of noise (n, k) itself."""
    return float(noise.std()), float((noise[:, 1:] * noise[:, :-1]).mean() / noise.var())


def main() -> None:
    """Write the table."""
    set_num_threads(1)
    found = list(ratios())
    rows = []
    for name in dict.fromkeys(name for name, _, _ in found):
        for source, column in (("signals", 1), ("blocks", 2)):
            off = np.abs(np.log([one[column] for one in found if one[0] == name]))
            rows.append([name.replace("_", " "), source, len(off), *(int((off <= np.log(by)).sum()) for by in WITHIN),
                         float(np.exp(off.max()))])
    header = ("signal", "estimated from", "cases", *(f"within a factor of {by}" for by in WITHIN), "worst factor")
    write("noise", header, rows, "python -m benchmarks.noise")


if __name__ == "__main__":
    main()
