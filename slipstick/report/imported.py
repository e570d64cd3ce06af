"""The page of an import: which channel is which signal, what was found out and assumed, what is set aside, pictures."""

from slipstick import __version__
from slipstick.acquisition.comparison import Comparison
from slipstick.acquisition.result import Imported
from slipstick.bench import Bench
from slipstick.pictures.imported import CAPTIONS, engagement, overlay
from slipstick.pictures.theme import Spec
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.report.markup import definitions, listing, paragraph, section, table
from slipstick.report.shell import document, figures

_CHANNELS = ("signal", "channel", "unit in the files", "unit", "sign", "step [ms]", "lowest", "highest")
_ROWS = ("engagement", "profile", "motor speed [rad/s]", "load inertia [kg m²]", "brake torque [N m]",
         "shifting time [ms]", "by the speeds [ms]")


def imported_page(name: str, found: Imported, bench: Bench, comparison: Comparison | None) -> str:
    """The HTML page of an import called `name`; without a `comparison` of one engagement it has no pictures."""
    n, aside = len(found.labels), len(found.set_aside)
    title = f"{n} engagements imported{f', {aside} set aside' if aside else ''}"
    return document("import", name, title, [("Check:", doubt) for doubt in found.doubts], [
        paragraph(summary(found), "lead"),
        section("Channels", table(_CHANNELS, [
            (one.name, one.channel, one.stated or "not stated", one.unit, _signed(one.sign, "+.0f"),
             f"{1e3 * one.step:.4g}", _signed(one.lowest), _signed(one.highest))
            for one in found.channels], words=(1, 2, 3))),
        section("Set aside", listing((f"{one.label}:", one.reason) for one in found.set_aside)),
        section("Not determined", *(paragraph(text) for text in found.open_questions)),
        section("Detected or assumed", *(paragraph(text) for text in found.remarks)),
        section("Pictures", *figures(_pictures(found, comparison), CAPTIONS).values()),
        section("Engagements", table(_ROWS, list(_rows(found)))),
        section("Provenance", definitions([
            ("bench", f"{bench.name}, SHA-256 {bench.digest}"), ("recordings", f"SHA-256 {found.recordings.digest}"),
            ("description", found.recordings.description), ("version", f"Slipstick {__version__}")]))])


def summary(found: Imported) -> str:
    """The import in a sentence or two."""
    signals = found.recordings.signals
    kind = "computed from the speeds" if found.computed else "as recorded"
    text = f"Shifting times are {kind}. "
    if signals is None:
        return text + "Signals are missing, so that the recordings have none."
    return text + (f"Signals have {len(signals.time):,} samples each, every {1e3 * found.step:g} ms from "
                   f"{signals.time[0]:g} to {signals.time[-1]:.4g} s after the shift command.")


def _pictures(found: Imported, comparison: Comparison | None) -> dict[str, Spec]:
    signals = found.recordings.signals
    if signals is None or comparison is None:
        return {}
    measured = {name: signals[name] for name in signals.names}
    row = comparison.row
    return {
        "engagement": engagement(
            found.labels[row], signals.time.tolist(), {name: values[row].tolist() for name, values in measured.items()},
            {name: values.tolist() for name, values in comparison.simulated.items()},
            float(found.recordings.measured_time[row]), comparison.lock, comparison.gear_ratio),
        "all": overlay(signals.time, measured, SIGNAL_UNITS, comparison.gear_ratio)}


def _signed(value: float, form: str = ".4g") -> str:
    return f"{value:{form}}".replace("-", "−")


def _rows(found: Imported) -> list[tuple[str, ...]]:
    conditions, times = found.recordings.conditions, found.recordings.measured_time
    return [(label, str(conditions.current_profile[row]), f"{conditions.motor_speed[row]:.5g}",
             f"{conditions.load_inertia[row]:.4g}", f"{conditions.brake_torque[row]:.4g}", f"{1e3 * times[row]:.1f}",
             "" if error != error else f"{1e3 * located:.2f} ± {1e3 * error:.2f}")
            for row, (label, located, error) in enumerate(zip(found.labels, found.located, found.error, strict=True))]
