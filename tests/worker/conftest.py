import pytest

from slipstick.bench.conditions import paper_conditions


@pytest.fixture(scope="session")
def few():
    """Six of the paper's conditions, one of each current profile."""
    return paper_conditions().take([0, 41, 82, 123, 164, 205])
