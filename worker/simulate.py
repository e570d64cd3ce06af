"""`simulate`: recordings of a simulated bench, with sensor noise and scatter, and with effects that may be there."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from slipstick.errors import BadRecording, InvalidValue
from slipstick.interface.simulate import NOISE, SCATTER, simulate
from slipstick.machine import Machine, Runs, holds_runs
from slipstick.recordings import Recordings
from slipstick.recordings.simulated import SIMULATED

from .bench_option import add_bench_or_machine_argument, add_simulated_arguments, open_simulated, refuse_bench_options
from .program import command_line


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_bench_or_machine_argument(parser)
    add_simulated_arguments(parser)
    parser.add_argument("--runs", type=int, metavar="N", help="number of runs of a machine, each experiment that it "
                        "declares in turn (default: all of them once)")
    parser.add_argument("--effect", action="append", default=[], metavar="NAME[=MULTIPLE]",
                        help="an effect of the catalogue to add, at its typical coefficients or a multiple of its "
                             "typical amplitudes; repeat the option for several")
    parser.add_argument("--engagements", type=int, metavar="N",
                        help="number of engagements, evenly over the conditions, or each more than once "
                             "(default: each condition once)")
    parser.add_argument("--scatter", type=float, default=SCATTER, metavar="SHARE",
                        help="standard deviation from run to run of uncertain parameters for which the bench states "
                             "none, as a share of their nominal values (default: %(default)s)")
    parser.add_argument("--noise", type=float, default=NOISE, metavar="MULTIPLE",
                        help="noise as a multiple of that of the sensors of the bench (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="seed of all random numbers (default: 0)")
    parser.add_argument("--out", type=Path, default=Path("tables/simulated.h5"), metavar="FILE.h5",
                        help="the recordings to write (default: %(default)s)")


def run(arguments: argparse.Namespace) -> int:
    """Simulate, write the recordings, and say how to study them."""
    _require_output(arguments.out)
    if arguments.machine is not None:
        return _simulate_machine(arguments)
    if arguments.runs is not None:
        raise InvalidValue("--runs is about a declared machine, not about a bench", "Give --engagements")
    bench, model, conditions = open_simulated(arguments)
    recordings = simulate(bench, _effects(arguments.effect), model=model, conditions=conditions,
                          engagements=arguments.engagements, scatter=arguments.scatter, noise=arguments.noise,
                          seed=arguments.seed)
    recordings.save(arguments.out)
    times = recordings.measured_time
    print(f"Wrote {arguments.out}: {len(times)} engagements with shifting times of {times.min():.3f} to "
          f"{times.max():.3f} s\nStudy them: {command_line('study', arguments.out, '--bench', arguments.bench)}")
    return 0


def _simulate_machine(arguments: argparse.Namespace) -> int:
    """Simulate the experiments that a machine declares."""
    refuse_bench_options(arguments, effect=[], model=None, conditions=None, engagements=None, scatter=SCATTER,
                         noise=NOISE)
    machine = Machine.open(arguments.machine)
    runs = simulate(machine, runs=arguments.runs, seed=arguments.seed)
    runs.save(arguments.out)
    print(f"Wrote {arguments.out}: {len(runs)} runs of the machine “{machine.name}” of {machine.duration:g} s\n"
          f"Study them: {command_line('study', arguments.out, '--machine', arguments.machine)}")
    return 0


def _effects(texts: Sequence[str]) -> dict[str, float]:
    """Effect -> multiple of its typical amplitudes, from texts NAME[=MULTIPLE]; raises `InvalidValue`."""
    multiples = {}
    for text in texts:
        name, _, multiple = text.partition("=")
        try:
            multiples[name] = float(multiple or 1)
        except ValueError as error:
            raise InvalidValue(f"'{text}' is no effect", f"Write {name}, or {name}=MULTIPLE with a number") from error
    return multiples


def _require_output(path: Path) -> None:
    """Raise `InvalidValue` where the file would replace something else than simulated recordings."""
    if path.suffix != ".h5" or path.is_dir():
        raise InvalidValue(f"'{path}' is not the name of a .h5 file", "Give --out a path that ends in .h5")
    if path.exists() and not _is_simulated(path):
        raise InvalidValue(f"'{path}' exists and has no simulated recordings", "Give another --out, or remove the file")


def _is_simulated(path: Path) -> bool:
    try:
        if holds_runs(path):
            return Runs.open(path).description.startswith(SIMULATED)
        return Recordings.open(path).description.startswith(SIMULATED)
    except BadRecording:
        return False
