"""The methods that answer cases: functions from the files of a case to an answer.

A new method, such as another version of the study, is one more entry of `METHODS`.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

from numba import set_num_threads

from evidence.answer import Answer, LawOfPair, NamedPair
from evidence.engine_method import answer_by_engine, read_machine, translate
from evidence.peers.residuals import answer_by_residuals
from evidence.peers.sindy import answer_by_sindy
from slipstick.bench import Bench
from slipstick.clutch.effects import CATALOGUE, find
from slipstick.engine.preparation import prepare
from slipstick.engine.recordings import Recorded
from slipstick.naming.answer import answer
from slipstick.naming.measured import LawPoints
from slipstick.naming.record import from_json
from slipstick.naming.selection import Finding
from slipstick.naming.study import Naming
from slipstick.recordings import Recordings
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.studies import StudySettings, conclude, examine
from slipstick.studies.confidence import are_reported, confidence, evidence_of


def answer_by_naming(case: str, bench_file: Path, recordings_file: Path) -> Answer:
    """Name what is missing, block by block; without a signal, the simulation of the whole bench answers as well."""
    set_num_threads(1)
    bench, recordings, settings = Bench.open(bench_file), Recordings.open(recordings_file), StudySettings()
    record = json.loads(json.dumps(examine(settings, bench, recordings)))
    named = from_json(record)
    evidence = [evidence_of(finding, named.findings) for finding in named.findings]
    reported = are_reported(evidence, [finding.nats for finding in named.findings])
    findings = tuple(_name(finding, named, confidence(each), is_reported)
                     for finding, each, is_reported in zip(named.findings, evidence, reported, strict=True))
    unexplained, explanations = named.lacking, ()
    if recordings.signals is None or set(SIGNAL_UNITS) - set(recordings.signals.names):
        result, _ = conclude(settings, bench, recordings, record)
        explanations = tuple(find(each.effect).pairs[0] for each in result.explanations)
        if result.kind == "unlisted" and not (findings or unexplained):
            unexplained = ("simulation",)
    laws = tuple(_law(law) for law in named.measured.values() if law.x is not None)
    return Answer(case, findings, tuple(unexplained), explanations, named.set_aside, laws, seconds=named.seconds)


def _name(finding: Finding, named: Naming, sure: float, is_reported: bool) -> NamedPair:
    law = named.measured.get(finding.pair)
    effect = answer(finding, law).effect
    others = {each.name for each in CATALOGUE} - {effect}
    return NamedPair(finding.pair, tuple(rival.pair for rival in finding.rivals), effect,
                     answer(finding, law, others).effect, round(finding.nats, 1), round(sure, 3), is_reported)


def _law(law: LawPoints) -> LawOfPair:
    assert law.x is not None
    x, change, std = ([float(f"{value:.6g}") for value in values] for values in (law.x, law.change, law.std))
    return LawOfPair(law.pair, x, change, std, law.relative, law.up_to)


def _answer_by_peer(answer_by: Callable[[str, Recorded], Answer], case: str, described: Path, recorded: Path) -> Answer:
    """Answer another machine than the clutch by a peer of the engine, in the words of the cases."""
    said = answer_by(case, prepare(*read_machine(described, recorded)))
    findings = tuple(replace(each, pair=translate(each.pair), rivals=tuple(map(translate, each.rivals)))
                     for each in said.findings)
    return replace(said, findings=findings, laws=tuple(replace(law, pair=translate(law.pair)) for law in said.laws))


METHODS: dict[str, Callable[[str, Path, Path], Answer]] = {
    "naming": answer_by_naming, "engine": answer_by_engine,
    "residuals": partial(_answer_by_peer, answer_by_residuals), "sindy": partial(_answer_by_peer, answer_by_sindy)}
"""Name of each method, and the function that answers; the last two answer other machines than the clutch."""
