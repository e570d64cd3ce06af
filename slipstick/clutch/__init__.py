"""The simulator of the clutch (eqs. 1-4 of Tod et al.): shifting times and signals from parameters and conditions.

`Model` and `Conditions` define a simulation, `ensemble` simulates many engagements at once in compiled code, and
`reference` is the readable reference implementation on SciPy.
"""

__all__ = ["conditions", "effects", "ensemble", "model", "parameters", "reference"]
