"""What uncertain inputs do to the shifting times: expansion, moments, quantiles and density."""

from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Body, Response
from pydantic import BaseModel, Field

from service.bodies import JsonRoute
from service.problems import responses
from service.schemas import (
    ConditionList,
    MassOutside,
    NormalInputs,
    OutsidePolicy,
    Strict,
    TableDigest,
    TableName,
    TheLibrary,
    TheSettings,
    chosen,
    numbers,
    require_size,
)
from slipstick.problem import table_model
from slipstick.uncertainty.expansion import HIGHEST_ORDER, NODES, ORDER, expand, hermite_basis
from slipstick.uncertainty.inputs import mass_outside, normal_germs
from slipstick.uncertainty.likelihood import SAMPLES
from slipstick.uncertainty.output import Output

router = APIRouter(prefix="/v1/propagate", tags=["propagate"], route_class=JsonRoute)

Order = Annotated[int, Field(ge=0, le=HIGHEST_ORDER, description="Total degree of the polynomials.")]
Nodes = Annotated[int, Field(ge=1, le=60, description="Gauss nodes an axis; more than `order`.")]
Samples = Annotated[int, Field(
    ge=1, le=1 << 17, description="Samples of the germ, a power of two, for what the polynomial alone does not give.")]
Seed = Annotated[int, Field(ge=0, le=2**53, description="Seed of the samples: the same seed, the same answer.")]


class PropagateRequest(Strict):
    """Normal inputs of a table."""

    table: TableName = "nominal"
    inputs: NormalInputs
    output_std: float = Field(default=0.003, ge=0,
                              description="Standard deviation of the additive output noise in s; 0 for none.")
    conditions: ConditionList = None
    outside: OutsidePolicy = "clip"
    order: Order = ORDER
    nodes: Nodes = NODES
    samples: Samples = SAMPLES
    seed: Seed = 1
    quantiles: list[Annotated[float, Field(ge=0, le=1)]] = Field(
        default_factory=lambda: [0.05, 0.5, 0.95], max_length=100, description="Probabilities of the quantiles wanted.")
    density_points: int = Field(
        default=0, ge=0, le=2000,
        description="Points at which each density is given, across five standard deviations either side of the mean; "
                    "0 for no density.")
    coefficients: bool = Field(default=False, description="Whether to give the coefficients of the expansion.")


class Propagated(BaseModel):
    """The shifting time of one condition under uncertain inputs."""

    condition: int = Field(description="Number of the condition in the table.")
    reason: str | None = Field(description="Why there is no expansion and all else is null; null where there is one.")
    mean: float | None = Field(description="Mean in s.")
    std: float | None = Field(description="Standard deviation in s, output noise included.")
    quantiles: list[float | None] = Field(description="Quantiles in s, output noise included, as asked for.")
    density_time: list[float | None] | None = Field(description="Times of the density in s.")
    density: list[float | None] | None = Field(description="Density per ms at `density_time`, output noise included.")
    coefficients: list[float | None] | None = Field(description="Coefficients in s, in the order of `degrees`.")


class PropagateAnswer(BaseModel):
    """The shifting times under uncertain inputs."""

    table: str = Field(description="Name of the table.")
    table_digest: TableDigest
    outside: OutsidePolicy
    mass_outside: MassOutside
    degrees: list[list[int]] | None = Field(
        description="Degree of each term of the expansion in each germ: the coefficients belong to the products of "
                    "orthonormal Hermite polynomials He_n / sqrt(n!) of these degrees.")
    conditions: list[Propagated] = Field(description="One entry a condition.")


_EXAMPLE = {"table": "nominal", "inputs": {"mean": [1.0, 1.0], "std": [0.05, 0.08]}, "output_std": 0.003,
            "conditions": [0, 215], "density_points": 41, "coefficients": True}
_GAP = "The model gives no shifting time at one node of the expansion or more: there the engagement does not lock, " \
       "or the policy `nan` leaves a gap outside the table"


@router.post("", summary="Propagate uncertain inputs", response_model=PropagateAnswer,
             responses=responses(404, 408, 413, 415))
def propagate(asked: Annotated[PropagateRequest, Body(examples=[_EXAMPLE])], library: TheLibrary,
              settings: TheSettings) -> Response:
    """Expand each shifting time in polynomials of the germ (polynomial chaos, section III.A of the paper).

    Mean and standard deviation come from the coefficients, quantiles and density from samples of the polynomial.
    Choose conditions, and leave density and coefficients out, to keep the answer small.
    """
    whole = library.table(asked.table)
    inputs = asked.inputs.inputs(whole)
    table, conditions = chosen(whole, asked.conditions)
    basis = hermite_basis(inputs.dimension, asked.order, asked.nodes)
    each = 2 + len(asked.quantiles) + 2 * asked.density_points + asked.coefficients * len(basis.degrees)
    require_size(each * len(conditions), settings.answer_values, "numbers", "Choose conditions, or smaller sizes")
    work = len(basis.nodes) + asked.samples * max(1, asked.density_points)
    require_size(work * len(conditions), settings.work_values, "numbers on the way",
                 "Choose conditions, or fewer nodes, samples and density points")
    times = table_model(table, asked.outside)(inputs.points(basis.nodes), table.conditions)
    output = Output(expand(basis, times), asked.output_std, asked.samples, asked.seed)
    germs = normal_germs(inputs.dimension, asked.samples, asked.seed)
    return numbers({
        "table": asked.table, "table_digest": whole.digest, "outside": asked.outside,
        "mass_outside": mass_outside(inputs, whole.lower, whole.upper, germs),
        "degrees": basis.degrees.tolist() if asked.coefficients else None,
        "conditions": _conditions(asked, output, conditions),
    })


def _conditions(asked: PropagateRequest, output: Output, conditions: list[int]) -> list[dict[str, Any]]:
    mean, std = output.mean, output.std
    quantiles = output.quantiles(np.array(asked.quantiles)).T.tolist()
    grid = mean + np.linspace(-5, 5, asked.density_points)[:, None] * std
    density = output.density(grid) if asked.density_points else grid
    coefficients = output.expansion.coefficients
    return [{
        "condition": number,
        "reason": _GAP if output.expansion.missing[row] else None,
        "mean": mean[row], "std": std[row], "quantiles": quantiles[row],
        "density_time": grid[:, row].tolist() if asked.density_points else None,
        "density": density[:, row].tolist() if asked.density_points else None,
        "coefficients": coefficients[:, row].tolist() if asked.coefficients else None,
    } for row, number in enumerate(conditions)]
