"""The simulator: parameters and conditions in, shifting times and signals out (eqs. 1-4 of Tod et al.).

`Model` and `Conditions` are what is simulated, `ensemble` simulates many engagements at once in compiled code, and
`reference` is its readable twin on scipy.
"""

__all__ = ["conditions", "effects", "ensemble", "model", "parameters", "reference"]
