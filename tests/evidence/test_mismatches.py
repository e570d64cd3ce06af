"""No drawn case is taken for recordings of another bench, whatever is hidden in it and whichever runs are bad.

All 248 cases from seed 101 on pass as well. Their ratios of recorded to simulated levels are 0.64 to 1.46 for the
shifting time, 0.78 to 1.23 for signals, 0.85 to 1.55 for the load, and 0.95 to 1.06 for the gear ratio; the limits are
0.32 to 3.2, and 0.7 to 1.43 for the gear ratio.
"""

from pathlib import Path

import pytest

from evidence.runner import write_case
from evidence.suites import SUITES
from slipstick.bench import Bench
from slipstick.plausibility.mismatch import mismatches
from slipstick.recordings import Recordings

pytestmark = pytest.mark.slow  # what draws the cases of the evidence is no part of the product


def require_none(suite: str, seed: int, folder: Path) -> None:
    files = write_case(suite, seed, folder)
    assert mismatches(Recordings.open(files.recordings), Bench.open(files.bench)) == (), files.truth.case


@pytest.mark.parametrize(("suite", "seed"), [
    ("nothing_missing", 102), ("wrong_parameter", 103), ("missing_signals", 103),
    ("faulty_recordings", 103)])
def test_no_case_without_an_effect_is_refused(suite: str, seed: int, tmp_path: Path) -> None:
    require_none(suite, seed, tmp_path)


@pytest.mark.parametrize("suite", SUITES)
def test_no_case_is_refused(suite: str, tmp_path: Path) -> None:
    """Of these seeds, one has a speed sensor that lags by seconds."""
    require_none(suite, 104, tmp_path)
