"""The engine as a method: of other machines, and of the clutch as a declared machine."""

import json
from pathlib import Path

from evidence.answer import Answer, LawOfPair, NamedPair, Pair
from slipstick.bench import Bench
from slipstick.clutch.declared import declare, runs_of, values_of
from slipstick.engine.measured_law import Law, measure
from slipstick.engine.settings import EngineSettings
from slipstick.engine.study import identify_runs
from slipstick.machine import Machine, Runs, open_machine, read_runs
from slipstick.naming.scene import Scene
from slipstick.naming.settings import NamingSettings
from slipstick.recordings import Recordings

MACHINES = Path(__file__).parents[1] / "tables" / "machines"
_FLAT = "nothing", "constant", "line"
_WORDS = {("stick torque", "offset"): "twist", ("piston rate", "piston rate"): "direction"}
"""What the cases call a dependence of the declared clutch: friction of the piston adds to its rate by its sign."""


def answer_by_engine(case: str, described: Path, recorded: Path, settings: EngineSettings | None = None) -> Answer:
    """Name what is missing in another machine, or in a clutch."""
    read = read_machine if described.name == "machine.json" else _read_clutch
    answer = identify_runs(*read(described, recorded), settings)
    both = [answer, *([answer.apart] if answer.apart is not None else [])]
    findings = tuple(NamedPair(translate(finding.pair), tuple(translate(rival) for rival in finding.rivals),
                               nats=round(finding.nats, 1)) for each in both for finding in each.findings)
    laws = tuple(_state_law(measure(fit, finding.pair)) for each in both for finding in each.findings
                 for fit in each.fits if finding.pair in fit.laws)
    return Answer(case, findings, answer.unexplained, set_aside=answer.set_aside,
                  laws=tuple(law for law in laws if law is not None), seconds=round(answer.seconds, 1))


def load_machine(name: str) -> Machine:
    """Return a shipped machine, by its name in words."""
    return open_machine(MACHINES / f"{name.replace(' ', '_')}.py")


def read_machine(described: Path, recorded: Path) -> tuple[Machine, Runs, dict[str, float]]:
    """Return another machine, the recordings, and its nominal numbers."""
    content = json.loads(described.read_text())
    return load_machine(content["machine"]), read_runs(recorded), content["values"]


def _read_clutch(described: Path, recorded: Path) -> tuple[Machine, Runs, dict[str, float]]:
    bench, recordings = Bench.open(described), Recordings.open(recorded)
    scene = Scene.of(bench, recordings, NamingSettings())
    runs = runs_of(bench, recordings, scene.slipping, scene.locked)
    return declare(bench), runs, values_of(bench)


def translate(pair: Pair) -> Pair:
    """Return a pair of the engine in the words of the cases."""
    quantity, on = pair
    return quantity, _WORDS.get(pair, "position" if on == "angle" else on)


def _state_law(law: Law) -> LawOfPair | None:
    """Return a law over a variable as points; None of lags and plays."""
    if law.kind in ("lags", "past") or len(law.x) < 2:
        return None
    x, change, std = ([float(f"{value:.6g}") for value in values] for values in (law.x, law.change, law.std))
    return LawOfPair(translate(law.pair), x, change, std, not law.unit, _FLAT[law.known_up_to])
