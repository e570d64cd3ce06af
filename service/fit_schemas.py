"""What a fit looks like on the wire: the request, its progress and its result."""

import datetime
from typing import Any, Literal

from pydantic import BaseModel, Field

from service.schemas import MassOutside, OutsidePolicy, RecordingsName, Strict, TableDigest, TableName
from slipstick.uncertainty.expansion import HIGHEST_ORDER
from slipstick.uncertainty.fit import FitSettings

Bounds = list[tuple[float, float]]
Status = Literal["queued", "running", "done", "failed", "cancelled"]


class SearchSettings(Strict):
    """How to search. What is left out takes its default, which the answer states."""

    seed: int | None = Field(default=None, ge=0, le=2**53, description="The same seed gives the same result.")
    population: int | None = Field(default=None, le=1000, description="Candidates a generation.")
    generations: int | None = Field(default=None, le=10_000, description="Most generations.")
    patience: int | None = Field(default=None, le=10_000, description="Generations without improvement to stop after.")
    tolerance: float | None = Field(default=None, description="Smallest improvement that counts, in decades.")
    order: int | None = Field(default=None, le=HIGHEST_ORDER, description="Total degree of the expansions.")
    nodes: int | None = Field(default=None, le=60, description="Gauss nodes an axis; more than `order`.")
    samples: int | None = Field(default=None, le=1 << 15, description="Samples of the germ, a power of two.")
    polish: bool | None = Field(default=None, description="Whether to polish the best on the exact likelihood.")
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
    recordings: RecordingsName = "measured"
    outside: OutsidePolicy = "clip"
    settings: SearchSettings = Field(default_factory=lambda: SearchSettings(), description="How to search.")


class Fit(BaseModel):
    """A fit and how far it is."""

    id: str = Field(description="Id of the fit.")
    status: Status = Field(description="queued, running, done, failed or cancelled.")
    note: str | None = Field(description="What to do where there is something to do.")
    problem: str | None = Field(description="Why the fit failed, and what to do.")
    table: str = Field(description="Name of the table.")
    table_digest: TableDigest
    recordings: str = Field(description="Name of the recordings.")
    recordings_digest: str = Field(description="Digest (SHA-256) of the recordings.")
    outside: OutsidePolicy
    settings: dict[str, Any] = Field(description="All settings of the search.")
    submitted: datetime.datetime | None = Field(description="When the fit was submitted (UTC).")
    ended: datetime.datetime | None = Field(description="When it ended (UTC).")
    links: dict[str, str] = Field(description="What can be done with it -> address.")


class Progress(BaseModel):
    """How far a fit is."""

    stage: Literal["search", "polish"] = Field(description="The genetic algorithm, or the polish of its best.")
    generation: int = Field(description="Generations done.")
    generations: int = Field(description="Most generations there will be.")
    polish_runs: int = Field(description="How often the polish has run the model.")
    mean: list[float] = Field(description="Means of the best candidate so far, in multiples of nominal.")
    std: list[float] = Field(description="Its stds in multiples of nominal.")
    output_std: float = Field(description="Its output noise in s.")
    log10_likelihood: float = Field(description="Its log10 likelihood by expansion, densities per ms.")
    history: list[float] = Field(description="The best log10 likelihood after each generation.")


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
    output_std: float = Field(description="Standard deviation of the output noise in s.")
    log10_likelihood: float | None = Field(description="Exact, with the table asked at every sample; null is -inf.")
    log10_likelihood_by_expansion: float | None = Field(description="By expansion; null is -inf.")


class Remark(BaseModel):
    """Something to know about a result."""

    unknown: str = Field(description="What it is about.")
    cause: str = Field(description="What is the case.")
    remedy: str = Field(description="What helps.")


class Fitted(BaseModel):
    """What a fit found."""

    mean: list[float] = Field(description="Fitted mean of each input in multiples of nominal.")
    std: list[float] = Field(description="Fitted standard deviation of each input in multiples of nominal.")
    output_std: float = Field(description="Fitted standard deviation of the output noise in s.")
    log10_likelihood: float | None = Field(
        description="Exact log10 likelihood, densities per ms, with the table asked at every sample; null is -inf.")
    log10_likelihood_per_condition: list[float | None] = Field(description="The same, condition by condition.")
    expansion_error: float | None = Field(description="What the expansion adds to it, in decades.")
    sampling_error: float | None = Field(description="What other samples add to it, in decades.")
    before: Candidate = Field(description="The nominal model with the noise that explains the residuals best.")
    genetic: Candidate = Field(description="The best of the genetic algorithm, before the polish.")
    mass_outside: MassOutside
    axis_mass_outside: list[float] = Field(description="Probability of each input outside the table.")
    nodes_outside: int = Field(description="Nodes of the expansion that lie outside the table.")
    nodes: int = Field(description="Nodes of the expansion.")
    remarks: list[Remark] = Field(description="Unknowns at a bound, inputs that leave the table, and what helps.")
    generations: int = Field(description="Generations done.")
    history: list[float] = Field(description="The best log10 likelihood by expansion after each generation.")


class FitResult(BaseModel):
    """The result of a fit, and what it was computed from."""

    id: str = Field(description="Id of the fit.")
    table: str = Field(description="Name of the table.")
    table_digest: TableDigest
    recordings: str = Field(description="Name of the recordings.")
    recordings_digest: str = Field(description="Digest (SHA-256) of the recordings.")
    result: Fitted
    seconds: dict[str, float] = Field(description="Time in s spent opening the files, in the search, in the polish.")
