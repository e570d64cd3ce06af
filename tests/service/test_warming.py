import subprocess
import sys

from service.warming import warm
from slipstick.table import interpolation
from slipstick.uncertainty.likelihood import lattice, pieces

SLOW = ("chaospy", "scipy.stats", "scipy.signal", "scipy.optimize", "scipy.ndimage", "scipy.interpolate")
LOADED = f"import sys; print([name for name in {SLOW} if name in sys.modules])"


def test_what_a_likelihood_needs_is_compiled_ahead() -> None:
    warm()
    for function in (interpolation._interpolate, lattice._add, pieces.sum_pieces):
        assert function.signatures


def test_the_start_does_not_wait_for_libraries_that_a_propagation_needs_and_warming_imports_them() -> None:
    code = f"import service.server; {LOADED}; from service.warming import warm; warm(); {LOADED}"
    start, warmed = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True,
                                   check=True).stdout.splitlines()
    assert start == "[]"
    assert "chaospy" in warmed
    assert "scipy.stats" in warmed
