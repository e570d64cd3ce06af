"""Uncertainty propagation, likelihoods and fits with tables, surrogates and simulators as the model."""

__all__ = ["figures", "fitting", "inputs", "likelihoods", "problems", "propagation"]
