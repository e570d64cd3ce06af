"""How likely recordings are under candidate inputs."""

import math
from typing import Annotated, Literal

import numpy as np
from fastapi import APIRouter, Body, Response
from pydantic import BaseModel, Field

from service.bodies import JsonRoute
from service.problem_details import responses
from service.routes.propagate import TERMS, ExpansionBody, Samples, Seed
from service.schemas import (
    SIMULATED,
    InputsBody,
    MassOutside,
    OutsidePolicy,
    RecordingsName,
    Strict,
    TableDigest,
    TableName,
    TheLibrary,
    TheSettings,
    numbers,
    require_size,
)
from slipstick.inference import table_problem
from slipstick.table import Table
from slipstick.uncertainty import mass_outside, standard_normals
from slipstick.uncertainty.chaos import make_basis
from slipstick.uncertainty.chaos.families import HERMITE
from slipstick.uncertainty.likelihood import (
    SAMPLES,
    Candidate,
    InferenceProblem,
    by_expansion,
    by_sampling,
    converged,
    exact,
)
from slipstick.uncertainty.likelihood.likelihood import KNOTTED, MOST_LINES
from slipstick.uncertainty.likelihood.line_rules import ACROSS

router = APIRouter(prefix="/v1/likelihood", tags=["likelihood"], route_class=JsonRoute)

_POINTS_A_LINE = 64  # about as many as the knots of a table, or at the usual number of lines
_KNOTTED_POINTS = 1 << 14  # about as many as a table of one or two axes is integrated on


Lines = Annotated[int, Field(
    ge=16, le=MOST_LINES, description="Lines to integrate along in three inputs and more, a power of two; a model "
                                      "without knots is also broken the more finely along them.")]


class CandidateInputs(InputsBody):
    """Uncertain inputs and the output noise that goes with them."""

    output_std: float = Field(gt=0, description="Standard deviation of the additive output noise in s.")


class LikelihoodRequest(Strict):
    """Candidates to hold against recordings."""

    table: TableName = "nominal"
    recordings: RecordingsName = "measured"
    candidates: list[CandidateInputs] = Field(min_length=1, max_length=10_000, description="One candidate or many.")
    method: Literal["auto", "exact", "expansion", "sampling"] = Field(
        default="auto",
        description="`auto` integrates the table itself, with as many lines as keep the error below 0.05 decades; "
                    "`exact` does so with `lines`; `expansion` integrates the polynomials of a fit; `sampling` takes "
                    "the mean over samples of these polynomials, as the paper does: wrong far from the data and for a "
                    "narrow noise.")
    outside: OutsidePolicy = "clip"
    expansion: ExpansionBody = Field(default_factory=lambda: ExpansionBody(), description="How to expand.")
    lines: Lines = ACROSS
    samples: Samples = SAMPLES
    seed: Seed = 1
    per_condition: bool = Field(default=True, description="Whether to give the likelihood of each condition too.")


class CandidateLikelihood(BaseModel):
    """The likelihood of the recordings under one candidate."""

    log10_likelihood: float | None = Field(
        description="Sum over the conditions, densities per ms; null stands for minus infinity.")
    per_condition: list[float | None] | None = Field(
        description="log10 of the density per ms at each measured time, in the order of the recordings; null stands "
                    "for minus infinity: there is no expansion, since the model gives no time at one node or more.")
    error: float | None = Field(
        description="With `auto`, what other lines change in the log10 likelihood; 0 where a table of one or two axes "
                    "is integrated as it stands. Null for the other methods.")
    mass_outside: MassOutside


class LikelihoodAnswer(BaseModel):
    """The likelihood of the recordings under each candidate."""

    table: str = Field(description="Name of the table.")
    table_digest: TableDigest
    recordings: str = Field(description=f"Name of the recordings. {SIMULATED}")
    recordings_digest: str = Field(description="Digest (SHA-256) of the recordings.")
    outside: OutsidePolicy
    candidates: list[CandidateLikelihood] = Field(description="In the order of the request.")


_EXAMPLE = {"table": "nominal", "recordings": "measured", "per_condition": False, "candidates": [
    {"mean": [1.0, 1.0], "std": [0.05, 0.08], "output_std": 0.01},
    {"mean": [1.0, 1.0], "mixing": [[0.05, 0.0], [0.03, 0.06]], "output_std": 0.02}]}


@router.post("", summary="Likelihood of recordings", response_model=LikelihoodAnswer,
             responses=responses(404, 408, 413, 415))
def likelihood(asked: Annotated[LikelihoodRequest, Body(examples=[_EXAMPLE])], library: TheLibrary,
               settings: TheSettings) -> Response:
    """The log10 likelihood (eq. 7 of the paper) of the measured shifting times under each candidate.

    The density of each measured time is the mean, over the inputs, of normal densities around the simulated time, with
    the output noise as their width, in logarithms throughout, per millisecond. Every run draws its own inputs, so the
    conditions add up.
    """
    table, recordings = library.table(asked.table), library.recording(asked.recordings)
    problem = table_problem(table, recordings, asked.outside)
    candidates = [Candidate(one.inputs(table), one.output_std) for one in asked.candidates]
    _require_work(asked, settings, table, len(recordings))
    logarithms, errors = _likelihoods(asked, problem, candidates)
    normals = standard_normals(len(table.axes), SAMPLES, asked.seed)
    return numbers({
        "table": asked.table, "table_digest": table.digest, "recordings": asked.recordings,
        "recordings_digest": recordings.digest, "outside": asked.outside,
        "candidates": [{"log10_likelihood": float(row.sum()), "error": error,
                        "per_condition": row.tolist() if asked.per_condition else None,
                        "mass_outside": mass_outside(candidate.inputs, problem.lower, problem.upper, normals)}
                       for candidate, row, error in zip(candidates, logarithms, errors, strict=True)],
    })


def _likelihoods(asked: LikelihoodRequest, problem: InferenceProblem,
                 candidates: list[Candidate]) -> tuple[np.ndarray, list[float | None]]:
    """log10 p (c, n), and the error of each sum where the method knows it."""
    unknown: list[float | None] = [None] * len(candidates)
    if asked.method == "auto":
        found = [converged(problem, candidate, asked.seed) for candidate in candidates]
        return np.array([row for row, _ in found]), [error for _, error in found]
    if asked.method == "exact":
        return np.array([exact(problem, candidate, asked.lines, asked.seed) for candidate in candidates]), unknown
    if asked.method == "expansion":
        return by_expansion(problem, candidates, asked.expansion.checked(0), asked.lines), unknown
    normals = standard_normals(len(problem.axes), asked.samples, asked.seed)
    return by_sampling(problem, candidates, asked.expansion.checked(0), normals), unknown


def _require_work(asked: LikelihoodRequest, settings: TheSettings, table: Table, conditions: int) -> None:
    """Refuse what would take minutes; raises `TooLarge`."""
    lines = MOST_LINES if asked.method == "auto" else asked.lines
    points = lines * _POINTS_A_LINE * math.ceil(math.sqrt(lines / ACROSS))
    if asked.method in ("auto", "exact") and table.knots is not None and len(table.axes) <= KNOTTED:
        points = _KNOTTED_POINTS
    if asked.method == "sampling":
        points = asked.samples
    if asked.method in ("expansion", "sampling"):
        basis = make_basis((HERMITE,) * len(table.axes), asked.expansion.checked(0))
        points = (points + len(basis.nodes)) * (1 + len(basis.degrees) // TERMS)
    require_size(points * conditions * len(asked.candidates), settings.work_values, "numbers on the way",
                 "Send fewer candidates at a time, or ask for fewer lines, samples and nodes")
    require_size(len(asked.candidates) * conditions, settings.answer_values, "numbers", "Send fewer at a time")
