"""One finding as a result: its measured law, its coefficients in the simulation, its worth and its confidence."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy

from slipstick.confirmation.fit import SimulationFit
from slipstick.confirmation.worth import worth
from slipstick.naming.answer import Answer, answer, names
from slipstick.naming.measured import LawPoints
from slipstick.naming.selection import Finding, Rival
from slipstick.naming.study import Naming
from slipstick.studies.confidence import Evidence, confidence, count_right, evidence_of
from slipstick.studies.formula import formula
from slipstick.studies.result import (
    Candidate,
    Coefficient,
    Confirmation,
    FindingResult,
    FurtherExperiment,
    Law,
    Remainder,
)
from slipstick.studies.settings import StudySettings
from slipstick.studies.words import title

_AT_BOUND = 1e-3
"""Distance from a bound, over the width of the bounds, below which a coefficient is at it."""
_NO_VALUES = np.empty(0)


@dataclass(frozen=True)
class AnsweredFinding:
    """A `finding`, what it is called, and the `evidence` of its confidence."""

    finding: Finding
    said: Answer
    evidence: Evidence


def answer_findings(settings: StudySettings, naming: Naming) -> list[AnsweredFinding]:
    """The findings, but of those that are the same effect, such as air in the oil under two of its pairs, the first."""
    kept, seen = list[AnsweredFinding](), set[str]()
    for finding in naming.findings:
        said = answer(finding, naming.measured.get(finding.pair), settings.catalogue)
        if not said.effect or said.effect not in seen:
            kept.append(AnsweredFinding(finding, said, evidence_of(finding, naming.findings)))
        seen.add(said.effect)
    return kept


def finding_result(settings: StudySettings, answered: AnsweredFinding, law: LawPoints | None, formulas: SimulationFit,
                   after: SimulationFit, experiments: list[FurtherExperiment]) -> FindingResult:
    """A finding with all that was found out about it.

    `formulas` is the fit with the formulas of all named effects, `after` that with measured laws for some of them.
    """
    effect, term = answered.said.effect, _term(answered.said, law, after)
    at, known = _places(after, term), after if effect in after.block.terms.effects else formulas
    return replace(
        unconfirmed_result(settings, answered, law, known.values[_places(known, effect)]),
        confirmation=_confirmation(settings, after, at, term, term == effect),
        worth=worth(after, term) if at else None, experiments=experiments)


def unconfirmed_result(settings: StudySettings, answered: AnsweredFinding, law: LawPoints | None,
                       values: np.ndarray = _NO_VALUES) -> FindingResult:
    """A finding as the blocks have it; `values` (p,) are the coefficients of its effect in the simulation, if known."""
    finding, said = answered.finding, answered.said
    sure, second = confidence(answered.evidence), finding.next_best
    rivals = [_candidate(settings, rival) for rival in finding.rivals]
    # Effects with the same pair have the same gain.
    same = [name for name in names(finding.pair, settings.catalogue) if name in said.others]
    rivals = [*(Candidate(name, *finding.pair, finding.nats, 0.0) for name in same), *rivals]
    drawn = None if law is None else _law(settings, law, said.effect, values)
    return FindingResult(
        said.kind, said.effect or None, title(finding.pair, said.effect or None), *finding.pair, list(finding.blocks),
        finding.nats, finding.errors, rivals, drawn, Confirmation("not computed", [], None), None, sure,
        count_right(sure), [], finding.lead, None if second is None else _candidate(settings, second))


def remainder(answered: AnsweredFinding) -> Remainder:
    """A finding that is more likely a part of the cause of another one."""
    effect, sure, finding = answered.said.effect or None, confidence(answered.evidence), answered.finding
    return Remainder(effect, title(finding.pair, effect), *finding.pair, list(finding.blocks), finding.nats, sure,
                     count_right(sure))


def _candidate(settings: StudySettings, rival: Rival) -> Candidate:
    effect = next(iter(names(rival.pair, settings.catalogue)), None)
    return Candidate(effect, *rival.pair, rival.nats, rival.behind)


def _term(said: Answer, law: LawPoints | None, after: SimulationFit) -> str:
    """The name of what stands for the finding in the simulation."""
    simulated = None if law is None else law.simulated()
    name = "" if simulated is None else f"{simulated.quantity} ~ {simulated.depends_on}"
    return said.effect if said.effect and name not in after.block.terms.names else name


def _places(fit: SimulationFit, term: str) -> list[int]:
    """The places of the coefficients of a term."""
    return [place for place, unknown in enumerate(fit.block.terms.unknowns) if unknown.term == term]


def _law(settings: StudySettings, law: LawPoints, effect: str, values: np.ndarray) -> Law:
    """The law with its band, and the formula of the effect with the coefficients `values` (p,) beside it, if any."""
    error = float(scipy.special.ndtri((1 + settings.level) / 2)) * law.std
    by_formula = formula(effect, values.tolist(), law) if len(values) else None
    return Law(None if law.x is None else law.x.tolist(), law.x_unit, law.change.tolist(),
               (law.change - error).tolist(), (law.change + error).tolist(), law.unit, law.relative, law.up_to,
               law.linearised, None if by_formula is None else by_formula.tolist())


def _confirmation(settings: StudySettings, after: SimulationFit, at: list[int], term: str,
                  is_formula: bool) -> Confirmation:
    """What stands for the finding, with intervals of its coefficients."""
    if not term:
        return Confirmation("no", [], None)
    how: Literal["formula", "measured law"] = "formula" if is_formula else "measured law"
    if not at:
        return Confirmation(how, [], False)
    deviation, coefficients = np.sqrt(np.diag(after.covariance)), []
    wide = float(scipy.special.ndtri((1 + settings.level) / 2))
    for place in at:
        unknown, value, error = after.block.terms.unknowns[place], float(after.values[place]), float(deviation[place])
        bound = min(value - unknown.lower, unknown.upper - value) < _AT_BOUND * unknown.span
        coefficients.append(Coefficient(unknown.name, unknown.unit, value, value - wide * error, value + wide * error,
                                        bound))
    return Confirmation(how, coefficients, True)
