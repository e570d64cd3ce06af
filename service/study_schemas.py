"""Request and response bodies of studies."""

from typing import Any, Literal

from pydantic import BaseModel, Field

from service.jobs import Job
from service.schemas import BenchName, RecordingsDigest, RecordingsName, StrictModel
from slipstick.study.settings import StudySettings

Names = list[str] | None
_CHANNELS = "pressure, input speed, output speed, output torque and shifting time (recordings without signals: only " \
            "the last)"


class StudySettingsBody(StrictModel):
    """Settings of a study. Omitted settings have default values, which the response reports."""

    seed: int | None = Field(default=None, le=2**53,
                             description="Seed of the random numbers; the same seed gives the same result.")
    parameters: Names = Field(
        default=None, max_length=20, description="Parameters that are fitted together with every candidate effect.",
        examples=[["pressure_bias", "initial_position", "friction_coefficient"]])
    scatter: Names = Field(
        default=None, max_length=4, description="Those of the `parameters` that also vary from run to run.",
        examples=[["pressure_bias", "initial_position"]])
    widest_scatter: float | None = Field(
        default=None, description="Upper bound of the standard deviation from run to run, in multiples of nominal.")
    catalogue: Names = Field(
        default=None, max_length=200, description="Effects to consider; by default the whole catalogue "
                                                  "(docs/effects.md).",
        examples=[["stribeck_friction", "centrifugal_pressure", "quadratic_load_drag"]])
    shortlist: int | None = Field(default=None, le=200,
                                  description="Maximum number of candidates that the screening selects.")
    most_effects: int | None = Field(default=None, le=20,
                                     description="Maximum number of effects that are added to the model.")
    significance: float | None = Field(
        default=None, description="Significance level: largest p-value with which the screening selects an effect as a "
                                  "candidate.")
    smallest: float | None = Field(
        default=None, description="Smallest signature with which the screening selects an effect: RMS change over all "
                                  "compared values, in units of the noise.")
    shifting_time_noise: float | None = Field(
        default=None, description="Standard deviation of the measurement error of shifting times in s.")
    level: float | None = Field(default=None, description="Confidence level of the intervals.")

    def checked(self) -> StudySettings:
        """Return complete settings, with default values filled in; raises `InvalidValue`, `UnknownName`."""
        return StudySettings.from_dict(self.model_dump(exclude_none=True))


class StudyRequest(StrictModel):
    """A study of recordings."""

    recordings: RecordingsName = "measured"
    bench: BenchName = None
    settings: StudySettingsBody = Field(default_factory=lambda: StudySettingsBody(),
                                        description="Settings of the study.")


class Study(Job):
    """A study without its progress and result."""

    bench: str = Field(description="Name of the bench.")
    bench_digest: str = Field(description="SHA-256 digest of the physics of the bench.")
    sensing_digest: str = Field(description="SHA-256 digest of the sensors and priors of the bench.")


class StudyProgress(BaseModel):
    """Progress of a study. Each round screens the catalogue, fits the candidates and adds the best one to the model."""

    stage: Literal["fit", "screen", "candidates", "choose", "conclude"] = Field(
        description="Current stage: the fit without any effect, the screening of the catalogue, the fits of the "
                    "candidates, the choice among them, or the assembly of the result.")
    added: list[str] = Field(description="Effects added in previous rounds.")
    effects: int = Field(description="Number of effects screened in this round.")
    candidates: int = Field(description="Number of candidates in this round; 0 before the screening.")
    fitted: int = Field(description="Number of candidates fitted so far.")
    candidate: str | None = Field(description="The candidate whose fit is running; null in other stages.")
    p_value: float | None = Field(description="p-value of the latest screening; null before the first one.")


class StudyWithProgress(Study):
    """A study with its progress."""

    progress: StudyProgress | None = Field(description="Progress; null before the first step.")


class StudyList(BaseModel):
    """A list of studies."""

    studies: list[Study] = Field(description="The studies, newest first.")


class CoefficientEstimate(BaseModel):
    """Estimate of a coefficient of an effect."""

    effect: str = Field(description="Name of the effect.")
    coefficient: str = Field(description="Name of the coefficient.")
    unit: str = Field(description="Unit of the coefficient.")
    value: float = Field(description="Estimate.")
    lower: float = Field(description="Lower end of the confidence interval; its level is the setting `level`.")
    upper: float = Field(description="Upper end of the confidence interval.")
    at_bound: bool = Field(description="Whether the estimate is at a bound of its range; the interval is then "
                                       "unreliable.")


class RemainingMisfit(BaseModel):
    """A misfit that remains after all named effects have been added."""

    signal: str = Field(description="The signal with the largest misfit.")
    noise_levels: float = Field(description="RMS of its residuals in units of the sensor noise; 1 means noise only.")


class OpenTermForm(BaseModel):
    """A possible form of an open term, that is, of a power of a measured signal added to a quantity of the model."""

    quantity: str = Field(description="Quantity of the model to which the term is added.")
    form: str = Field(description="Function of a measured signal to which the term is proportional.")
    share: float = Field(description="Fraction of random halves of the experiments in which this form has the largest "
                                     "predicted improvement.")


class StudyAnswer(BaseModel):
    """The answer of a study: which physical effects are missing from the model."""

    kind: Literal["none", "effect", "tie", "several", "unlisted", "not converged"] = Field(
        description="`none`: the recordings show no missing effect. `effect`: one effect is missing. `tie`: one of "
                    "several effects is missing, which the recordings cannot distinguish. `several`: more than one "
                    "effect is missing. `unlisted`: something is missing that no effect of the catalogue "
                    "explains; an open term may describe it. `not converged`: the fit without any effect did not "
                    "converge, so there is no answer.")
    effects: list[str] = Field(description="The effects added to the model, in the order in which they were added.")
    tied: list[list[str]] = Field(description="For each added effect, the effects that the recordings cannot "
                                              "distinguish from it, including itself.")
    sentence: str = Field(description="The answer in words.")
    coefficients: list[CoefficientEstimate] = Field(description="Coefficients of all added effects, fitted jointly.")
    forms: list[OpenTermForm] = Field(
        description="Forms of an open term that the recordings support, most frequently selected first; the recordings "
                    "do not distinguish between them.")
    block: str | None = Field(description="Block of the model in which the first effect acts, or that has the largest "
                                          "unexplained misfit.")
    confidence: float | None = Field(
        description="Fraction of benchmark studies in which the first name, or a name tied with it, was correct, among "
                    "studies of known hidden effects with the same kind of evidence. It is not the probability that "
                    "the answer is correct for your test bench. Null if no effect is named.")
    evidence: Literal["clear", "a rival near", "something left over"] | None = Field(
        description="Kind of evidence. `clear`: no other effect, apart from tied ones, predicts held-out experiments "
                    "equally well to within three standard errors. `a rival near`: there is such an effect. "
                    "`something left over`: a misfit remains that no effect explains. Null if no effect is named.")
    left: RemainingMisfit | None = Field(
        description="Misfit that remains with all effects added; null if it does not exceed what noise and scatter "
                    "produce.")


class ScreenedEffect(BaseModel):
    """Screening result of an effect, for the coefficient and shape with the largest predicted improvement.

    The screening linearises the model about the neutral value of the coefficient.
    """

    effect: str = Field(description="Name of the effect.")
    coefficient: str = Field(description="Coefficient that is varied.")
    shape: dict[str, float] = Field(description="Values of the shape coefficients of the effect, by name.")
    statistic: float = Field(description="Score statistic, with each experiment as one observation.")
    p_value: float = Field(description="Fraction of data sets simulated from the fitted model in which the largest "
                                       "statistic of any effect is at least as large.")
    gain: float = Field(description="Predicted improvement of the natural log-likelihood.")
    estimate: float = Field(description="Predicted estimate of the coefficient, in units of its typical value.")
    kept: float = Field(description="Fraction of the signature that remains when all other parameters are refitted.")
    signature: float = Field(description="Remaining signature: RMS change over all compared values, in units of the "
                                         "noise.")
    selected: float = Field(description="Fraction of random halves of the experiments in which this effect has the "
                                        "largest predicted improvement.")


class RankedCandidate(BaseModel):
    """A candidate effect, fitted jointly with parameters and scatter and compared with the fit without it."""

    effect: str = Field(description="Name of the effect.")
    title: str = Field(description="Title of the effect.")
    block: str = Field(description="Block of the model in which the effect acts.")
    held_out_gain: float = Field(description="Mean improvement of the held-out natural log-likelihood per experiment.")
    error: float = Field(description="Standard error of `held_out_gain`.")
    sure: float = Field(
        description="Significance of the improvement d: mean of sign(d) log(1 + |d|) over the experiments divided by "
                    "its standard error, with d in nats. The logarithm limits the influence of single experiments.")
    behind: float = Field(description="Deficit to the best candidate in standard errors, computed in the same way; at "
                                      "least 0.")
    tied: bool = Field(description="Whether the recordings cannot distinguish the candidate from the best one of this "
                                   "round. The `tied` field of the answer also accounts for effects added later.")
    bootstrap_share: float = Field(description="Fraction of bootstrap samples of the experiments in which the "
                                               "candidate is the best.")
    bic: float = Field(description="Change of the Bayesian information criterion, with each experiment as one "
                                   "observation; negative values favour the candidate.")
    rise: float = Field(description="Improvement of the maximised natural log-likelihood (not held out).")
    converged: bool = Field(description="Whether the fit of the candidate converged.")
    noise: list[float] = Field(description=f"RMS of the residuals in units of the sensor noise: {_CHANNELS}.")
    coefficients: list[CoefficientEstimate] = Field(description="Coefficients of all previously added effects and of "
                                                                "the candidate.")


class Round(BaseModel):
    """One round: the fit with the effects added so far, the screening at this fit, and the resulting candidates."""

    added: list[str] = Field(description="Effects in the fit of this round.")
    p_value: float | None = Field(description="p-value of the largest score statistic; null if the round has no "
                                              "screening.")
    screening: list[ScreenedEffect] = Field(description="Screened effects, largest predicted improvement first.")
    ranking: list[RankedCandidate] = Field(description="Fitted candidates, best first; empty if there are none.")
    parameters: dict[str, float] = Field(description="Fitted parameters, in multiples of nominal, by name.")
    scatter: dict[str, float] = Field(description="Standard deviation from run to run, in multiples of nominal, by "
                                                  "name of the parameter.")
    noise: list[float] = Field(description="RMS of the residuals in units of the sensor noise, where 1 means noise "
                                           f"only: {_CHANNELS}.")
    converged: bool = Field(description="Whether the fit of this round converged.")


class ConditionChiSquare(BaseModel):
    """Chi-square of the experiments with the same value of an operating condition."""

    value: float = Field(description="Value of the condition. For the run order: 0, 1 or 2 for the first, second or "
                                     "last third of the runs.")
    chi_square: float | None = Field(description="Chi-square per value; 1 means noise only. Null if no value is "
                                                 "available.")


class LargestMisfit(BaseModel):
    """The block and phase in which model and recordings disagree most."""

    block: str = Field(description="Block of the model, named after the signal that it predicts.")
    phase: str = Field(description="Phase of the engagement: fill, film, slip or stick.")
    chi_square: float = Field(description="Chi-square per value.")


class MisfitLocation(BaseModel):
    """Where model and recordings disagree, for the fit without any effect.

    Each block of the model is simulated on its own, with measured signals as its inputs.
    """

    chi_square: dict[str, dict[str, float | None]] = Field(
        description="Chi-square per value by block and phase; 1 means noise only, null that no value is available.")
    worst: LargestMisfit = Field(description="Block and phase with the largest chi-square.")
    by_condition: dict[str, list[ConditionChiSquare]] = Field(
        description="Chi-square of that block and phase by the value of each operating condition.")


class Closure(BaseModel):
    """The gap between model and recordings on held-out conditions, in one signal or in the shifting time.

    The gap is the mean squared error minus the part that noise and scatter alone produce. Errors are in the unit of the
    signal, or in s.
    """

    rms_before: float = Field(description="RMS error without the effects.")
    rms_after: float = Field(description="RMS error with the effects.")
    rms_expected: float = Field(description="RMS error of a correct model, due to sensor noise and scatter alone.")
    closure: float | None = Field(description="Fraction of the gap that the effects close; null if there is no "
                                              "significant gap without them.")
    lower: float | None = Field(description="Lower end of the 90 % bootstrap interval of `closure`.")
    upper: float | None = Field(description="Upper end of the 90 % bootstrap interval of `closure`.")


class Control(BaseModel):
    """The gap closed by the best-scoring effect that acts on another quantity than the named effects."""

    effect: str = Field(description="Name of that effect.")
    closures: dict[str, Closure] = Field(description="Closure by signal or `shifting_time`.")


class Gap(BaseModel):
    """The gap between model and recordings without and with the added effects."""

    closures: dict[str, Closure] = Field(description="Closure by signal or `shifting_time`.")
    before: list[float] = Field(description="Held-out prediction of each shifting time in s, without the effects.")
    after: list[float] = Field(description="Held-out prediction of each shifting time in s, with the effects.")
    control: Control | None = Field(description="Control for comparison; null if no other effect was fitted.")


class FurtherExperiment(BaseModel):
    """A proposed experiment for which the effects of a tie predict different results."""

    current_profile: int = Field(description="Index of the current profile in the recordings.")
    motor_speed: float = Field(description="Motor speed in rad/s.")
    load_inertia: float = Field(description="Load inertia in kg m^2.")
    brake_torque: float = Field(description="Brake torque in N m.")
    recorded: bool = Field(description="Whether the recordings already contain this condition.")
    apart: float = Field(description="Separation between the predictions of the first effect and of its nearest rival: "
                                     "RMS in units of the noise, after the scatter of the rival has been refitted.")
    signal: str = Field(description="Signal, or `shifting_time`, that contributes most to the separation.")
    repetitions: int | None = Field(description="Expected number of runs that separate the two effects by five "
                                                "standard errors, with all other parameters refitted; null for more "
                                                "than 1000.")


class FurtherExperiments(BaseModel):
    """Proposed experiments that separate the effects of a tie."""

    effects: list[str] = Field(description="The tied effects.")
    experiments: list[FurtherExperiment] = Field(
        description="Experiments with the largest separation, best first: up to five that differ in current profile or "
                    "motor speed, and the best one that is already recorded. Speed, inertia and torque extend up to a "
                    "fifth beyond the recorded range.")


class Models(BaseModel):
    """The fitted models, in the format that `python -m worker build --model` reads."""

    before: dict[str, Any] = Field(description="The model without any effect.")
    after: dict[str, Any] = Field(description="The model with the effects added.")


class StudySummary(BaseModel):
    """The answer of a study and the results that it is based on."""

    answer: StudyAnswer
    settings_digest: str = Field(description="SHA-256 digest of the settings.")
    recordings_digest: RecordingsDigest
    experiments: int = Field(description="Number of experiments, which are the observations of all statistical tests.")
    noise: dict[str, float] = Field(description="Standard deviation of the sensor noise, by signal or `shifting_time`.")
    stopped: str = Field(description="Reason why the study ended.")
    rounds: list[Round] = Field(description="The rounds, in the order in which they were run.")
    models: Models
    where: MisfitLocation | None = Field(description="Location of the misfit; null for recordings without signals.")
    gap: Gap | None = Field(description="Gap without and with the effects; null if no effect was added.")
    further: list[FurtherExperiments] = Field(description="Proposed experiments for each tie; empty if there is none.")


class StudyResult(BaseModel):
    """The result of a finished study."""

    id: str = Field(description="Id of the study.")
    recordings: str = Field(description="Name of the recordings.")
    recordings_digest: RecordingsDigest
    result: StudySummary
    seconds: dict[str, float] = Field(description="Elapsed (wall-clock) time of each stage in s.")
    processor_seconds: dict[str, float] = Field(
        description="Processor time of each stage in s, summed over all threads of the worker.")


class ModelSpec(BaseModel):
    """A model specification in the format that `python -m worker build --model` reads."""

    parameters: dict[str, float] = Field(description="Values of the parameters, by name.")
    units: dict[str, str] = Field(description="Units of the parameters, by name.")
    effects: dict[str, dict[str, float]] = Field(description="Coefficients of the effects, by effect and coefficient.")
    bench: dict[str, Any] = Field(description="Physics of the bench: nominal parameters, converter curves, digest.")
    laws: list[dict[str, Any]] | None = Field(
        default=None, description="Measured laws, absent if the model has none: the change of a quantity at points of "
                                  "what it depends on, with units; linear between them, constant outside.")
