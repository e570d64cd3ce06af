"""How likely recordings are under candidate inputs."""

from typing import Annotated, Any, Literal

import numpy as np
from fastapi import APIRouter, Body, Response
from pydantic import BaseModel, Field

from service.bodies import JsonRoute
from service.problems import responses
from service.routes.propagate import Nodes, Order, Samples, Seed
from service.schemas import (
    SIMULATED,
    MassOutside,
    NormalInputs,
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
from slipstick.problem import table_problem
from slipstick.uncertainty.expansion import NODES, ORDER, hermite_basis
from slipstick.uncertainty.inputs import mass_outside, normal_germs
from slipstick.uncertainty.likelihood import SAMPLES, Candidate, Problem, by_expansion, exact

router = APIRouter(prefix="/v1/likelihood", tags=["likelihood"], route_class=JsonRoute)

_AT_ONCE = 20_000_000
"""Model values at the nodes of all candidates taken in one go: 160 MB."""


class CandidateInputs(NormalInputs):
    """Normal inputs and the output noise that goes with them."""

    output_std: float = Field(gt=0, description="Standard deviation of the additive output noise in s.")


class LikelihoodRequest(Strict):
    """Candidates to hold against recordings."""

    table: TableName = "nominal"
    recordings: RecordingsName = "measured"
    candidates: list[CandidateInputs] = Field(min_length=1, max_length=10_000, description="One candidate or many.")
    method: Literal["expansion", "exact"] = Field(
        default="expansion",
        description="`expansion` samples the polynomial of each condition, as a fit does; `exact` asks the table at "
                    "every sample, without the error of the expansion.")
    outside: OutsidePolicy = "clip"
    order: Order = ORDER
    nodes: Nodes = NODES
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

    The density of each measured time is the mean of normal densities around samples of the simulated time, with the
    output noise as their width, in logarithms throughout, per millisecond. Every run draws its own inputs, so the
    conditions add up.
    """
    table, recordings = library.table(asked.table), library.recording(asked.recordings)
    problem = table_problem(table, recordings, asked.outside)
    candidates = [Candidate(one.inputs(table), one.output_std) for one in asked.candidates]
    basis = hermite_basis(len(table.axes), asked.order, asked.nodes)
    germs = normal_germs(len(table.axes), asked.samples, asked.seed)
    each = (len(basis.nodes) + asked.samples) * len(recordings)
    require_size(each * len(candidates), settings.work_values, "numbers on the way",
                 "Send fewer candidates at a time, or ask for fewer nodes and samples")
    require_size(len(candidates) * len(recordings), settings.answer_values, "numbers", "Send fewer at a time")
    if asked.method == "exact":
        logarithms = np.array([exact(problem, candidate, germs) for candidate in candidates])
    else:
        step = max(1, _AT_ONCE // (len(basis.nodes) * len(recordings)))
        logarithms = np.concatenate([by_expansion(problem, candidates[first:first + step], basis, germs)
                                     for first in range(0, len(candidates), step)])
    return numbers({
        "table": asked.table, "table_digest": table.digest, "recordings": asked.recordings,
        "recordings_digest": recordings.digest, "outside": asked.outside,
        "candidates": [_candidate(problem, candidate, germs, row, asked.per_condition)
                       for candidate, row in zip(candidates, logarithms, strict=True)],
    })


def _candidate(problem: Problem, candidate: Candidate, germs: np.ndarray, logarithms: np.ndarray,
               per_condition: bool) -> dict[str, Any]:
    return {"log10_likelihood": float(logarithms.sum()),
            "per_condition": logarithms.tolist() if per_condition else None,
            "mass_outside": mass_outside(candidate.inputs, problem.lower, problem.upper, germs)}
