"""Parametric uncertainty (section III): uncertain inputs, polynomial chaos, likelihood, and fits.

This package knows one protocol, `model(points, conditions) -> shifting times`: a table, a surrogate and the simulator
all satisfy it.
"""

from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.outside import axis_mass_outside, count_outside, mass_outside
from slipstick.uncertainty.sampling import log10_mean_density, standard_normals

__all__ = ["Inputs", "axis_mass_outside", "chaos", "count_outside", "fit", "likelihood", "log10_mean_density",
           "mass_outside", "standard_normals"]
