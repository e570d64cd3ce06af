"""Parametric uncertainty (section III): uncertain inputs, polynomial chaos, likelihood, and fits.

The package depends on one protocol only, `model(points, conditions) -> shifting times`, which tables, surrogates and
the simulator implement.
"""

from slipstick.uncertainty.inputs import Inputs
from slipstick.uncertainty.outside import axis_mass_outside, mass_outside
from slipstick.uncertainty.sampling import log10_mean_density, standard_normals

__all__ = ["Inputs", "axis_mass_outside", "chaos", "fit", "likelihood", "log10_mean_density",
           "mass_outside", "standard_normals"]
