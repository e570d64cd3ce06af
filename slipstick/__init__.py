"""Find where a wet-clutch simulation and a test bench disagree.

The science of Slipstick: numpy, scipy, numba, chaospy and h5py; no HTTP, no jobs, no environment variables.
"""

__version__ = "0.1.0"
