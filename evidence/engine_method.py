"""The engine as a method: the clutch's valve, load, lock and input shaft, declared, without its closing piston."""

from pathlib import Path

from evidence.answer import Answer, NamedPair, Pair
from slipstick.bench import Bench
from slipstick.clutch.declared import declare, runs_of, values_of
from slipstick.engine.recordings import prepare
from slipstick.engine.selection import Log, identify
from slipstick.naming.scene import Scene
from slipstick.naming.settings import NamingSettings
from slipstick.recordings import Recordings

BLOCKS = "valve", "load", "lock", "input"
"""The blocks that the engine answers for."""


def answer_by_engine(case: str, bench_file: Path, recordings_file: Path, log: Log = lambda _: None) -> Answer:
    """Name what is missing in the ported blocks."""
    bench, recordings = Bench.open(bench_file), Recordings.open(recordings_file)
    scene = Scene.of(bench, recordings, NamingSettings())
    runs = runs_of(bench, recordings, scene.slipping, scene.locked)
    answer = identify(prepare(declare(bench), runs, values_of(bench)), log=log)
    findings = tuple(NamedPair(translate(finding.pair), tuple(translate(rival) for rival in finding.rivals),
                               nats=round(finding.nats, 1)) for finding in answer.findings)
    return Answer(case, findings, answer.unexplained, set_aside=answer.set_aside, seconds=answer.seconds)


def translate(pair: Pair) -> Pair:
    """Return a pair of the engine in the words of the cases."""
    quantity, on = pair
    return (quantity, "twist") if quantity == "stick torque" else pair
