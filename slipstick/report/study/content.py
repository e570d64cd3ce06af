"""The content of the report of a study, the same for the page and for the text."""

from collections.abc import Collection

from slipstick.report.study import findings, simulation, untested
from slipstick.report.study.limits import limits
from slipstick.report.study.parts import Items, Section, show
from slipstick.studies.figures import Figures
from slipstick.studies.result import StudyResult
from slipstick.studies.settings import StudySettings


def evidence(result: StudyResult, settings: StudySettings, pictures: Collection[str]) -> list[Section]:
    """The sections from what shows the findings to the closed gap. `pictures` are those for which there are data."""
    laws = "The measured law" if len(result.findings) == 1 else "The measured laws"

    return [Section("Measured and simulated", show("overlay", pictures)),
            Section(laws, show("law", pictures)),
            *findings.sections(result, settings), Section("What decided", show("evidence", pictures)),
            untested.explained(result), untested.times(result, pictures), simulation.blocks(result, pictures),
            simulation.gap(result, pictures),
            Section("Signals of the worst engagements", show("signals", pictures))]


def background(result: StudyResult, figures: Figures, settings: StudySettings) -> list[Section]:
    """The conditions as measured, the fitted simulation, and the limitations of the method."""
    return [simulation.conditions(result), simulation.simulation(result, settings.level),
            Section("Limitations", [Items(limits(figures.conditions))])]
