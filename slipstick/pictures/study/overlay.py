"""The signal in which the findings show best, of the engagement that the model without them describes worst."""

from slipstick.pictures.conditions import described
from slipstick.pictures.overlay import Overlay, draw_overlay
from slipstick.pictures.study.signals import AFTER_LOCK, TITLES, describe_errors, rms_error
from slipstick.pictures.study.words import model_series, numbers
from slipstick.pictures.theme import Spec
from slipstick.studies.figures import Engagement, Figures
from slipstick.studies.result import StudyResult
from slipstick.studies.settings import StudySettings


def draw(result: StudyResult, figures: Figures, _: StudySettings) -> Spec | None:
    """Return what was measured and simulated, without and with the findings; None without signals."""
    if not figures.engagements:
        return None
    shown, models = figures.engagements[0], model_series(result)
    signal = choose_signal(result, shown)
    kept = [place for place, t in enumerate(shown.time) if t <= shown.lock + AFTER_LOCK]

    def cut(values: list[float]) -> list[float]:
        return [values[place] for place in kept]

    run = f"Engagement {numbers(result)[shown.condition]}"
    about = f"{run}, the one that the model {'without what was found ' * (len(models) > 1)}describes worst"
    errors = describe_errors([shown], models, signal)
    return draw_overlay(f"{run}: {errors}", f"Conditions: {described(figures.conditions, shown.condition)}.", Overlay(
        cut(shown.time), cut(shown.measured[signal]),
        {label: (cut(shown.models[who][signal]), colour) for who, (label, colour) in models.items()},
        TITLES[signal], result.noise[signal], about, "engagement", shown.lock))


def choose_signal(result: StudyResult, shown: Engagement) -> str:
    """The signal whose error in its noise falls most by the findings, or without any is largest."""
    def fall(signal: str) -> float:
        errors = [rms_error([shown], who, signal) ** 2 for who in shown.models]
        return (errors[0] - (errors[1] if len(errors) > 1 else 0.0)) / result.noise[signal] ** 2

    return max(shown.measured, key=fall)
