import pytest

from tests.benches import HEAVY


@pytest.fixture(scope="session")
def six_conditions():
    """Six of the paper's conditions, one for each current profile."""
    return HEAVY.conditions.take([0, 41, 82, 123, 164, 205])
