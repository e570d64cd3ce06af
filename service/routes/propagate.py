"""What uncertain inputs do to the shifting times: expansion, moments, quantiles and density."""

from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Body, Response
from pydantic import BaseModel, Field

from service.bodies import JsonRoute
from service.problem_details import responses
from service.schemas import (
    ConditionList,
    InputsBody,
    MassOutside,
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
from slipstick.inference import table_model
from slipstick.table import Table
from slipstick.uncertainty import Inputs, mass_outside, standard_normals
from slipstick.uncertainty.chaos import (
    HIGHEST_ORDER,
    ORDER,
    Adapted,
    ExpansionSettings,
    Output,
    Rule,
    adapt,
    expand,
    first_order,
    make_basis,
    total,
)
from slipstick.uncertainty.likelihood import SAMPLES, ShiftingTimeModel

router = APIRouter(prefix="/v1/propagate", tags=["propagate"], route_class=JsonRoute)

Samples = Annotated[int, Field(
    ge=1, le=1 << 17, description="Samples of the germ, a power of two, for what the polynomial alone does not give.")]
Seed = Annotated[int, Field(ge=0, le=2**53, description="Seed of the samples: the same seed, the same answer.")]


class ExpansionBody(Strict):
    """How to expand in polynomials."""

    order: int = Field(default=ORDER, ge=0, le=HIGHEST_ORDER, description="Total degree of the polynomials.")
    norm: float = Field(default=1.0, gt=0, le=1, description="1 keeps the total degree, less drops interactions.")
    rule: Rule | None = Field(
        default=None, description="`tensor`: the full grid of Gauss nodes; `regression`: least squares on samples. By "
                                  "itself the first for one or two inputs, the second for more.")
    nodes: int | None = Field(default=None, ge=1, le=60, description="Gauss nodes an axis, order + 1 or more.")
    runs: int | None = Field(default=None, ge=2, le=20_000, description="Samples of a regression, twice the terms.")

    def checked(self, checks: int = 16, seed: int = 1) -> ExpansionSettings:
        """Return them as settings, with `checks` model runs for the error; raises `InvalidValue`."""
        return ExpansionSettings(self.order, self.norm, self.rule, self.nodes, checks, self.runs, seed)


class PropagateRequest(Strict):
    """Uncertain inputs of a table."""

    table: TableName = "nominal"
    inputs: InputsBody
    output_std: float = Field(default=0.003, ge=0,
                              description="Standard deviation of the additive output noise in s; 0 for none.")
    conditions: ConditionList = None
    outside: OutsidePolicy = "clip"
    expansion: ExpansionBody = Field(default_factory=lambda: ExpansionBody(), description="How to expand.")
    tolerance: float | None = Field(
        default=None, gt=0, description="Error of the expansions in s to raise the order for, up to 20,000 model runs; "
                                        "null for the order as it is.")
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
    error: float | None = Field(
        description="Estimated root mean square error of the expansion over the inputs in s: leave-one-out for a "
                    "regression, at 16 more samples for a tensor rule.")
    first_order: list[float | None] | None = Field(
        description="First-order Sobol index of each input, of the variance without noise; null for dependent inputs.")
    total: list[float | None] | None = Field(description="Total Sobol index of each input; null for dependent inputs.")
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
    order: int = Field(description="Order of the expansions.")
    nodes: int = Field(description="Model runs for each condition, for all orders tried.")
    reached: bool | None = Field(description="Whether the error is within the tolerance; null where none was given.")
    germs: list[str] = Field(description="Polynomials of each input: hermite, laguerre, jacobi or legendre.")
    degrees: list[list[int]] | None = Field(
        description="Degree of each term of the expansion in each germ: the coefficients belong to the products of "
                    "the orthonormal polynomials of these degrees in the standardised germs.")
    conditions: list[Propagated] = Field(description="One entry a condition.")


_EXAMPLE = {"table": "nominal", "inputs": {"mean": [1.0, 1.0], "std": [0.05, 0.08]}, "output_std": 0.003,
            "conditions": [0, 215], "density_points": 41, "coefficients": True}
TERMS = 32
"""So many terms of a polynomial cost as much as one number on the way."""
_MOST_RUNS = 20_000  # to reach a tolerance
_GAP = "The model gives no shifting time at one node of the expansion or more: there the engagement does not lock, " \
       "or the policy `nan` leaves a gap outside the table"


@router.post("", summary="Propagate uncertain inputs", response_model=PropagateAnswer,
             responses=responses(404, 408, 413, 415))
def propagate(asked: Annotated[PropagateRequest, Body(examples=[_EXAMPLE])], library: TheLibrary,
              settings: TheSettings) -> Response:
    """Expand each shifting time in polynomials of the germ (polynomial chaos, section III.A of the paper).

    Mean, standard deviation and Sobol indices come from the coefficients, quantiles and density from samples of the
    polynomial.
    Choose conditions, and leave density and coefficients out, to keep the answer small.
    """
    whole = library.table(asked.table)
    inputs = asked.inputs.inputs(whole)
    table, conditions = chosen(whole, asked.conditions)
    adapted = _expand(asked, inputs, table_model(table, asked.outside), table, settings)
    expansion = adapted.expansion
    basis = expansion.basis
    each = 3 + 2 * inputs.dimension + len(asked.quantiles) + 2 * asked.density_points
    require_size((each + asked.coefficients * len(basis.degrees)) * len(conditions), settings.answer_values, "numbers",
                 "Choose conditions, or smaller sizes")
    output = Output(expansion, asked.output_std, asked.samples, asked.seed)
    normals = standard_normals(inputs.dimension, asked.samples, asked.seed)
    return numbers({
        "table": asked.table, "table_digest": whole.digest, "outside": asked.outside,
        "mass_outside": mass_outside(inputs, whole.lower, whole.upper, normals),
        "order": basis.order, "nodes": adapted.runs, "reached": None if asked.tolerance is None else adapted.reached,
        "germs": [germ.name for germ in basis.germs],
        "degrees": basis.degrees.tolist() if asked.coefficients else None,
        "conditions": _conditions(asked, output, inputs.independent, conditions),
    })


def _expand(asked: PropagateRequest, inputs: Inputs, model: ShiftingTimeModel, table: Table,
            settings: TheSettings) -> Adapted:
    """The expansions as asked for; raises `TooLarge`."""
    wanted = asked.expansion.checked(seed=asked.seed)

    def at_germs(germs: np.ndarray) -> np.ndarray:
        return model(inputs.at_germs(germs), table.conditions)

    samples = asked.samples * max(1, asked.density_points)
    remedy = "Choose conditions, or fewer nodes, samples and density points"
    if asked.tolerance is not None:
        require_size((_MOST_RUNS + samples) * len(table.conditions), settings.work_values, "numbers on the way", remedy)
        return adapt(at_germs, inputs.germs, asked.tolerance, _MOST_RUNS, wanted)
    basis = make_basis(inputs.germs, wanted)
    work = (len(basis.nodes) + samples) * len(table.conditions) * (1 + len(basis.degrees) // TERMS)
    require_size(work, settings.work_values, "numbers on the way", remedy)
    expansion = expand(basis, at_germs(basis.nodes))
    return Adapted(expansion, float(np.nanmax(expansion.error, initial=0.0)), False, len(basis.nodes))


def _conditions(asked: PropagateRequest, output: Output, independent: bool,
                conditions: list[int]) -> list[dict[str, Any]]:
    mean, std, error = output.mean, output.std, output.expansion.error
    first, whole = first_order(output.expansion), total(output.expansion)
    quantiles = output.quantiles(np.array(asked.quantiles)).T.tolist()
    grid = mean + np.linspace(-5, 5, asked.density_points)[:, None] * std
    density = output.density(grid) if asked.density_points else grid
    coefficients = output.expansion.coefficients
    return [{
        "condition": number,
        "reason": _GAP if output.expansion.missing[row] else None,
        "mean": mean[row], "std": std[row], "error": error[row], "quantiles": quantiles[row],
        "first_order": first[row].tolist() if independent else None,
        "total": whole[row].tolist() if independent else None,
        "density_time": grid[:, row].tolist() if asked.density_points else None,
        "density": density[:, row].tolist() if asked.density_points else None,
        "coefficients": coefficients[:, row].tolist() if asked.coefficients else None,
    } for row, number in enumerate(conditions)]
