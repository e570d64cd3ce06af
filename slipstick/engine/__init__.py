"""Which laws the recordings of any declared machine ask for: laws, mixed model, evidence and selection.

Nothing is imported here: whoever needs the linear mixed model alone does not load the rest.
"""

__all__ = ["recordings", "selection", "settings", "simulation", "study"]
