"""Real recordings: files of others are read as they are described, on made-up ones."""

from pathlib import Path

import numpy as np
import scipy

from evidence.real import emps


def test_positioning_system_is_cut_into_moves_of_all_recordings(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    time = 1e-3 * np.arange(2000)
    position = np.stack([0.1 * np.sin(3 * time), 0.2 * np.sin(3 * time)]) + 1e-7 * rng.standard_normal((2, 2000))
    voltage, pulses = rng.standard_normal((2, 2000)), 10 * rng.standard_normal(2000)
    for name, row, more in (("DATA_EMPS", 0, {}), ("DATA_EMPS_PULSES", 1, {"pulses_N": pulses[:, None]})):
        scipy.io.savemat(tmp_path / f"{name}.mat", {"qm": position[row][:, None], "vir": voltage[row][:, None],
                                                    "gtau": 35.0, **more})

    recorded = emps.read(tmp_path)

    assert len(recorded.runs) == 2 * 4
    np.testing.assert_array_equal(recorded.runs.signals["position"][4], position[1, 10:424:2])
    second = recorded.runs.commands["force"].value[4]
    np.testing.assert_allclose(second, 35 * voltage[1, 10:425] + pulses[10:425])
