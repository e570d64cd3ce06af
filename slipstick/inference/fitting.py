"""A fit as a task: what is fitted to which measurements, and what its output consists of."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from slipstick.errors import InvalidValue
from slipstick.inference.figures import figure_data
from slipstick.inference.problems import Measured
from slipstick.table.physical_values import physical_inputs
from slipstick.table.subject import Subject
from slipstick.time_budget import Partial, TimeBudgetEnded
from slipstick.uncertainty import fit
from slipstick.uncertainty.fit.search_space import search_space
from slipstick.uncertainty.likelihood import InferenceProblem

STAGES: Mapping[str, str] = {"start": "preparing the search", "search": "searching",
                             "refine": "refining the best candidate", "intervals": "computing the intervals",
                             "conclude": "computing the result"}
"""Stage of a fit -> what it does, in words."""


@dataclass(frozen=True, eq=False)
class FitTask:
    """A fit of the inputs of `model` to `measured` outputs; `problem` joins both."""

    settings: fit.FitSettings
    problem: InferenceProblem
    model: Subject
    measured: Measured

    def output(self, state: fit.SearchState, estimate: fit.Estimate | None, budget: float) -> dict[str, Any]:
        """The result, its inputs in the units of the model (`physical`), and `figure_data`, as JSON.

        Without an `estimate`, that is the best candidate of the search. Raises `TimeBudgetEnded` where the time
        `budget` in s ended before the first generation.
        """
        if not state["history"]:
            raise TimeBudgetEnded.before(budget, "the first generation of the search")
        done, missing = fit.unfinished(self.settings, state, estimate)
        partial = Partial(budget, done, missing) if missing else None
        settings = self.settings
        if estimate is None:
            settings = replace(settings, refine=False)
            estimate = fit.refined_estimate(settings, self.problem, state)
        result = fit.summary(settings, self.problem, state, estimate, partial)
        figures = figure_data(settings, self.problem, state, estimate, self.model, self.measured)
        physical = physical_inputs(self.model, result["axes"], result["mean"], result["std"])
        return {"result": result, "physical": [asdict(entry) for entry in physical], "figure_data": figures}


def say_progress(stage: str, progress: Mapping[str, Any]) -> str:
    """What a fit does, in words, from its `stage` and the progress of its search (`fit.progress`)."""
    if stage != "search" or progress["log10_likelihood"] is None:
        return STAGES[stage]
    return (f"searching: generation {progress['generation']} of at most {progress['generations']}, best log10 "
            f"likelihood {progress['log10_likelihood']:.2f}")


def complete_settings(settings: fit.FitSettings, problem: InferenceProblem) -> fit.FitSettings:
    """The settings with the bounds of the output std that the measurements have where they give none.

    Raises `InvalidValue` where they cannot be those of this problem, or there are fewer measurements than unknowns.
    """
    if settings.output_std_bounds is None:
        settings = replace(settings, output_std_bounds=problem.output_std_bounds)
    fit.initial_state(settings, problem)
    unknowns, count = search_space(settings, problem).names, len(problem.measured_time)
    if count < len(unknowns):
        raise InvalidValue(f"{count} engagements cannot determine {len(unknowns)} unknowns: {', '.join(unknowns)}",
                           "Use recordings with more engagements, or fit fewer inputs")
    return settings
