"""A compiled code for comparison: scalar_dopri.cpp, compiled by g++ and called through ctypes.

The compiler may reorder sums and multiply by reciprocals, which makes the code 15 % faster. `-ffast-math` has the same
effect, but would also switch off denormal numbers for the other codes in the process.
"""

import ctypes
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.benches import HEAVY

COMPILER = "g++"
FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-fno-signed-zeros", "-fassociative-math",
         "-freciprocal-math")
SOURCE = Path(__file__).with_name("scalar_dopri.cpp")
_CURVES = HEAVY.physics.curves


def missing() -> str | None:
    """Why this code cannot run here, or None."""
    return None if shutil.which(COMPILER) else f"no {COMPILER}"


def compiler() -> str:
    """The first line of what the compiler says of its version."""
    return subprocess.run([COMPILER, "--version"], check=True, capture_output=True, text=True).stdout.splitlines()[0]


def shifting_times(vectors, profile, profile_time, profile_current, speed, inertia, brake, initial, rtol):
    """As `scalar_dopri.shifting_times`."""
    out = np.empty((len(vectors), len(speed)))
    arrays = [np.ascontiguousarray(array, kind) for array, kind in (
        (vectors, float), (profile, np.int64), *((array, float) for array in (
            profile_time, profile_current, speed, inertia, brake, initial, _CURVES.speed_ratio, _CURVES.torque_ratio,
            _CURVES.capacity_factor)))]
    _library().shifting_times(
        *(ctypes.c_int(size) for size in (*out.shape, vectors.shape[1], profile_time.shape[1])),
        *(ctypes.c_void_p(array.ctypes.data) for array in arrays), ctypes.c_double(rtol),
        ctypes.c_void_p(out.ctypes.data))
    return out


@cache
def _library() -> ctypes.CDLL:
    with tempfile.TemporaryDirectory() as folder:  # a library that is loaded does not need its file
        path = Path(folder) / "scalar_dopri.so"
        subprocess.run([COMPILER, *FLAGS, "-std=c++17", "-shared", "-fPIC", "-o", path, SOURCE], check=True)
        return ctypes.CDLL(str(path))
