"""The simulator of the clutch (eqs. 1-4 of Tod et al.): shifting times and signals from parameters and conditions.

`Model` and the `Conditions` of a bench define a simulation, `ensemble` simulates many engagements at once in compiled
code, and `reference` is the readable reference implementation on SciPy.
"""

__all__ = ["effects", "ensemble", "model", "reference"]
