import numpy as np
import pytest

from slipstick.study.ranking import in_errors


def test_one_experiment_that_goes_badly_wrong_does_not_hide_what_all_others_say() -> None:
    rng = np.random.default_rng(1)
    differences = rng.normal(2.0, 1.0, 54)
    differences[7] = 4000.0
    assert differences.mean() / differences.std(ddof=1) * np.sqrt(54) < 1.1
    assert in_errors(differences) > 5


def test_chance_is_as_sure_as_chance_is() -> None:
    rng = np.random.default_rng(2)
    for heavy in (rng.standard_normal((2000, 54)), rng.standard_t(1, (2000, 54))):
        sure = np.array([in_errors(one) for one in heavy])
        assert sure.std() == pytest.approx(1, abs=0.1)
        assert (sure > 3).mean() < 0.005


def test_the_sign_is_kept_and_nothing_is_nothing() -> None:
    assert in_errors(np.array([-3.0, -2.0, -4.0])) == -in_errors(np.array([3.0, 2.0, 4.0])) < 0
    assert in_errors(np.zeros(12)) == 0.0
