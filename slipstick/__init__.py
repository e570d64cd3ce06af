"""Find where a wet-clutch simulation and a test bench disagree.

The core library: numpy, scipy, numba, chaospy and h5py; no HTTP, no jobs, no environment variables.
docs/architecture.md shows the packages and the direction of the imports.
"""

__all__ = ["acquisition", "bench", "black_box", "blocks", "calibration", "clutch", "confirmation", "errors",
           "inference", "naming", "numerics", "pictures", "plausibility", "recordings", "report", "storage", "studies",
           "table", "uncertainty"]
__version__ = "0.1.0"
