"""Likelihood of recordings under candidate distributions of the inputs."""

import math
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Body, Request, Response
from pydantic import BaseModel, Field, field_validator

from slipstick.black_box import Measurements, Quantity
from slipstick.inference.inputs import table_inputs
from slipstick.inference.likelihoods import (
    FEWEST_LINES,
    Likelihoods,
    LikelihoodSettings,
    Method,
    compute_likelihoods,
)
from slipstick.inference.problems import table_problem
from slipstick.interface.likelihood import answer_of
from slipstick.interface.tables import condition_columns
from slipstick.recordings import Recordings
from slipstick.table import Table
from slipstick.table.subject import columns
from slipstick.uncertainty.chaos import make_basis
from slipstick.uncertainty.chaos.families import HERMITE
from slipstick.uncertainty.likelihood import SAMPLES, Candidate, InferenceProblem
from slipstick.uncertainty.likelihood.likelihood import KNOTTED, MOST_LINES
from slipstick.uncertainty.likelihood.line_rules import ACROSS

from ..bodies import JsonRoute
from ..computations import ClientDependency, computes
from ..csv_form import CSV_RESPONSE, TableFormQuery, csv_response, wants_csv
from ..error_responses import error_responses
from ..routes.propagate import TERMS_PER_VALUE, ExpansionBody, Seed
from ..schemas import (
    SIMULATED,
    AxisUnits,
    Description,
    InputsBody,
    LibraryDependency,
    MassOutside,
    OutsidePolicy,
    RecordingsDigest,
    RecordingsName,
    SettingsDependency,
    StrictModel,
    TableBench,
    TableDigest,
    TableName,
    json_response,
    open_table,
    require_size,
)
from ..settings import Settings

router = APIRouter(prefix="/v1/likelihood", tags=["likelihood"], route_class=JsonRoute)

_POINTS_PER_LINE = 64  # order of magnitude, for the knots of a table and for the default number of lines
_GRID_POINTS = 1 << 14  # order of magnitude of the number of points in total, for a grid of one or two axes


class CandidateBody(InputsBody):
    """A candidate: a distribution of the uncertain inputs with an output noise."""

    output_std: float = Field(gt=0, description="Standard deviation of the additive output noise in the unit of the "
                                                "output, s for shifting times.")


class LikelihoodRequest(StrictModel):
    """Candidates whose likelihood is computed."""

    table: TableName = "nominal"
    bench: TableBench = None
    recordings: RecordingsName = "measured"
    candidates: list[CandidateBody] = Field(min_length=1, max_length=10_000, description="The candidates.")
    method: Method = Field(
        default="auto",
        description="How the density is integrated over the inputs. `auto`: integrate the table itself, on "
                    "a lattice (a grid of one or two axes) or along lines, refined until the error is below 0.05 "
                    "decades. `exact`: the same with the given "
                    "number of `lines`. `expansion`: integrate the polynomial chaos expansion along `lines`. "
                    "`sampling`: mean over `samples` of the expansion, as in the paper; inaccurate for narrow output "
                    "noise and for candidates that are far from the recordings.")
    outside: OutsidePolicy = "clip"
    expansion: ExpansionBody = Field(default_factory=lambda: ExpansionBody(),
                                     description="Settings of the expansions, for `expansion` and `sampling`.")
    lines: Annotated[int, Field(
        ge=FEWEST_LINES, le=MOST_LINES,
        description="Number of integration lines for three or more inputs, a power of two. A larger number also "
                    "reduces the spacing of the points along the lines. Ignored by `auto`, and by `exact` for a grid "
                    "of one or two axes.")] = ACROSS
    samples: Annotated[int, Field(ge=1, le=1 << 17, description="Number of samples for `sampling`, a power of two.",
                                  )] = SAMPLES
    seed: Seed = 1
    per_condition: bool = Field(default=True, description="Whether to return the contribution of each condition.")

    @field_validator("lines", "samples")
    @classmethod
    def _power_of_two(cls, count: int) -> int:
        # Checked for every method: a number that the method ignores is a mistake as well.
        if count & (count - 1):
            raise ValueError(f"{count} is not a power of two, such as {1 << count.bit_length()}")
        return count


class CandidateLikelihood(BaseModel):
    """The likelihood of the recordings under one candidate."""

    log10_likelihood: float | None = Field(
        description="log10 likelihood: sum over the conditions, densities per ms; null for minus infinity.")
    per_condition: list[float | None] | None = Field(
        description="log10 of the probability density per ms at each measured shifting time, in the order of the "
                    "recordings; null for minus infinity, which means that the model has no shifting time at any "
                    "relevant input (`auto`, `exact`) or that the expansion does not exist (`expansion`, `sampling`).")
    error: float | None = Field(
        description="Error of the log10 likelihood in decades, which is to hold in 95 % of the cases. `auto`, `exact`: "
                    "of the integral of the table. `expansion`, `sampling`: the difference to `auto`, plus the error "
                    "of that. Null if the likelihood is 0, or if the measured values are out of reach.")
    mass_outside: MassOutside


class LikelihoodResponse(BaseModel):
    """The likelihood of the recordings under each candidate."""

    table: str = Field(description="Name of the table.")
    table_digest: TableDigest
    recordings: str = Field(description=f"Name of the recordings. {SIMULATED}")
    recordings_digest: RecordingsDigest
    axes: AxisUnits
    outside: OutsidePolicy
    described: list[Description] | None = Field(description="The conditions of the recordings in words, in the order "
                                                            "of `per_condition`; null without it.")
    candidates: list[CandidateLikelihood] = Field(description="Likelihoods, in the order of the candidates.")


EXAMPLE = {"table": "nominal", "recordings": "measured", "per_condition": False, "candidates": [
    {"mean": [1.0, 1.0], "std": [0.05, 0.08], "output_std": 0.01},
    {"mean": [1.0, 1.0], "mixing": [[0.05, 0.0], [0.03, 0.06]], "output_std": 0.02}]}


@router.post("", summary="Compute the likelihood of recordings", response_model=LikelihoodResponse,
             responses=error_responses(404, 408, 413, 415, 503) | CSV_RESPONSE)
@computes
def likelihood(body: Annotated[LikelihoodRequest, Body(examples=[EXAMPLE])], library: LibraryDependency,
               settings: SettingsDependency, client: ClientDependency, request: Request,
               form: TableFormQuery = None) -> Response:
    """Compute the log10 likelihood of the measured shifting times under each candidate (eq. 7 of the paper).

    The probability density of a measured time is the expectation, over the inputs, of a normal density centred at the
    simulated time whose standard deviation is the output noise. The inputs of different runs are independent, so the
    log10 densities of the conditions are summed. CSV has a row for each candidate and engagement, or, without
    `per_condition`, for each candidate. Measurements that no inputs of the table reach, such as those in another unit,
    are rejected with 422.
    """
    table, recordings = open_table(library, body.table, body.bench), library.measured(body.recordings)
    problem = table_problem(table, recordings, body.outside)
    candidates = [Candidate(table_inputs(table, **candidate.model_dump(exclude={"output_std"})), candidate.output_std)
                  for candidate in body.candidates]
    _require_work(body, settings, table, len(recordings))
    computed = _estimate(body, replace(problem, model=client.watched(problem.model)), table.output, candidates)
    answer = answer_of(table, body.table, recordings, computed, body.model_dump())
    return _csv(body, recordings, answer) if wants_csv(request, form) else json_response(answer)


def _estimate(body: LikelihoodRequest, problem: InferenceProblem, output: Quantity,
              candidates: list[Candidate]) -> Likelihoods:
    """The likelihoods of all candidates."""
    return compute_likelihoods(problem, output, candidates, LikelihoodSettings(
        body.method, body.expansion.checked(0, body.seed), body.lines, body.samples, body.seed))


def _csv(body: LikelihoodRequest, recordings: Recordings | Measurements, answer: dict[str, Any]) -> Response:
    candidates, count = answer["candidates"], len(recordings)
    if not body.per_condition:
        return csv_response({"candidate": range(len(candidates)), **{
            name: [row[name] for row in candidates] for name in ("log10_likelihood", "error", "mass_outside")}},
            "likelihood")
    measured = "shifting_time [s]" if isinstance(recordings, Recordings) else \
        f"{recordings.output.name} [{recordings.output.unit}]"
    given = {"condition": range(count), **condition_columns(columns(recordings.conditions)),
             measured: recordings.measured_time.tolist()}
    return csv_response({
        "candidate": np.repeat(range(len(candidates)), count).tolist(),
        **{name: list(column) * len(candidates) for name, column in given.items()},
        "log10_density": [value for row in candidates for value in row["per_condition"]]}, "likelihood")


def integration_points(table: Table, lines: int = ACROSS) -> int:
    """Order of magnitude of the number of points at which a table is integrated for one likelihood."""
    if table.knots is not None and len(table.axes) <= KNOTTED:
        return _GRID_POINTS
    return _line_points(lines)


def _line_points(lines: int) -> int:
    return lines * _POINTS_PER_LINE * math.ceil(math.sqrt(lines / ACROSS))


def _require_work(body: LikelihoodRequest, settings: Settings, table: Table, conditions: int) -> None:
    """Raise `TooLarge` for a computation that would take minutes."""
    lines = MOST_LINES if body.method == "auto" else body.lines
    points = integration_points(table, lines) if body.method in ("auto", "exact") else _line_points(lines)
    if body.method == "sampling":
        points = body.samples
    if body.method in ("expansion", "sampling"):
        basis = make_basis((HERMITE,) * len(table.axes), body.expansion.checked(0, body.seed))
        points = (points + len(basis.nodes)) * (1 + len(basis.degrees) // TERMS_PER_VALUE)
    require_size(points * conditions * len(body.candidates), settings.work_values, "intermediate values",
                 "Send fewer candidates per request, or request fewer lines, samples or nodes")
    require_size(len(body.candidates) * conditions, settings.answer_values, "values in the response",
                 "Send fewer candidates per request")
