from service.warming import warm
from slipstick.table import interpolation
from slipstick.uncertainty.likelihood import lattice, lines


def test_what_a_likelihood_needs_is_compiled_ahead() -> None:
    warm()
    for function in (interpolation._interpolate, lattice._add, lines._sum_pieces):
        assert function.signatures
