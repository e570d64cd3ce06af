"""What a fit looks like on the wire: the request, its progress and its result."""

from typing import Literal

from pydantic import BaseModel, Field

from service.jobs import Job
from service.schemas import MassOutside, OutsidePolicy, RecordingsName, Strict, TableDigest, TableName
from slipstick.uncertainty.chaos import HIGHEST_ORDER, Family, Rule
from slipstick.uncertainty.fit import FitSettings
from slipstick.uncertainty.fit.settings import Integration, Method

Bounds = list[tuple[float, float]]


class SearchSettings(Strict):
    """How to search. What is left out takes its default, which the answer states."""

    seed: int | None = Field(default=None, ge=0, le=2**53, description="The same seed gives the same result.")
    families: list[Family] | None = Field(
        default=None, max_length=20, description="Family of the inputs: one for all, or one each. A beta input "
                                                 "lives on the range that the model covers.")
    correlated: bool | None = Field(default=None, description="Whether to fit correlations of the inputs too.")
    method: Method | None = Field(
        default=None, description="`genetic`: expansions and a genetic algorithm. `classic`: samples of the model "
                                  "for all candidates of a grid, the benchmark of the paper; its cost grows with the "
                                  "power of the unknowns.")
    population: int | None = Field(default=None, le=1000, description="Candidates a generation.")
    generations: int | None = Field(default=None, le=10_000, description="Most generations.")
    patience: int | None = Field(default=None, le=10_000, description="Generations without improvement to stop after.")
    tolerance: float | None = Field(default=None, description="Smallest improvement that counts, in decades.")
    order: int | None = Field(default=None, le=HIGHEST_ORDER, description="Total degree of the expansions.")
    norm: float | None = Field(default=None, description="1 keeps the total degree, less drops interactions.")
    rule: Rule | None = Field(default=None, description="`tensor` grid, or `regression`, better for three inputs on.")
    nodes: int | None = Field(default=None, le=60, description="Gauss nodes an axis; more than `order`.")
    runs: int | None = Field(default=None, le=20_000, description="Model runs for each expansion by regression.")
    integration: Integration | None = Field(
        default=None, description="How a search integrates the expansions: along `lines`, or by `sampling` as in the "
                                  "paper.")
    samples: int | None = Field(default=None, le=1 << 15, description="Samples of the germ, a power of two.")
    grid: int | None = Field(default=None, le=100, description="Values of each unknown for the method `classic`.")
    refine: bool | None = Field(default=None, description="Whether to climb on from the best on the exact likelihood.")
    intervals: bool | None = Field(default=None, description="Whether to add profile-likelihood intervals.")
    level: float | None = Field(default=None, description="Confidence level of the intervals.")
    mean_bounds: Bounds | None = Field(
        default=None, description="Bounds of the means in multiples of nominal: one pair an axis, or one pair for all.")
    std_bounds: Bounds | None = Field(
        default=None, description="Bounds of the stds in multiples of nominal: one pair an axis, or one pair for all.")
    output_std_bounds: tuple[float, float] | None = Field(default=None, description="Bounds of the output noise in s.")

    def checked(self) -> FitSettings:
        """Return them with the defaults filled in; raises `InvalidValue`."""
        return FitSettings.from_dict(self.model_dump(exclude_none=True))


class FitRequest(Strict):
    """What to fit to what."""

    table: TableName = "nominal"
    simulate: bool = Field(
        default=False, description="Whether to run the simulator itself instead of interpolating: the model of the "
                                   "table, with any of its parameters as inputs, each within 0.5 to 1.5 times its "
                                   "value (the initial piston position 0.1 to 3) and held at these edges beyond.")
    parameters: list[str] | None = Field(
        default=None, min_length=1, max_length=20, examples=[["pressure_bias", "initial_position"]],
        description="The uncertain inputs; the others keep their value. All axes of the table unless said otherwise.")
    recordings: RecordingsName = "measured"
    outside: OutsidePolicy = "clip"
    settings: SearchSettings = Field(default_factory=lambda: SearchSettings(), description="How to search.")


class Fit(Job):
    """A fit and how far it is."""

    table: str = Field(description="Name of the table.")
    table_digest: TableDigest
    simulate: bool = Field(description="Whether the simulator is run instead of the table.")
    parameters: list[str] = Field(description="The uncertain inputs.")
    outside: OutsidePolicy


class Progress(BaseModel):
    """How far a fit is."""

    stage: Literal["search", "refine", "intervals", "conclude"] = Field(description="What is being done.")
    generation: int = Field(description="Generations done, or blocks of the classic grid.")
    generations: int = Field(description="Most generations there will be.")
    model_runs: int = Field(description="How often the present generation, interval or other step has asked the model.")
    mean: list[float] | None = Field(description="Means of the best candidate so far, in multiples of nominal.")
    std: list[float] | None = Field(description="Its stds in multiples of nominal.")
    correlation: list[list[float]] | None = Field(description="Its correlations, where they are fitted.")
    output_std: float | None = Field(description="Its output noise in s.")
    log10_likelihood: float | None = Field(description="Its log10 likelihood in the search, densities per ms.")
    history: list[float | None] = Field(description="The best log10 likelihood after each generation.")


class FollowedFit(Fit):
    """A fit with its progress."""

    progress: Progress | None = Field(description="Progress and best so far; null before the first generation.")


class FitList(BaseModel):
    """Fits, the newest first."""

    fits: list[Fit] = Field(description="The newest first.")


class Candidate(BaseModel):
    """Inputs and noise, and the likelihood of the recordings under them (densities per ms)."""

    mean: list[float] = Field(description="Mean of each input in multiples of nominal.")
    std: list[float] = Field(description="Standard deviation of each input in multiples of nominal.")
    correlation: list[list[float]] | None = Field(description="Correlation of the normal scores; null for none.")
    output_std: float = Field(description="Standard deviation of the output noise in s.")
    log10_likelihood: float | None = Field(description="Exact, with the model itself integrated; null is -inf.")
    log10_likelihood_by_expansion: float | None = Field(description="As the search takes it; null is -inf.")


class Profile(BaseModel):
    """A profile-likelihood interval: the greatest likelihood at each value, all else free."""

    estimate: float = Field(description="The value at the greatest likelihood.")
    lower: float | None = Field(description="Lower end; null where the recordings set none within the bounds.")
    upper: float | None = Field(description="Upper end; null where the recordings set none within the bounds.")
    unsettled: list[Literal["lower", "upper"]] = Field(
        description="Ends that are null because they were not found: the profile was followed as far as `curve` goes.")
    level: float = Field(description="Confidence level.")
    curve: list[tuple[float, float]] = Field(
        description="Value and drop of the greatest log10 likelihood at it, in decades, of the points computed.")


class Interval(Profile):
    """The profile-likelihood interval of one unknown, in multiples of nominal or in s."""

    unknown: str = Field(description="Name of the unknown.", examples=["mean of pressure_bias"])


class Combination(BaseModel):
    """A combination of the unknowns, from the best identified to the least."""

    weights: dict[str, float] = Field(
        description="Weight of each unknown, of unit length together, as a share of the range between its bounds.")
    std_error: float = Field(description="Standard error along it, as a share of the ranges.")
    identified: bool = Field(
        description="Whether the recordings determine it to a quarter of its range: by its interval, where it has one.")
    interval: Profile | None = Field(
        description="Of the sum of the unknowns over their ranges, so weighted; null unless the standard error "
                    "calls for it and intervals were asked for.")


class Remark(BaseModel):
    """Something to know about a result."""

    unknown: str = Field(description="What it is about.")
    cause: str = Field(description="What is the case.")
    remedy: str = Field(description="What helps.")


class Fitted(BaseModel):
    """What a fit found."""

    axes: list[str] = Field(description="The uncertain inputs, in the order of all that follows.")
    families: list[Family] = Field(description="Their families.")
    support: list[tuple[float, float]] = Field(description="What the model covers of each, multiples of nominal.")
    method: Method = Field(description="How the search was done.")
    refined: bool = Field(description="Whether the best of the search was refined; if not, the fit is that best.")
    mean: list[float] = Field(description="Fitted mean of each input in multiples of nominal.")
    std: list[float] = Field(description="Fitted standard deviation of each input in multiples of nominal.")
    correlation: list[list[float]] | None = Field(description="Fitted correlation of the normal scores; null for none.")
    output_std: float = Field(description="Fitted standard deviation of the output noise in s.")
    log10_likelihood: float | None = Field(
        description="Exact log10 likelihood, densities per ms, with the model itself integrated; null is -inf.")
    log10_likelihood_per_condition: list[float | None] = Field(description="The same, condition by condition.")
    expansion_error: float | None = Field(description="What the likelihood of the search adds to it, in decades.")
    sampling_error: float | None = Field(
        description="What other lines change in it, in decades: 0 for one or two axes of a table.")
    polynomial_error: float | None = Field(
        description="Error in s of the polynomials on which the refinement and the intervals rest; null for normal "
                    "inputs of a table, where they rest on the table itself.")
    before: Candidate = Field(description="The nominal model with the noise that explains the residuals best.")
    searched: Candidate = Field(description="The best of the search, before the refinement.")
    intervals: list[Interval] = Field(description="Profile-likelihood intervals of all unknowns, if asked for.")
    combinations: list[Combination] = Field(description="What the recordings identify, the best first.")
    mass_outside: MassOutside
    axis_mass_outside: list[float] = Field(description="Probability of each input outside what the model covers.")
    remarks: list[Remark] = Field(description="Unknowns at a bound, inputs that leave the table, and what helps.")
    generations: int = Field(description="Generations done.")
    history: list[float | None] = Field(description="The best log10 likelihood of the search after each generation.")


class FitResult(BaseModel):
    """The result of a fit, and what it was computed from."""

    id: str = Field(description="Id of the fit.")
    table: str = Field(description="Name of the table.")
    table_digest: TableDigest
    recordings: str = Field(description="Name of the recordings.")
    recordings_digest: str = Field(description="Digest (SHA-256) of the recordings.")
    result: Fitted
    seconds: dict[str, float] = Field(description="Time in s spent in each stage, by the clock on the wall.")
    processor_seconds: dict[str, float] = Field(description="Processor time in s, of all threads of the worker.")
