"""All checks of a bench."""

from dataclasses import dataclass

from slipstick.bench import Bench
from slipstick.plausibility.behaviour import Behaviour, behaviour
from slipstick.plausibility.engagements import engagement_findings
from slipstick.plausibility.finding import Finding, mask_explained
from slipstick.plausibility.hydraulics import hydraulic_findings, jump_findings
from slipstick.plausibility.physics import SteadyStates
from slipstick.plausibility.sensing import sensing_findings
from slipstick.plausibility.torques import brake_findings, capacity_findings, converter_findings, loss_findings


@dataclass(frozen=True, eq=False)
class Inspection:
    """The behaviour of a bench at its nominal parameters, and the findings about it: causes before consequences."""

    bench: Bench
    behaviour: Behaviour
    findings: tuple[Finding, ...]


def inspect(bench: Bench) -> Inspection:
    """Simulate the bench and check its numbers against each other by the model's equations."""
    steady, simulated = SteadyStates(bench), behaviour(bench)
    findings = [*hydraulic_findings(steady), *loss_findings(steady)]
    # Each check leaves out the conditions that an earlier one explains, so that a consequence is no finding.
    for check in (converter_findings, brake_findings, capacity_findings, jump_findings):
        findings += check(steady, mask_explained(findings, len(bench.conditions)))
    for look in (engagement_findings, sensing_findings):
        findings += look(steady, simulated, mask_explained(findings, len(bench.conditions)))
    return Inspection(bench, simulated, tuple(findings))
