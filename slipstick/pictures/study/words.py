"""Names of models and findings in pictures and reports."""

from slipstick.clutch import effects
from slipstick.pictures import theme
from slipstick.studies.finding import Candidate, Changed, FindingResult, Remainder
from slipstick.studies.result import StudyResult

_X = {"gain": "reading", "run order": "position in the run order"}
_X_OF_CLUTCH = {"slip": "slip of the plates", "time": "time since the shift command",
                "heat": "friction heat of the engagement", "direction": "piston rate without the law"}


def within(title: str) -> str:
    """A title for use within a sentence."""
    return title[:1].lower() + title[1:]


def effect_title(name: str) -> str:
    """The title of an effect; its name if the catalogue does not have it any more."""
    return next((effect.title for effect in effects.CATALOGUE if effect.name == name), theme.in_words(name))


def name_candidate(candidate: Candidate) -> str:
    """What may be missing in words, for use within a sentence: an effect, a pair, or a value that is another one."""
    if candidate.effect:
        return within(effect_title(candidate.effect))
    if candidate.is_value:
        return f"another value of the {candidate.quantity}"
    return f"{candidate.quantity} over {candidate.depends_on}"


def subject(finding: Changed) -> str:
    """What changes: the quantity, or the error of a sensor."""
    return f"error of the {finding.quantity}" if finding.quantity.endswith("sensor") else finding.quantity


def changed(finding: Changed) -> str:
    """The change as the title of an axis: an error is a change by itself."""
    name = subject(finding)
    return name if name.startswith("error") else f"change of the {name}"


def argument(finding: Changed) -> str:
    """What the change is measured over."""
    words = _X | _X_OF_CLUTCH if isinstance(finding, FindingResult | Candidate | Remainder) else _X
    return words.get(finding.depends_on, finding.depends_on)


def model_series(result: StudyResult) -> dict[str, tuple[str, str]]:
    """`before` and, if the simulation asks for a finding, `after` -> label and colour of that model."""
    if result.gap is None:
        return {"before": ("model of the bench", theme.AFTER)}
    added = [finding for finding in result.findings if finding.confirmation.agrees]
    label = f"{len(added)} findings" if len(added) != 1 else within(added[0].title)
    if len(added) == 1 and added[0].confirmation.simulated == "measured law":
        label = "the measured law"
    return {"before": (f"best fit without {'it' if len(added) == 1 else 'them'}", theme.BEFORE),
            "after": (f"with {label}", theme.AFTER)}


def numbers(result: StudyResult) -> list[int]:
    """Numbers in the recordings, from 0, of the engagements that count."""
    return [place for place in range(result.experiments + len(result.set_aside)) if place not in result.set_aside]
