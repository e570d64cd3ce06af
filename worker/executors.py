"""What runs simulations: threads or processes of this machine, or with `--dask ADDRESS` the workers of Dask."""

import argparse
import os
from collections.abc import Iterator
from concurrent.futures import CancelledError
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager

from slipstick.black_box import BlackBox, Function
from slipstick.black_box.simulation import killed
from slipstick.errors import InvalidValue

from .cluster import Cluster, ClusterLost


def add_dask_argument(parser: argparse.ArgumentParser, computed: str = "simulate") -> None:
    """Add the option; `computed` is a verb with what is done there."""
    parser.add_argument("--dask", default=os.environ.get("SLIPSTICK_DASK") or None, metavar="ADDRESS",
                        help=f"{computed} on the workers of the Dask scheduler at this address, such as "
                             "tcp://10.0.0.1:8786, with the same result (default: on this machine; environment "
                             "variable SLIPSTICK_DASK; docs/operations.md)")


def refuse_dask(arguments: argparse.Namespace) -> None:
    """Raise `InvalidValue` for the option beside a bench; the environment variable may be meant for other commands."""
    if arguments.dask not in (None, os.environ.get("SLIPSTICK_DASK")):
        raise InvalidValue("--dask is about many runs of a declared machine, not about a bench", "Leave it out")


@contextmanager
def cluster_at(dask: str | None, file: BlackBox | None = None) -> Iterator[Cluster | None]:
    """The cluster at the address `dask`, None without one; raises `InvalidValue`, also where it is lost in the block.

    `file` is the machine that is simulated, if it is not a clutch.
    """
    with explained():
        if dask is None:
            yield None
            return
        with Cluster(dask, needs_main_thread=file is not None and isinstance(file.simulator, Function)) as cluster:
            yield cluster


@contextmanager
def explained() -> Iterator[None]:
    """Raise `InvalidValue` in the block where the processes of an executor are gone."""
    try:
        yield
    except BrokenProcessPool as error:
        raise killed() from error
    except (CancelledError, ClusterLost) as error:
        raise InvalidValue("The Dask scheduler has ended, or several of its workers died in the same simulation",
                           "Look at their logs, for lack of memory for example, and start them again; the same "
                           "command resumes a build") from error
