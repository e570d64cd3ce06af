"""Find where a wet-clutch simulation and a test bench disagree.

The core library: numpy, scipy, numba, chaospy and h5py; no HTTP, no jobs, no environment variables.
docs/architecture.md shows the packages and the direction of the imports.
"""

__all__ = ["blocks", "calibration", "clutch", "errors", "figure_data", "inference", "matrix_product", "pictures",
           "recordings", "register_tile", "report", "storage", "study", "table", "uncertainty"]
__version__ = "0.1.0"
