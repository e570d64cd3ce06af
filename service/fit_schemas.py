"""Request and response bodies of fits."""

from typing import Literal

from pydantic import BaseModel, Field

from slipstick.time_budget import DEFAULT, Partial
from slipstick.uncertainty.chaos import HIGHEST_ORDER, Family, Rule
from slipstick.uncertainty.fit import FitSettings
from slipstick.uncertainty.fit.settings import Integration, Method

from .jobs import Ahead, AllSettings, BudgetLeft, MissingMachine, RecordedJob, TimeBudget
from .paging import Page
from .schemas import (
    BenchName,
    MassOutside,
    OutsidePolicy,
    Range,
    RecordingsDigest,
    RecordingsName,
    StrictModel,
    TableDigest,
    TableName,
)

Bounds = list[Range]


class FitSettingsBody(StrictModel):
    """Settings of a fit. Omitted settings have default values, which the response reports."""

    seed: int | None = Field(default=None, ge=0, le=2**53,
                             description="Seed of the random numbers; the same seed gives the same result.")
    families: list[Family] | None = Field(
        default=None, max_length=20, description="Distribution families of the inputs: one for all inputs, or one per "
                                                 "input. The support of a beta input is the range that the model "
                                                 "covers.")
    correlated: bool | None = Field(default=None, description="Whether to fit the correlations of the inputs as well.")
    method: Method | None = Field(
        default=None, description="Search method. `genetic`: a genetic algorithm on the likelihood by polynomial "
                                  "chaos expansion. `classic`: samples of the model for every candidate of a regular "
                                  "grid, the benchmark of the paper; its cost grows exponentially with the number of "
                                  "unknowns.")
    population: int | None = Field(default=None, le=1000, description="`genetic`: candidates per generation.")
    generations: int | None = Field(default=None, le=10_000, description="`genetic`: maximum number of generations.")
    patience: int | None = Field(default=None, le=10_000, description="`genetic`: the search stops when the likelihood "
                                                                      "has not improved by more than `tolerance` over "
                                                                      "this number of generations.")
    tolerance: float | None = Field(default=None, description="`genetic`: smallest improvement of the log10 likelihood "
                                                              "that counts, in decades; 1 by default. Without "
                                                              "`refine`, 0.1 comes closer.")
    order: int | None = Field(default=None, le=HIGHEST_ORDER, description="Total degree of the expansions.")
    norm: float | None = Field(
        default=None, description="Exponent q of the hyperbolic truncation, 0 < q <= 1. The value 1 keeps all terms up "
                                  "to the total degree; smaller values drop interactions.")
    rule: Rule | None = Field(
        default=None, description="Where the model is evaluated for an expansion. `tensor`: a full tensor grid of "
                                  "Gauss nodes. `regression`: least squares on random samples. The default is `tensor` "
                                  "for one or two inputs and `regression` for more.")
    nodes: int | None = Field(default=None, le=60, description="`tensor`: Gauss nodes per axis, more than `order`.")
    runs: int | None = Field(default=None, le=20_000, description="`regression`: samples of the model per expansion.")
    integration: Integration | None = Field(
        default=None, description="How the search integrates the likelihood over the inputs: `lines` (a closed form "
                                  "along integration lines) or `sampling` (the mean over samples, as in the paper).")
    samples: int | None = Field(default=None, le=1 << 15,
                                description="Number of samples for `sampling` and `classic`, a power of two.")
    grid: int | None = Field(default=None, le=100, description="`classic`: values of each unknown.")
    refine: bool | None = Field(
        default=None, description="Whether to refine the best candidate of the search by gradient-based optimization "
                                  "of the exact likelihood.")
    intervals: bool | None = Field(default=None, description="Whether to compute profile-likelihood intervals.")
    level: float | None = Field(default=None, description="Confidence level of the intervals.")
    mean_bounds: Bounds | None = Field(
        default=None, description="Bounds of the means, in multiples of nominal: one pair for all inputs, or one pair "
                                  "per input.")
    std_bounds: Bounds | None = Field(
        default=None, description="Bounds of the standard deviations, in multiples of nominal: one pair for all "
                                  "inputs, or one pair per input.")
    output_std_bounds: Range | None = Field(
        default=None, description="Bounds of the standard deviation of the output noise in the unit of the output. By "
                                  "default 0.0005 to 0.1 s for shifting times; for the output of another machine, from "
                                  "a thousandth of half the range of the measurements to half of it.")

    def checked(self) -> FitSettings:
        """Return complete settings, with default values filled in; raises `InvalidValue`."""
        return FitSettings.from_dict(self.model_dump(exclude_none=True))


class FitRequest(StrictModel):
    """A fit of uncertain inputs to recordings."""

    table: TableName = "nominal"
    simulate: bool = Field(
        default=False, description="Whether to run the simulator instead of interpolating the table. The simulator "
                                   "uses the model of the table, and any of its parameters can be an input. Inputs are "
                                   "clipped to the bounds of the bench, or to the ranges of another machine, whose "
                                   "file the worker needs (`work --machine`).")
    bench: BenchName = None
    parameters: list[str] | None = Field(
        default=None, min_length=1, max_length=20, examples=[["pressure_bias", "initial_position"]],
        description="Names of the uncertain inputs; all other parameters keep their nominal value. By default all axes "
                    "of the table.")
    recordings: RecordingsName = "measured"
    outside: OutsidePolicy = "clip"
    settings: FitSettingsBody = Field(default_factory=lambda: FitSettingsBody(), description="Settings of the fit.")
    time_budget: TimeBudget = DEFAULT


class Fit(RecordedJob):
    """A fit without its progress and result."""

    table: str = Field(description="Name of the table.")
    table_digest: TableDigest
    settings: AllSettings
    simulate: bool = Field(description="Whether the simulator is run instead of interpolating the table.")
    parameters: list[str] = Field(description="Names of the uncertain inputs.")
    outside: OutsidePolicy


class FitProgress(BaseModel):
    """Progress of a fit, and its best candidate so far."""

    stage: Literal["start", "search", "refine", "intervals", "conclude"] = Field(
        description="Current stage: the start, in which the simulator is compiled at its first use, the search, the "
                    "refinement, the intervals, or the assembly of the result.")
    generation: int = Field(description="Completed generations, or completed blocks of the classic grid.")
    generations: int = Field(description="Maximum number of generations, or number of blocks of the classic grid.")
    done: float = Field(description="Share of the search that is done, at least: a genetic search may end earlier.")
    seconds_left: float | None = Field(
        description="Time that the search takes at most from here, at its pace so far, in s; null before its first "
                    "generation and in the later stages, whose duration is not known.")
    budget_left: BudgetLeft = None
    model_runs: int = Field(description="Model evaluations in the current step (a generation, an interval, ...).")
    mean: list[float] | None = Field(description="Means of the best candidate, in multiples of nominal.")
    std: list[float] | None = Field(description="Standard deviations of the best candidate, in multiples of nominal.")
    correlation: list[list[float]] | None = Field(
        description="Correlation matrix of the best candidate; null unless correlations are fitted.")
    output_std: float | None = Field(description="Standard deviation of the output noise of the best candidate, in the "
                                                 "unit of the output.")
    log10_likelihood: float | None = Field(
        description="log10 likelihood of the best candidate as approximated in the search, densities per ms.")
    history: list[float | None] = Field(description="Best log10 likelihood after each generation.")


class FitWithProgress(Fit):
    """A fit with its progress."""

    ahead: Ahead
    missing_machine: MissingMachine = None
    progress: FitProgress | None = Field(description="Progress and best candidate; null before the first generation.")


class FitList(Page):
    """A list of fits."""

    fits: list[Fit] = Field(description="The fits, newest first.")


class FitCandidate(BaseModel):
    """A distribution of the inputs with an output noise, and the likelihood of the recordings (densities per ms)."""

    mean: list[float] = Field(description="Mean of each input, in multiples of nominal.")
    std: list[float] = Field(description="Standard deviation of each input, in multiples of nominal.")
    correlation: list[list[float]] | None = Field(
        description="Correlation matrix of the normal scores; null for independent inputs.")
    output_std: float = Field(description="Standard deviation of the output noise, in the unit of the output.")
    log10_likelihood: float | None = Field(
        description="Exact log10 likelihood, by integration of the model itself; null for minus infinity.")
    log10_likelihood_by_expansion: float | None = Field(
        description="log10 likelihood as approximated in the search; null for minus infinity.")


class Profile(BaseModel):
    """A profile-likelihood interval: the likelihood maximised over all other unknowns, as a function of one value."""

    estimate: float = Field(description="Value at the maximum of the likelihood.")
    lower: float | None = Field(
        description="Lower end; null if it is open (not determined by the recordings within the bounds) or unsettled.")
    upper: float | None = Field(
        description="Upper end; null if it is open (not determined by the recordings within the bounds) or unsettled.")
    unsettled: list[Literal["lower", "upper"]] = Field(
        description="Ends that could not be computed because the optimization did not converge. `curve` contains the "
                    "part of the profile that was computed.")
    level: float = Field(description="Confidence level.")
    curve: list[tuple[float, float]] = Field(
        description="Computed points of the profile: value, and decrease of the maximised log10 likelihood from its "
                    "maximum, in decades.")


class Interval(Profile):
    """Profile-likelihood interval of one unknown, in multiples of nominal or in the unit of the output."""

    unknown: str = Field(description="Name of the unknown.", examples=["mean of pressure_bias"])


class Combination(BaseModel):
    """A linear combination of the unknowns, and how well the recordings identify it."""

    weights: dict[str, float] = Field(
        description="Weight of each unknown, for unknowns scaled by the range between their bounds. The weights form a "
                    "vector of unit length.")
    std_error: float = Field(description="Standard error of the combination, with the unknowns scaled likewise.")
    identified: bool = Field(
        description="Whether the recordings determine the combination to within a quarter of its range; judged by "
                    "`interval` where it is given, otherwise by `std_error`.")
    interval: Profile | None = Field(
        description="Profile-likelihood interval of the combination; null if the standard error is too large or if "
                    "intervals were not requested.")


class Remark(BaseModel):
    """A limitation of the result, such as an unknown at a bound."""

    unknown: str = Field(description="The unknown or quantity concerned.")
    cause: str = Field(description="The limitation.")
    remedy: str = Field(description="How to remove the limitation.")
    at_bound: bool = Field(default=False, description="Whether the unknown is at a bound of the search, or at an edge "
                                                      "of the table.")


class FitSummary(BaseModel):
    """The fitted distribution of the inputs, its likelihood, and diagnostics."""

    axes: list[str] = Field(description="Names of the inputs; all lists with one entry per input have this order.")
    families: list[Family] = Field(description="Distribution family of each input.")
    support: list[tuple[float, float]] = Field(
        description="Range of each input that the model covers, in multiples of nominal.")
    method: Method = Field(description="Search method.")
    refined: bool = Field(
        description="Whether the best candidate of the search was refined. If not, it is the estimate itself.")
    mean: list[float] = Field(description="Fitted mean of each input, in multiples of nominal.")
    std: list[float] = Field(description="Fitted standard deviation of each input, in multiples of nominal.")
    correlation: list[list[float]] | None = Field(
        description="Fitted correlation matrix of the normal scores; null unless correlations are fitted.")
    output_std: float = Field(description="Fitted standard deviation of the output noise, in the unit of the output.")
    log10_likelihood: float | None = Field(
        description="Exact log10 likelihood (densities per ms), by integration of the model itself; null for minus "
                    "infinity.")
    log10_likelihood_per_condition: list[float | None] = Field(
        description="Contribution of each condition to the exact log10 likelihood.")
    expansion_error: float | None = Field(
        description="log10 likelihood as approximated in the search, minus the exact one, in decades.")
    sampling_error: float | None = Field(
        description="Estimated error of the exact log10 likelihood due to the choice of integration lines, in decades; "
                    "0 for one or two axes of a grid.")
    polynomial_error: float | None = Field(
        description="Error of the local polynomials that the refinement and the intervals use in place of the model, "
                    "in the unit of the output; null for normal inputs of a grid, for which they use the grid itself.")
    before: FitCandidate = Field(
        description="The nominal model with the output noise that explains its residuals best, for comparison.")
    searched: FitCandidate = Field(description="The best candidate of the search, before the refinement.")
    intervals: list[Interval] = Field(
        description="Profile-likelihood intervals of all unknowns; empty if they were not requested.")
    combinations: list[Combination] = Field(
        description="Linear combinations of the unknowns, from the best to the least identified.")
    mass_outside: MassOutside
    axis_mass_outside: list[float] = Field(
        description="Probability of each input, taken alone, outside the range that the model covers.")
    remarks: list[Remark] = Field(
        description="Limitations of the result: unknowns at a bound, inputs that extend outside the table, large "
                    "errors of local polynomials.")
    generations: int = Field(description="Completed generations, or blocks of the classic grid.")
    history: list[float | None] = Field(description="Best log10 likelihood of the search after each generation.")
    partial: Partial | None = Field(
        default=None, description="What is complete and what is missing, if the time budget ended before the fit; null "
                                  "if it is complete. Without the refinement, the estimate is the best candidate of "
                                  "the search.")


class PhysicalInput(BaseModel):
    """A fitted input in the unit of its parameter."""

    name: str = Field(description="Name of the input.")
    unit: str = Field(description="Unit of the values.")
    nominal: float = Field(description="Value of the parameter in the model; the multiple 1 corresponds to it.")
    mean: float = Field(description="Fitted mean.")
    std: float = Field(description="Fitted standard deviation.")


class FitResult(BaseModel):
    """The result of a finished fit."""

    id: str = Field(description="Id of the fit.")
    table: str = Field(description="Name of the table.")
    table_digest: TableDigest
    recordings: str = Field(description="Name of the recordings.")
    recordings_digest: RecordingsDigest
    result: FitSummary
    physical: list[PhysicalInput] = Field(description="The fitted inputs in their units, in the order of the inputs.")
    seconds: dict[str, float] = Field(description="Elapsed (wall-clock) time of each stage in s.")
    processor_seconds: dict[str, float] = Field(
        description="Processor time of each stage in s, summed over all threads of the worker.")
