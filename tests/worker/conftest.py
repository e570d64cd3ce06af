import pytest

from slipstick.bench.conditions import paper_conditions


@pytest.fixture(scope="session")
def six_conditions():
    """Six of the paper's conditions, one for each current profile."""
    return paper_conditions().take([0, 41, 82, 123, 164, 205])
