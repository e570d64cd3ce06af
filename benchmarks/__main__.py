"""`make bench`: this project beside its peers, in one run; writes benchmarks/peers.csv."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # one core for every code; before numpy is imported
os.environ.pop("OPENBLAS_CORETYPE", None)  # would keep numpy from instructions of this machine
os.environ.pop("OPENBLAS_L2_SIZE", None)

from importlib.metadata import version
from importlib.util import find_spec

from benchmarks import scalar_cpp
from benchmarks.peers import HEADER, measure
from benchmarks.results import write
from benchmarks.works import works

ROUNDS = 9
PACKAGES = ("numpy", "scipy", "numba", "chaospy", "openturns", "jax", "diffrax")


def main() -> None:
    """Run the benchmark and write the table."""
    rows = [row for work in works() for row in measure(work, ROUNDS)]
    versions = [f"{package} {version(package)}" for package in PACKAGES if find_spec(package)]
    if not scalar_cpp.missing():
        versions.append(scalar_cpp.compiler())
    rows.append([f"{ROUNDS} rounds, one core; {', '.join(versions)}", *[""] * (len(HEADER) - 1)])
    write("peers", HEADER, rows, "make bench")


if __name__ == "__main__":
    main()
