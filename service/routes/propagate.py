"""Propagation of uncertain inputs to shifting times by polynomial chaos expansion."""

from typing import Annotated

from fastapi import APIRouter, Body, Request, Response
from pydantic import BaseModel, Field

from slipstick.inference.inputs import table_inputs
from slipstick.inference.problems import table_model
from slipstick.inference.propagation import (
    MOST_RUNS,
    QUANTILES,
    PropagationSettings,
    compute_distributions,
    default_output_std,
    expand_outputs,
    select_conditions,
)
from slipstick.interface.propagate import present
from slipstick.uncertainty import Inputs
from slipstick.uncertainty.chaos import HIGHEST_ORDER, ExpansionSettings, Rule, make_basis
from slipstick.uncertainty.likelihood import SAMPLES

from .. import propagation_drawing as drawing
from ..bodies import JsonRoute
from ..computations import ClientDependency, computes
from ..csv_form import csv_response
from ..drawings import DrawingsDependency
from ..error_responses import error_responses
from ..schemas import (
    AxisUnits,
    ConditionList,
    Description,
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
)
from ..settings import Settings

router = APIRouter(prefix="/v1/propagate", tags=["propagate"], route_class=JsonRoute)

Seed = Annotated[int, Field(ge=0, le=2**53, description="Seed of the samples; the same seed gives the same response.")]


class ExpansionBody(StrictModel):
    """Settings of the polynomial chaos expansions."""

    order: int | None = Field(
        default=None, ge=0, le=HIGHEST_ORDER, description="Total degree of the expansion; by default 8, or less for "
                                                          "many inputs, of which it would be too large.")
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
        default_factory=lambda: list(QUANTILES), max_length=100, description="Probabilities of the quantiles, at "
                                                                        "least 1 / `samples` away from 0 and 1.")
    density_points: int = Field(
        default=0, ge=0, le=2000,
        description="Number of equidistant points at which each density is computed, from five standard deviations "
                    "below to five above the mean; 0 for no densities.")
    coefficients: bool = Field(default=False, description="Whether to return the coefficients of the expansions.")

    def settings(self) -> PropagationSettings:
        """The settings of the computation; raises `InvalidValue`."""
        assert self.output_std is not None  # the default depends on the table
        expansion = self.expansion.checked(seed=self.seed)
        return PropagationSettings(self.output_std, expansion, self.tolerance, self.samples, self.seed,
                                   tuple(self.quantiles), self.density_points)


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
    reached: bool | None = Field(description="Whether the estimated error is within the tolerance; null if none was "
                                             "given.")
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
    inputs = table_inputs(table, **body.inputs.model_dump())
    selected, conditions = select_conditions(table, body.conditions)
    if body.output_std is None:
        body = body.model_copy(update={"output_std": default_output_std(table.model)})
    if form not in ("json", "csv"):
        body = drawing.require_drawable(body, len(conditions))
    asked = body.settings()
    _require_work(asked, inputs, len(conditions), settings)
    model = client.watched(table_model(selected, body.outside))
    adapted = expand_outputs(model, selected.conditions, inputs, asked)
    per_condition = 3 + 2 * inputs.dimension + len(body.quantiles) + 2 * body.density_points
    terms = body.coefficients * len(adapted.expansion.basis.degrees)
    require_size((per_condition + terms) * len(conditions), settings.answer_values, "values in the response",
                 "Select conditions, or request fewer quantiles, density points or terms")
    client.require()
    distributions = compute_distributions(adapted, inputs, table.lower, table.upper, asked)
    result = present(table, body.table, selected, conditions, distributions, body.model_dump())
    if form == "json":
        return json_response(result.answer, {"Vary": "Accept"})
    return csv_response(result.columns, "propagation") if form == "csv" else \
        drawing.draw_propagation(drawings, result, form)


def _require_work(asked: PropagationSettings, inputs: Inputs, conditions: int, settings: Settings) -> None:
    """Raise `TooLarge` for a computation that would take minutes."""
    work, terms = asked.samples * max(1, asked.density_points), 0
    if asked.tolerance is not None:
        work += MOST_RUNS
    else:
        basis = make_basis(inputs.germs, asked.expansion)
        work, terms = work + len(basis.nodes), len(basis.degrees)
    require_size(work * conditions * (1 + terms // TERMS_PER_VALUE), settings.work_values, "intermediate values",
                 "Select conditions, or request fewer nodes, samples or density points")
