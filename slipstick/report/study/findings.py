"""A finding in words and numbers: evidence, rivals, confidence, coefficients, worth, formula, further experiments."""

import math

from slipstick.pictures.study.evidence import CERTAIN
from slipstick.pictures.study.law import headline, remarks
from slipstick.pictures.study.words import effect_title, name_candidate, within
from slipstick.pictures.theme import in_words
from slipstick.pictures.units import number, signed
from slipstick.report.study.parts import Entries, Items, Note, Part, Section, Table
from slipstick.report.study.todo import write_equation
from slipstick.report.study.words import coefficient_row, many
from slipstick.report.words import listed
from slipstick.studies.formula import describe_quantity, effect_of
from slipstick.studies.result import Candidate, FindingResult, FurtherExperiment, StudyResult
from slipstick.studies.settings import StudySettings
from slipstick.studies.words import title

_UNLISTED = "the catalogue has no effect of this quantity and dependence whose law has this shape"
_EXPERIMENTS = ("current profile", "motor speed [rad/s]", "load inertia [kg m²]", "brake torque [N m]", "recorded",
                "apart [s.d.]", "largest in", "runs")
_APART = ("Apart: distance of both predictions in standard deviations, beyond what the scatter of the parameters can "
          "hide. Runs: expected number until the right one leads by five standard errors. Levels extend up to a fifth "
          "beyond the recorded range.")
_NOTHING = 0.05
"""Change in ms, or in standard deviations of the noise, below which no number is given."""


def sections(result: StudyResult, settings: StudySettings) -> list[Section]:
    """A section for each finding."""
    several = len(result.findings) > 1
    return [Section(f"Finding {place}: {within(finding.title)}" if several else f"Finding: {within(finding.title)}",
                    _parts(finding, result, settings)) for place, finding in enumerate(result.findings, 1)]


def _parts(finding: FindingResult, result: StudyResult, settings: StudySettings) -> list[Part]:
    level, least = settings.level, settings.naming.errors
    parts: list[Part] = [Items([*_describe_law(finding, level), *_evidence(finding, result, least),
                                *_describe_confirmation(finding), *_worth(finding)])]
    if finding.confirmation.coefficients:
        effect = effect_of(finding.effect)
        rows = [coefficient_row(coefficient, effect) for coefficient in finding.confirmation.coefficients]
        parts.append(Table(("coefficient", "estimate", f"{100 * level:.0f} % interval", "meaning"), rows, words=(3,)))
        written = write_equation(finding, result)
        parts += [] if written is None else [f"Equation: {written}."]
        parts.append(Note("The coefficients are fitted to all signals of the whole simulation at once. The intervals "
                          "are conditional on the form of the law."))
    return [*parts, *_list_experiments(finding)]


def _describe_law(finding: FindingResult, level: float) -> Entries:
    form, effect = title((finding.quantity, finding.depends_on), None), effect_of(finding.effect)
    name = _UNLISTED if finding.effect is None else "the catalogue has it" if finding.title == form else \
        f"the catalogue has it as “{within(finding.title)}”"
    entries = [("What:", f"{within(form)}; {name}.")]
    if finding.law is not None:
        law = f"{headline(finding, finding.law)}. {remarks(finding.law, level, is_drawn=False)}"
        entries.append(("Measured law:", " ".join(law.split())))
    if effect is not None:
        entries += [("Formula:", f"the {describe_quantity(effect)} is {effect.law}."), ("Source:", f"{effect.source}."),
                    ("Signature on a bench:", f"{effect.signature}.")]
    return entries


def _evidence(finding: FindingResult, result: StudyResult, least: float) -> Entries:
    blocks = [f"“{block.signals}”" for block in result.blocks if block.name in finding.blocks]
    errors = f"more than {CERTAIN:.0f}" if finding.errors > CERTAIN else number(finding.errors)
    tens, where = number(finding.nats / math.log(10)), "the block" if len(blocks) == 1 else "the blocks"
    entries = [("Evidence:", f"the log-likelihood of {many(result.experiments, 'engagement')} rises by "
                f"{finding.nats:.0f} nats ({tens} factors of ten) in {where} {listed(blocks or ['?'])}; the "
                f"law is shown at {errors} standard errors over engagements."
                + (" Few engagements show it: it is named because it explains nearly all that is missing there."
                   if finding.errors < least else ""))]
    rivals = [_describe_rival(other) for other in finding.rivals]
    second = f" The next best is {_describe_rival(finding.next_best)}." if finding.next_best else ""
    entries.append(("Rivals:", f"{listed(rivals)}. The recordings do not tell these apart from it." if rivals else
                    f"no other pair of quantity and dependence is close.{second}"))
    # Effects of the same pair are no rival pairs; the experiments that tell them apart name them.
    same = [within(effect_title(name)) for name in dict.fromkeys(other.rival for other in finding.experiments)
            if name not in [other.effect for other in finding.rivals]]
    if same:
        entries.append(("Same quantity and dependence:", f"{listed(same)} would have a law of such a shape as well."))
    return [*entries, *_confidence(finding)]


def _describe_rival(other: Candidate) -> str:
    return (f"{name_candidate(other)} ({other.nats:.0f} nats, "
            f"{tell_distance(other.behind)})")


def tell_distance(behind: float) -> str:
    """Return by how many standard errors a rival is behind a finding, or ahead of it where the number is negative."""
    size = f"more than {CERTAIN:.0f}" if abs(behind) > CERTAIN else number(abs(behind), 2)
    return f"{'ahead' if behind < 0 else 'behind'} by {size} standard errors"


def _confidence(finding: FindingResult) -> Entries:
    """The confidence, and how often findings with such a one were right."""
    if finding.confidence is None or finding.counted is None:
        return []
    counted = finding.counted
    return [("Confidence:", f"{finding.confidence:.2f}. {counted.right} of {counted.of} findings with a confidence of "
             f"{counted.lower:g} to {counted.upper:g} were right, on simulated benches with hidden effects. It follows "
             "from the lead over the next best explanation, the share of all gains, what else was found, and how usual "
             "such a pair is, and is an average over these benches: yours may differ.")]


def _describe_confirmation(finding: FindingResult) -> Entries:
    how = {"formula": "the formula of the catalogue", "measured law": "the measured law", "no": ""}
    if finding.effect and finding.confirmation.simulated == "measured law":
        how["measured law"] += ", which describes the recordings better than the formula of the catalogue"
    if finding.confirmation.simulated == "not computed":
        return [("Simulation:", "not fitted, because the time budget ended before; the only evidence for the finding "
                 "is that of the blocks.")]
    if finding.confirmation.simulated == "no":
        return [("Simulation:", "it has no such quantity or dependence; the only evidence for the finding is that "
                 "of the blocks.")]
    verdict = "supports the finding" if finding.confirmation.agrees else \
        "does not support the finding, so that its coefficients and its size are not given"
    return [("Simulation:",
             f"the simulation of the whole bench, with {how[finding.confirmation.simulated]}, {verdict}.")]


def _worth(finding: FindingResult) -> Entries:
    if finding.worth is None:
        return []
    ordered = sorted(finding.worth.signals.items(), key=lambda entry: -entry[1])
    large = [f"{number(value, 2)} in the {in_words(name)}" for name, value in ordered if value >= _NOTHING]
    small = [f"the {in_words(name)}" for name, value in ordered if value < _NOTHING]
    time, smaller = "does not change the shifting time", ""
    if abs(finding.worth.largest) >= _NOTHING:
        time = (f"changes the shifting time by {number(finding.worth.shifting_time)} ms (root mean square), at most by "
                f"{signed(finding.worth.largest)} ms")
        smaller = "The gap is smaller, because parameters that are fitted without the effect take a part of it. "
    signals = f"the change is {listed(large)}" if large else "all changes are below a tenth"
    rest = f"; {listed(small)} hardly change{'s' * (len(small) == 1)}" if large and small else ""
    return [("Size of the effect:", f"under the recorded conditions it {time}, with all other parameters as they are. "
             f"{smaller}In the signals, in standard deviations of their noise, {signals}{rest}.")]


def _list_experiments(finding: FindingResult) -> list[Part]:
    """Tables of the experiments that would resolve a tie, one for each rival."""
    parts: list[Part] = []
    for rival in dict.fromkeys(experiment.rival for experiment in finding.experiments):
        experiments = [experiment for experiment in finding.experiments if experiment.rival == rival]
        text = f"{within(finding.title)} from {within(effect_title(rival))}"
        hopeless = all(experiment.repetitions is None for experiment in experiments)
        parts += [f"No experiment near the recorded conditions would tell {text}. The best ones are:" if hopeless else
                  f"To tell {text}, run:", Table(_EXPERIMENTS, [_row(experiment) for experiment in experiments])]
    return [*parts, Note(_APART)] if parts else []


def _row(experiment: FurtherExperiment) -> tuple[str, ...]:
    return (str(experiment.current_profile), f"{experiment.motor_speed:.4g}", f"{experiment.load_inertia:.4g}",
            f"{experiment.brake_torque:.4g}", "yes" if experiment.recorded else "no", number(experiment.apart, 2),
            in_words(experiment.signal),
            "more than 1000" if experiment.repetitions is None else str(experiment.repetitions))
