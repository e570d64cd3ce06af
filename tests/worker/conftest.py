import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from distribution import end_with_group
from job_processes import Bench

from tests.benches import HEAVY


@pytest.fixture(scope="session")
def shared_bench(shelf: Path, few_recordings: Path, tmp_path_factory: pytest.TempPathFactory,
                 launch: Callable[..., subprocess.Popen[bytes]]) -> Iterator[Bench]:
    """One bench for the files of its group, whose worker has the DC motor: service and worker take seconds to start."""
    bench = Bench(shelf, few_recordings / "few.h5", tmp_path_factory.mktemp("bench"), launch,
                  options=("--machine", "dc_motor"))
    end_with_group("a bench with a worker", bench.end)
    yield bench
    bench.end()


@pytest.fixture(scope="session")
def six_conditions():
    """Six of the paper's conditions, one for each current profile."""
    return HEAVY.conditions.take([0, 41, 82, 123, 164, 205])
