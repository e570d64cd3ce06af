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


def imported_page(name: str, imported: Imported, bench: Bench, comparison: Comparison | None) -> str:
    """The HTML page of an import called `name`; without a `comparison` of one engagement it has no pictures."""
    n, aside = len(imported.labels), len(imported.set_aside)
    title = f"{n} engagements imported{f', {aside} set aside' if aside else ''}"
    return document("import", name, title, [("Check:", doubt) for doubt in imported.doubts], [
        paragraph(summary(imported), "lead"),
        section("Channels", table(_CHANNELS, [
            (channel.name, channel.channel, channel.stated or "not stated", channel.unit, _signed(channel.sign, "+.0f"),
             f"{1e3 * channel.step:.4g}", _signed(channel.lowest), _signed(channel.highest))
            for channel in imported.channels], words=(1, 2, 3))),
        section("Set aside", listing((f"{exclusion.label}:", exclusion.reason) for exclusion in imported.set_aside)),
        section("Not determined", *(paragraph(text) for text in imported.open_questions)),
        section("Detected or assumed", *(paragraph(text) for text in imported.remarks)),
        section("Pictures", *figures(_pictures(imported, comparison), CAPTIONS).values()),
        section("Engagements", table(_ROWS, list(_rows(imported)))),
        section("Provenance", definitions([
            ("bench", f"{bench.name}, SHA-256 {bench.digest}"), ("recordings", f"SHA-256 {imported.recordings.digest}"),
            ("description", imported.recordings.description), ("version", f"Slipstick {__version__}")]))])


def summary(imported: Imported) -> str:
    """The import in a sentence or two."""
    signals = imported.recordings.signals
    kind = "computed from the speeds" if imported.computed else "as recorded"
    text = f"Shifting times are {kind}. "
    if signals is None:
        return text + "Signals are missing, so that the recordings have none."
    return text + (f"Signals have {len(signals.time):,} samples each, every {1e3 * imported.step:g} ms from "
                   f"{signals.time[0]:g} to {signals.time[-1]:.4g} s after the shift command.")


def _pictures(imported: Imported, comparison: Comparison | None) -> dict[str, Spec]:
    signals = imported.recordings.signals
    if signals is None or comparison is None:
        return {}
    measured = {name: signals[name] for name in signals.names}
    row = comparison.row
    return {
        "engagement": engagement(
            imported.labels[row], signals.time.tolist(),
            {name: values[row].tolist() for name, values in measured.items()},
            {name: values.tolist() for name, values in comparison.simulated.items()},
            float(imported.recordings.measured_time[row]), comparison.lock, comparison.gear_ratio),
        "all": overlay(signals.time, measured, SIGNAL_UNITS, comparison.gear_ratio)}


def _signed(value: float, form: str = ".4g") -> str:
    return f"{value:{form}}".replace("-", "−")


def _rows(imported: Imported) -> list[tuple[str, ...]]:
    conditions, times = imported.recordings.conditions, imported.recordings.measured_time
    return [(label, str(conditions.current_profile[row]), f"{conditions.motor_speed[row]:.5g}",
             f"{conditions.load_inertia[row]:.4g}", f"{conditions.brake_torque[row]:.4g}", f"{1e3 * times[row]:.1f}",
             "" if error != error else f"{1e3 * located:.2f} ± {1e3 * error:.2f}")
            for row, (label, located, error) in enumerate(
                zip(imported.labels, imported.located, imported.error, strict=True))]
