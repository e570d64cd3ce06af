"""Propagation of uncertain inputs to shifting times by polynomial chaos expansion."""

from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Body, Request, Response
from pydantic import BaseModel, Field

from slipstick.black_box import BlackBoxDescription
from slipstick.inference.problems import table_model
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

from .. import propagation_drawing as drawing
from ..bodies import JsonRoute
from ..computations import ClientDependency, computes
from ..descriptions import Description, descriptions
from ..drawings import DrawingsDependency
from ..error_responses import error_responses
from ..schemas import (
    AxisUnit,
    AxisUnits,
    ConditionList,
    InputsBody,
    LibraryDependency,
    MassOutside,
    OutsidePolicy,
    SettingsDependency,
    StrictModel,
    TableBench,
    TableDigest,
    TableName,
    json_response,
    open_table,
    require_size,
    select_conditions,
)
from ..settings import Settings

router = APIRouter(prefix="/v1/propagate", tags=["propagate"], route_class=JsonRoute)

Seed = Annotated[int, Field(ge=0, le=2**53, description="Seed of the samples; the same seed gives the same response.")]


class ExpansionBody(StrictModel):
    """Settings of the polynomial chaos expansions."""

    order: int = Field(default=ORDER, ge=0, le=HIGHEST_ORDER, description="Total degree of the expansion.")
    norm: float = Field(
        default=1.0, gt=0, le=1, description="Exponent q of the hyperbolic truncation. The value 1 keeps all terms up "
                                             "to the total degree; smaller values drop interactions.")
    rule: Rule | None = Field(
        default=None, description="Where the model is evaluated. `tensor`: a full tensor grid of Gauss nodes. "
                                  "`regression`: least squares on random samples. The default is `tensor` for one or "
                                  "two inputs and `regression` for more.")
    nodes: int | None = Field(default=None, ge=1, le=60, description="`tensor`: Gauss nodes per axis, at least and by "
                                                                     "default order + 1.")
    runs: int | None = Field(default=None, ge=2, le=20_000, description="`regression`: number of samples, by default "
                                                                        "twice the number of terms.")

    def checked(self, checks: int = 16, seed: int = 1) -> ExpansionSettings:
        """Return the settings, with `checks` model runs to estimate the error; raises `InvalidValue`."""
        return ExpansionSettings(self.order, self.norm, self.rule, self.nodes, checks, self.runs, seed)


class PropagateRequest(StrictModel):
    """Propagation of uncertain inputs through a table."""

    table: TableName = "nominal"
    bench: TableBench = None
    inputs: InputsBody
    output_std: float | None = Field(
        default=None, ge=0, description="Standard deviation of the additive output noise in the unit of the output; 0 "
                                        "for no noise. By default 0.003 s for shifting times, and 0 for the output of "
                                        "another machine.")
    conditions: ConditionList = None
    outside: OutsidePolicy = "clip"
    expansion: ExpansionBody = Field(default_factory=lambda: ExpansionBody(), description="Settings of the expansions.")
    tolerance: float | None = Field(
        default=None, gt=0, description="Target for the error of the expansions in the unit of the output. With a "
                                        "target, `expansion.order` is ignored, and the order is increased from 1 until "
                                        "the error meets the target or 20,000 model runs are used. Null for expansions "
                                        "of the given order.")
    samples: Annotated[int, Field(
        ge=1, le=1 << 17, description="Number of samples of the expansion for quantiles and densities, a power of two.",
    )] = SAMPLES
    seed: Seed = 1
    quantiles: list[Annotated[float, Field(ge=0, le=1)]] = Field(
        default_factory=lambda: [0.05, 0.5, 0.95], max_length=100, description="Probabilities of the quantiles.")
    density_points: int = Field(
        default=0, ge=0, le=2000,
        description="Number of equidistant points at which each density is computed, from five standard deviations "
                    "below to five above the mean; 0 for no densities.")
    coefficients: bool = Field(default=False, description="Whether to return the coefficients of the expansions.")


class ShiftingTimeDistribution(BaseModel):
    """Distribution of the shifting time in s, or of the output of another machine in its unit, in one condition."""

    condition: int = Field(description="Index of the condition in the table.")
    described: Description
    reason: str | None = Field(description="Why the expansion does not exist, in which case all results are null; null "
                                           "if it exists.")
    mean: float | None = Field(description="Mean.")
    std: float | None = Field(description="Standard deviation, including the output noise.")
    error: float | None = Field(
        description="Estimated RMS error of the expansion, over the distribution of the inputs: the leave-one-out "
                    "error for `regression`, the error at 16 additional samples for `tensor`.")
    first_order: list[float | None] | None = Field(
        description="First-order Sobol index of each input, for the variance without output noise; null for dependent "
                    "inputs.")
    total: list[float | None] | None = Field(
        description="Total Sobol index of each input, for the variance without output noise; null for dependent "
                    "inputs.")
    quantiles: list[float | None] = Field(
        description="Quantiles, including the output noise, in the order of the requested probabilities.")
    density_time: list[float | None] | None = Field(description="Shifting times at which the density is given.")
    density: list[float | None] | None = Field(
        description="Probability density at `density_time`, per ms or per thousandth of the unit of another output, "
                    "including the output noise.")
    coefficients: list[float | None] | None = Field(
        description="Coefficients of the expansion, in the order of `degrees`.")


class PropagateResponse(BaseModel):
    """Distributions of the shifting times."""

    table: str = Field(description="Name of the table.")
    table_digest: TableDigest
    axes: AxisUnits
    outside: OutsidePolicy
    mass_outside: MassOutside
    order: int = Field(description="Order of the expansions.")
    nodes: int = Field(description="Number of model runs per condition, summed over all orders that were tried.")
    reached: bool | None = Field(description="Whether the error is within the tolerance; null if none was given.")
    germs: list[str] = Field(description="Polynomial family of each input: hermite, laguerre, jacobi or legendre.")
    degrees: list[list[int]] | None = Field(
        description="Degrees of each term of the expansions, one per germ (standardised random variable). A term is "
                    "the product of the orthonormal polynomials of these degrees in the germs. Null unless "
                    "`coefficients` is requested.")
    conditions: list[ShiftingTimeDistribution] = Field(description="One entry per condition.")


_EXAMPLE = {"table": "nominal", "inputs": {"mean": [1.0, 1.0], "std": [0.05, 0.08]}, "output_std": 0.003,
            "conditions": [0, 215], "density_points": 41, "coefficients": True}
TERMS_PER_VALUE = 32
"""Number of polynomial terms whose evaluation costs as much as one intermediate value."""
_OUTPUT_STD = 0.003  # default noise of shifting times in s
_MOST_RUNS = 20_000  # maximum number of model runs to reach a tolerance
_NO_EXPANSION = "The model has no shifting time at one or more nodes of the expansion: the engagement does not lock " \
                "there, or the node lies outside the table and `outside` is `nan`"


@router.post("", summary="Propagate uncertain inputs", response_model=PropagateResponse,
             responses=error_responses(404, 408, 413, 415, 503) | {200: {"content": drawing.CONTENT}})
@computes
def propagate(body: Annotated[PropagateRequest, Body(examples=[_EXAMPLE])], library: LibraryDependency,
              settings: SettingsDependency, client: ClientDependency, request: Request,
              drawings: DrawingsDependency, format: drawing.FormatQuery = None) -> Response:
    """Compute the distribution of each shifting time by polynomial chaos expansion (section III.A of the paper).

    Mean, standard deviation and Sobol indices follow from the coefficients of the expansion; quantiles and densities
    follow from samples of it. To keep the response small, select conditions and omit densities and coefficients.

    With `format` or the Accept header the same request is drawn: densities, quantiles and Sobol indices of each
    condition as a picture (`svg`, `png`), or as a page with a table and warnings (`html`).
    """
    form = drawing.form(request, format)
    table = open_table(library, body.table, body.bench)
    inputs = body.inputs.inputs(table)
    selected, conditions = select_conditions(table, body.conditions)
    if body.output_std is None:
        output_std = 0.0 if isinstance(table.model, BlackBoxDescription) else _OUTPUT_STD
        body = body.model_copy(update={"output_std": output_std})
    if form not in ("json", "csv"):
        body = drawing.drawable(body, len(conditions))
    adapted = _expand(body, inputs, client.watched(table_model(selected, body.outside)), selected, settings)
    expansion = adapted.expansion
    basis = expansion.basis
    per_condition = 3 + 2 * inputs.dimension + len(body.quantiles) + 2 * body.density_points
    require_size((per_condition + body.coefficients * len(basis.degrees)) * len(conditions), settings.answer_values,
                 "values in the response", "Select conditions, or request fewer quantiles, density points or terms")
    client.require()
    output = Output(expansion, body.output_std or 0.0, body.samples, body.seed)
    normals = standard_normals(inputs.dimension, body.samples, body.seed)
    answer = json_response({
        "table": body.table, "table_digest": table.digest, "axes": AxisUnit.of(table),
        "outside": body.outside,
        "mass_outside": mass_outside(inputs, table.lower, table.upper, normals),
        "order": basis.order, "nodes": adapted.runs, "reached": None if body.tolerance is None else adapted.reached,
        "germs": [germ.name for germ in basis.germs],
        "degrees": basis.degrees.tolist() if body.coefficients else None,
        "conditions": [{"described": descriptions(table.conditions)[row["condition"]], **row}
                       for row in _distributions(body, output, inputs.independent, conditions)],
    }, {"Vary": "Accept"})
    if form == "csv":
        return drawing.tabulated(answer, body.model_dump(), selected)
    return answer if form == "json" else drawing.drawn(drawings, answer, body.model_dump(), selected, form)


def _expand(body: PropagateRequest, inputs: Inputs, model: ShiftingTimeModel, table: Table,
            settings: Settings) -> Adapted:
    """Return the requested expansions; raises `TooLarge`."""
    expansion_settings = body.expansion.checked(seed=body.seed)

    def model_at_germs(germs: np.ndarray) -> np.ndarray:
        return model(inputs.at_germs(germs), table.conditions)

    samples = body.samples * max(1, body.density_points)
    quantity, remedy = "intermediate values", "Select conditions, or request fewer nodes, samples or density points"
    if body.tolerance is not None:
        require_size((_MOST_RUNS + samples) * len(table.conditions), settings.work_values, quantity, remedy)
        return adapt(model_at_germs, inputs.germs, body.tolerance, _MOST_RUNS, expansion_settings)
    basis = make_basis(inputs.germs, expansion_settings)
    work = (len(basis.nodes) + samples) * len(table.conditions) * (1 + len(basis.degrees) // TERMS_PER_VALUE)
    require_size(work, settings.work_values, quantity, remedy)
    expansion = expand(basis, model_at_germs(basis.nodes))
    return Adapted(expansion, float(np.nanmax(expansion.error, initial=0.0)), False, len(basis.nodes))


def _distributions(body: PropagateRequest, output: Output, independent: bool,
                   conditions: list[int]) -> list[dict[str, Any]]:
    mean, std, error = output.mean, output.std, output.expansion.error
    first_order_indices, total_indices = first_order(output.expansion), total(output.expansion)
    quantiles = output.quantiles(np.array(body.quantiles)).T.tolist()
    grid = mean + np.linspace(-5, 5, body.density_points)[:, None] * std
    density = output.density(grid) if body.density_points else grid
    coefficients = output.expansion.coefficients
    return [{
        "condition": condition,
        "reason": _NO_EXPANSION if output.expansion.missing[row] else None,
        "mean": mean[row], "std": std[row], "error": error[row], "quantiles": quantiles[row],
        "first_order": first_order_indices[row].tolist() if independent else None,
        "total": total_indices[row].tolist() if independent else None,
        "density_time": grid[:, row].tolist() if body.density_points else None,
        "density": density[:, row].tolist() if body.density_points else None,
        "coefficients": coefficients[:, row].tolist() if body.coefficients else None,
    } for row, condition in enumerate(conditions)]
