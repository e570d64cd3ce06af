"""The public face: functions that join the packages of the science to one call each, and results that show themselves.

`import slipstick` gives their names (docs/python.md). Service and worker call the same functions.
"""

__all__ = ["build", "calibrate", "files", "fit", "frames", "likelihood", "models", "picture", "progress", "propagate",
           "rehearsal", "result", "results", "simulate", "study", "surrogate", "tables"]
