import numpy as np
import pytest

from slipstick.study.design import Design
from slipstick.study.linearised import Linearised
from slipstick.study.marginal import State
from slipstick.study.mixed import MixedFit
from tests.benches import HEAVY

N, VALUES = 60, 12
PARAMETERS = ("pressure_bias", "initial_position", "friction_coefficient")


@pytest.fixture
def linear_fit() -> MixedFit:
    """A fit of an invented linear model to 60 experiments of 12 values; two of three parameters scatter."""
    rng = np.random.default_rng(5)
    jacobian = rng.standard_normal((N, VALUES, 3)) * (1.0, 2.0, 3.0)
    modes = 0.05 * rng.standard_normal((N, 2))
    residual = 0.1 * rng.standard_normal((N, VALUES))
    rows = np.concatenate([jacobian, residual[..., None]], axis=2)
    about = Linearised((rows.transpose(0, 2, 1) @ rows)[None], residual)
    state = State(np.ones(3), modes, np.diag([0.0025, 0.0025]), np.ones(1))
    return MixedFit(Design(HEAVY, PARAMETERS, (0, 1)), state, about, np.zeros(N), 1, True)
