"""What a study looks like on the wire: the request, its progress and its result."""

from typing import Any, Literal

from pydantic import BaseModel, Field

from service.jobs import Job
from service.schemas import RecordingsName, Strict
from slipstick.study.settings import StudySettings

Names = list[str] | None
_CHANNELS = "of pressure, input speed, output speed, output torque and shifting time; without signals of the last"


class StudySettingsBody(Strict):
    """How to study. What is left out takes its default, which the answer states."""

    seed: int | None = Field(default=None, le=2**53, description="The same seed gives the same result.")
    parameters: Names = Field(
        default=None, max_length=20, description="Parameters that are fitted together with every candidate.",
        examples=[["pressure_bias", "initial_position", "friction_coefficient"]])
    scatter: Names = Field(default=None, max_length=4, description="Those of them that also vary from run to run.",
                           examples=[["pressure_bias", "initial_position"]])
    widest_scatter: float | None = Field(
        default=None, description="Largest standard deviation from run to run, as a share of the nominal value.")
    catalogue: Names = Field(
        default=None, max_length=200, description="The effects to try, by the names of docs/effects.md.",
        examples=[["stribeck_friction", "centrifugal_pressure", "quadratic_load_drag"]])
    shortlist: int | None = Field(default=None, le=200, description="Candidates to fit after a screening, at most.")
    most_effects: int | None = Field(default=None, le=20, description="Effects to add, at most.")
    significance: float | None = Field(default=None, description="Largest p-value of a candidate.")
    smallest: float | None = Field(
        default=None, description="Signature in noise levels, RMS over all values, that a candidate must have.")
    shifting_time_noise: float | None = Field(
        default=None, description="Standard deviation of the measurement of the shifting time in s.")
    level: float | None = Field(default=None, description="Confidence level of the intervals.")

    def checked(self) -> StudySettings:
        """Return them with the defaults filled in; raises `InvalidValue`, `UnknownName`."""
        return StudySettings.from_dict(self.model_dump(exclude_none=True))


class StudyRequest(Strict):
    """What to study."""

    recordings: RecordingsName = "measured"
    settings: StudySettingsBody = Field(default_factory=lambda: StudySettingsBody(), description="How to study.")


class Study(Job):
    """A study and how far it is."""


class StudyProgress(BaseModel):
    """How far a study is. It goes round by round: screen the catalogue, fit the candidates, add the best."""

    stage: Literal["fit", "screen", "candidates", "choose", "conclude"] = Field(
        description="What is being done: the fit without any effect, the screening of the catalogue, the fits of the "
                    "candidates, the choice among these, or the result.")
    added: list[str] = Field(description="Effects added in earlier rounds.")
    effects: int = Field(description="Effects that this round screens.")
    candidates: int = Field(description="Candidates of this round; 0 before its screening.")
    fitted: int = Field(description="Candidates fitted so far.")
    candidate: str | None = Field(description="The candidate that is being fitted.")
    p_value: float | None = Field(description="That of the last screening.")


class FollowedStudy(Study):
    """A study with its progress."""

    progress: StudyProgress | None = Field(description="Null before the first step.")


class StudyList(BaseModel):
    """Studies, the newest first."""

    studies: list[Study] = Field(description="The newest first.")


class CoefficientEstimate(BaseModel):
    """A coefficient of an added effect."""

    effect: str = Field(description="Name of the effect.")
    coefficient: str = Field(description="Name of the coefficient.")
    unit: str = Field(description="Its unit.")
    value: float = Field(description="Estimate.")
    lower: float = Field(description="Lower end of its interval, of the settings' `level`.")
    upper: float = Field(description="Upper end of its interval.")
    at_bound: bool = Field(description="Whether it lies at a bound of its range; the interval then means little.")


class LeftOver(BaseModel):
    """What an answer does not explain."""

    signal: str = Field(description="The signal that shows most of it.")
    noise_levels: float = Field(description="RMS of its residuals in units of its noise: 1 is nothing.")


class Form(BaseModel):
    """A form that an open term may have."""

    quantity: str = Field(description="Quantity of the model that the term is in.")
    form: str = Field(description="What it grows with.")
    share: float = Field(description="Share of random halves of the experiments in which it promises most.")


class Answer(BaseModel):
    """What is missing from the model."""

    kind: Literal["none", "effect", "tie", "several", "unlisted", "not converged"] = Field(
        description="`none`: nothing that the recordings could show; `effect`: one; `tie`: one of several that the "
                    "recordings do not tell apart; `several`: one after the other; `unlisted`: something that no "
                    "effect of the catalogue explains, with an open term if one does; `not converged`: no answer.")
    effects: list[str] = Field(description="The effects added, in their order.")
    tied: list[list[str]] = Field(description="For each of them, all that the recordings do not tell apart from it.")
    sentence: str = Field(description="The answer in words.")
    coefficients: list[CoefficientEstimate] = Field(description="Of all added effects, fitted together.")
    forms: list[Form] = Field(description="Of an open term the forms that the recordings allow, the most often chosen "
                                          "first: the data support no more digits than these have in common.")
    block: str | None = Field(description="Where the first of them acts, or where most is left that nothing explains.")
    confidence: float | None = Field(
        description="How often the first name, or one tied with it, was right in studies of hidden effects with "
                    "evidence of this kind: not how probable it is for your bench. Null where no effect is named.")
    evidence: Literal["clear", "a rival near", "something left over"] | None = Field(
        description="Kind of evidence: no untied effect predicts as well to three standard errors; one does; or "
                    "something is left over that nothing explains.")
    left: LeftOver | None = Field(description="What is still there with all effects added; null: no more than noise "
                                              "and scatter of other parameters leave.")


class Screened(BaseModel):
    """The strongest probe of an effect: a small move of one coefficient away from neutral, in linear approximation."""

    effect: str = Field(description="Name of the effect.")
    coefficient: str = Field(description="The coefficient that is moved.")
    shape: dict[str, float] = Field(description="Coefficient of its shape -> value at which it was tried.")
    statistic: float = Field(description="Score statistic, one observation an experiment.")
    p_value: float = Field(description="Share of replicates of the fitted model in which any statistic is as large.")
    gain: float = Field(description="What the natural log-likelihood would rise by.")
    estimate: float = Field(description="The coefficient where it would be greatest, in typical values.")
    kept: float = Field(description="Share of its signature that a refit of everything else leaves.")
    signature: float = Field(description="What is left of it in the recordings, RMS over all values in noise levels.")
    selected: float = Field(description="Share of random halves of the experiments in which it promises most.")


class Candidate(BaseModel):
    """An effect fitted jointly with parameters and scatter."""

    effect: str = Field(description="Name of the effect.")
    title: str = Field(description="Its name in words.")
    block: str = Field(description="Block of the model that it acts in.")
    held_out_gain: float = Field(
        description="Mean rise of the natural log-likelihood of an experiment that its fit has not seen.")
    error: float = Field(description="Standard error of that mean.")
    sure: float = Field(description="How sure the experiments are that it is a rise: the mean in standard errors, each "
                                    "experiment counted as log(1 + nats) with its sign.")
    behind: float = Field(description="How far it trails the best, counted alike; 0 if the most say it is ahead.")
    tied: bool = Field(description="Whether it cannot be told apart from the best with what this round has added; "
                                   "the answer's `tied` counts what was added later too.")
    bootstrap_share: float = Field(description="How often it is the best in a bootstrap over experiments.")
    bic: float = Field(description="Rise of the BIC over the fit without it, one observation an experiment.")
    rise: float = Field(description="Rise of the natural log-likelihood that it was fitted to.")
    converged: bool = Field(description="Whether its fit converged.")
    noise: list[float] = Field(description=f"Residuals over the sensor's noise: {_CHANNELS}.")
    coefficients: list[CoefficientEstimate] = Field(description="Of all added effects and of this one.")


class Round(BaseModel):
    """One round: the fit with the effects added so far, the screening there, and the candidates for the next."""

    added: list[str] = Field(description="Effects in the fit of this round.")
    p_value: float | None = Field(description="Of the largest score statistic; null where nothing was screened.")
    screening: list[Screened] = Field(description="The effects, the most promising first.")
    ranking: list[Candidate] = Field(description="The candidates, the best first; none where nothing is missing.")
    parameters: dict[str, float] = Field(description="Fitted parameter -> multiple of its nominal value.")
    scatter: dict[str, float] = Field(description="Parameter -> standard deviation from run to run, as a multiple.")
    noise: list[float] = Field(description=f"Residuals over the sensor's noise, 1 where it is all: {_CHANNELS}.")
    converged: bool = Field(description="Whether the fit of this round converged.")


class ChiSquare(BaseModel):
    """Chi-square of the experiments that share a condition."""

    value: float = Field(description="The condition's value; of the run order, its third from 0.")
    chi_square: float | None = Field(description="Mean square in noise levels; 1 is noise. Null where nothing is.")


class Worst(BaseModel):
    """Where the model disagrees most."""

    block: str = Field(description="Block of the model, by the signal that it predicts.")
    phase: str = Field(description="Phase of the engagement: fill, film, slip or stick.")
    chi_square: float = Field(description="Chi-square per value there.")


class Where(BaseModel):
    """Where model and recordings disagree, each block driven by measured inputs, at the fit without any effect."""

    chi_square: dict[str, dict[str, float | None]] = Field(
        description="Block -> phase -> chi-square per value; 1 is noise, null where the block says nothing.")
    worst: Worst = Field(description="The largest of them.")
    by_condition: dict[str, list[ChiSquare]] = Field(description="Operating condition -> that block and phase by it.")


class Closure(BaseModel):
    """The gap in one signal or the shifting time, on conditions that the fit has not seen, in their units."""

    rms_before: float = Field(description="RMS error without the effect.")
    rms_after: float = Field(description="RMS error with it.")
    rms_expected: float = Field(description="What sensor noise and scatter would leave of a right model.")
    closure: float | None = Field(description="Share of the gap that is closed; null where there is none to close.")
    lower: float | None = Field(description="Lower end of its 90 % interval, over experiments.")
    upper: float | None = Field(description="Upper end of its 90 % interval.")


class Control(BaseModel):
    """What the best-scoring effect outside the named class closes."""

    effect: str = Field(description="Name of that effect.")
    closures: dict[str, Closure] = Field(description="Signal -> gap.")


class Gap(BaseModel):
    """The gap before and after the effects are added."""

    closures: dict[str, Closure] = Field(description="Signal, or `shifting_time` -> gap.")
    before: list[float] = Field(description="Held-out shifting time of each experiment in s, without the effects.")
    after: list[float] = Field(description="The same with them.")
    control: Control | None = Field(description="Null where no other effect was fitted.")


class FurtherExperiment(BaseModel):
    """An experiment in which the effects of a tie predict different things."""

    current_profile: int = Field(description="Current profile, by its number in the recordings.")
    motor_speed: float = Field(description="Motor speed in rad/s.")
    load_inertia: float = Field(description="Load inertia in kg m^2.")
    brake_torque: float = Field(description="Brake torque in N m.")
    recorded: bool = Field(description="Whether the recordings have this condition already.")
    apart: float = Field(description="How far the first effect and the one nearest to it predict apart, RMS in noise "
                                     "levels, after what scatter from run to run can hide.")
    signal: str = Field(description="Signal, or `shifting_time`, that tells most of it.")
    repetitions: int | None = Field(description="Runs that tell them apart by five standard errors, everything else "
                                                "refitted; null where a thousand are too few.")


class FurtherExperiments(BaseModel):
    """Which experiments would tell the effects of a tie apart, the best first."""

    effects: list[str] = Field(description="The effects that the recordings do not tell apart.")
    experiments: list[FurtherExperiment] = Field(
        description="The best of each current profile and motor speed, up to a fifth beyond the recorded range; the "
                    "best that was recorded is among them.")


class Models(BaseModel):
    """The fitted models, each as `--model` of the worker's `build` reads it."""

    before: dict[str, Any] = Field(description="Without any effect.")
    after: dict[str, Any] = Field(description="With the effects added.")


class Studied(BaseModel):
    """What a study found."""

    answer: Answer
    settings_digest: str = Field(description="SHA-256 of the settings.")
    recordings_digest: str = Field(description="SHA-256 of the recordings.")
    experiments: int = Field(description="Number of experiments: the observations of every test.")
    noise: dict[str, float] = Field(description="Signal, or `shifting_time` -> standard deviation of its sensor.")
    stopped: str = Field(description="Why the study ended.")
    rounds: list[Round] = Field(description="The rounds, in their order.")
    models: Models
    where: Where | None = Field(description="Null without signals.")
    gap: Gap | None = Field(description="Null where nothing was added.")
    further: list[FurtherExperiments] = Field(description="One an answer that is a tie; empty where there is none.")


class StudyResult(BaseModel):
    """The result of a study, and what it was computed from."""

    id: str = Field(description="Id of the study.")
    recordings: str = Field(description="Name of the recordings.")
    recordings_digest: str = Field(description="Digest (SHA-256) of the recordings.")
    result: Studied
    seconds: dict[str, float] = Field(description="Time in s spent in each stage, by the clock on the wall.")
    processor_seconds: dict[str, float] = Field(description="Processor time in s, of all threads of the worker.")


class ModelSpec(BaseModel):
    """A model as JSON: what `python -m worker build --model FILE` builds a table of."""

    parameters: dict[str, float] = Field(description="Parameter -> value in its unit.")
    units: dict[str, str] = Field(description="Parameter -> unit.")
    effects: dict[str, dict[str, float]] = Field(description="Effect -> coefficient -> value.")
    torque_converter: dict[str, list[float]] = Field(description="Curves of the torque converter.")
