"""The page of an import: which channel is which signal, what was found out and assumed, what is set aside, pictures."""

from slipstick import __version__
from slipstick.acquisition.comparison import Comparison
from slipstick.acquisition.result import Imported, ImportedFiles, ImportedRuns
from slipstick.bench import Bench
from slipstick.pictures.imported import CAPTIONS, engagement, overlay
from slipstick.pictures.theme import Spec, in_words
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.report.markup import definitions, listing, paragraph, section, table
from slipstick.report.shell import document, figures

_CHANNELS = ("signal", "channel", "unit in the files", "unit", "sign", "step [ms]", "lowest", "highest")
_ROWS = ("engagement", "profile", "motor speed [rad/s]", "load inertia [kg m²]", "brake torque [N m]",
         "shifting time [ms]", "by the speeds [ms]")


def imported_page(name: str, imported: Imported, bench: Bench, comparison: Comparison | None) -> str:
    """The HTML page of an import called `name`; without a `comparison` of one engagement it has no pictures."""
    return _page(name, imported, _pictures(imported, comparison), table(_ROWS, list(_rows(imported))), [
        ("bench", f"{bench.name}, SHA-256 {bench.digest}"), ("recordings", f"SHA-256 {imported.recordings.digest}"),
        ("description", imported.recordings.description)])


def imported_runs_page(name: str, imported: ImportedRuns) -> str:
    """The HTML page of an import of the runs of a machine, called `name`."""
    runs = imported.runs
    drawn = {**runs.signals, **{each: profile.at(runs.time) for each, profile in runs.commands.items()}}
    picture = overlay(runs.time, drawn, {each: f"{each} [{runs.units[each] or '1'}]" for each in drawn}, "run",
                      "begin of the run")
    constants = {**runs.conditions, **{each: values for each, values in runs.channels.items() if values.ndim == 1}}
    head = ("run", "begin in its file [s]", *(f"{each} [{runs.units[each] or '1'}]" for each in constants))
    rows = [(label, f"{imported.begins[row]:.6g}", *(_signed(float(values[row]), ".5g")
                                                    for values in constants.values()))
            for row, label in enumerate(imported.labels)]
    return _page(name, imported, {"runs": picture}, table(head, rows), [
        ("machine", runs.machine), ("runs", f"SHA-256 {runs.digest}"), ("description", runs.description)])


def _page(name: str, imported: ImportedFiles, pictures: dict[str, Spec], rows: str,
          provenance: list[tuple[str, str]]) -> str:
    n, aside, word = len(imported.labels), len(imported.set_aside), imported.experiment
    title = f"{n} {word}s imported{f', {aside} set aside' if aside else ''}"
    return document("import of", name, title, [("Check:", doubt) for doubt in imported.doubts], [
        paragraph(summary(imported), "lead"),
        section("Channels", table(_CHANNELS, [
            (channel.name, channel.channel, channel.stated or "not stated", channel.unit, _signed(channel.sign, "+.0f"),
             f"{1e3 * channel.step:.4g}", _signed(channel.lowest), _signed(channel.highest))
            for channel in imported.channels], words=(1, 2, 3))),
        section("Set aside", listing((f"{exclusion.label}:", exclusion.reason) for exclusion in imported.set_aside)),
        section("Not determined", *(paragraph(text) for text in imported.open_questions)),
        section("Detected or assumed", *(paragraph(text) for text in imported.remarks)),
        section("Pictures", *figures(pictures, CAPTIONS).values()), section(f"{word.title()}s", rows),
        section("Provenance", definitions([*provenance, ("version", f"Slipstick {__version__}")]))])


def summary(imported: ImportedFiles) -> str:
    """The import in a sentence or two."""
    if isinstance(imported, ImportedRuns):
        time = imported.runs.time
        return (f"Runs of {imported.runs.machine} have {len(time):,} samples each, every {1e3 * imported.step:g} ms "
                f"from {time[0]:g} to {time[-1]:.4g} s after their begin.")
    assert isinstance(imported, Imported)
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
        "all": overlay(signals.time, {name: values / (comparison.gear_ratio if name == "input_speed" else 1.0)
                                      for name, values in measured.items()},
                       {name: f"{in_words(name)}{' ÷ gear ratio' if name == 'input_speed' else ''} "
                              f"[{SIGNAL_UNITS[name]}]" for name in measured}, "engagement", "shift command")}


def _signed(value: float, form: str = ".4g") -> str:
    return f"{value:{form}}".replace("-", "−")


def _rows(imported: Imported) -> list[tuple[str, ...]]:
    conditions, times = imported.recordings.conditions, imported.recordings.measured_time
    return [(label, str(conditions.current_profile[row]), f"{conditions.motor_speed[row]:.5g}",
             f"{conditions.load_inertia[row]:.4g}", f"{conditions.brake_torque[row]:.4g}", f"{1e3 * times[row]:.1f}",
             "" if error != error else f"{1e3 * located:.2f} ± {1e3 * error:.2f}")
            for row, (label, located, error) in enumerate(
                zip(imported.labels, imported.located, imported.error, strict=True))]
