"""What is imported, and machine code that is loaded or compiled, on first use, before the first request needs it."""

import gc

import numpy as np

from slipstick.table.axis import Axis
from slipstick.table.interpolation import interpolate
from slipstick.uncertainty import Inputs, standard_normals
from slipstick.uncertainty.chaos import ExpansionSettings, Output, expand, make_basis
from slipstick.uncertainty.likelihood import Candidate, InferenceProblem, converged


def warm() -> None:
    """Compute one small likelihood and propagation with the methods that the default table uses.

    Likelihoods are computed on a lattice, and along lines.
    """
    axes = tuple(Axis(name, np.linspace(0.5, 1.5, 3), 1.0, "1") for name in ("a", "b"))
    times = np.linspace(0.4, 0.6, 18).reshape(3, 3, 2)

    def model(points: np.ndarray, conditions: object) -> np.ndarray:
        return interpolate(axes, times, points, "clip")

    problem = InferenceProblem(model, None, np.full(2, 0.5), np.full(2, 0.5), np.full(2, 1.5), ("a", "b"),
                               tuple(axis.values for axis in axes))
    inputs = Inputs(np.ones(2), np.full(2, 0.1))
    for lattices in (True, False):
        converged(problem, Candidate(inputs, 0.05), lattices=lattices)
    basis = make_basis(inputs.germs, ExpansionSettings())
    Output(expand(basis, model(inputs.at_germs(basis.nodes), None)), 0.05, 64, 1).density(times[:, 0])
    standard_normals(2, 64, 1)
    gc.freeze()  # the libraries stay as well, like what was imported at the start
