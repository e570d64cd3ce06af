from pathlib import Path

import pytest

from slipstick.recordings import Recordings

SHIPPED = Path(__file__).parents[3] / "tables" / "measured.h5"


@pytest.fixture(scope="session")
def shipped():
    return Recordings.open(SHIPPED)


@pytest.fixture(scope="session")
def shipped_file():
    return SHIPPED
