"""A calibration as text and as a page: parameters with intervals and scatter, noise of sensors, and what is left."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from slipstick.bench import parameters
from slipstick.calibration import Calibration
from slipstick.machine_studies.result import MachineParameter, StatedCondition
from slipstick.machine_studies.words import name_run
from slipstick.pictures import parameters as parameters_picture
from slipstick.pictures.theme import Spec, in_words
from slipstick.pictures.units import fixed, number, scale, with_unit
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.report import markup
from slipstick.report.doubts import LARGE_CHI_SQUARE
from slipstick.report.machine_study import state_condition, tabulate_parameters
from slipstick.report.shell import document, figures, home_of, provenance, tell_facts, tell_recordings
from slipstick.report.words import signed

CAPTIONS = {"parameters": parameters_picture.CAPTION}
"""The pictures of a calibration."""
_SCATTER = "Scatter: standard deviation from run to run, as a share of the nominal value"
_NOISE = "Sensor noise, its correlation from sample to sample, and reduced chi-square"
_MISSING = ("Reduced chi-square is well above 1, although each run has parameters of its own: an effect is",
            "missing, which a study may name. Values and intervals then describe the best model without it.")
_NOT_CONVERGED = "The fit has not converged: do not use its intervals."


class _Row(NamedTuple):
    """A parameter in words: value, ends of its interval, multiple of nominal, scatter, unit and what limits it."""

    name: str
    value: str
    lower: str
    upper: str
    multiple: str
    scatter: str
    unit: str
    note: str


def _rows(calibration: Calibration) -> list[_Row]:
    nominal, rows = _nominal(calibration), []
    for name, entry in calibration.spec()["parameters"].items():
        note = f"at a bound, no estimate: within {_describe_bounds(calibration, name)}" \
            if name in calibration.at_bound else "not determined" if name in calibration.undetermined else ""
        scatter, error = (entry[key] / abs(nominal[name]) for key in ("scatter", "scatter_error"))
        unit, factor = scale(entry["unit"], entry["value"])
        value, lower, upper = (fixed(factor * each, 4) for each in (entry["value"], *entry["interval"]))
        rows.append(_Row(in_words(name), value, lower, upper, f"{entry['value'] / nominal[name]:.4f}",
                         f"{100 * scatter:.2f} %" if scatter > error else f"< {100 * (scatter + error):.2f} %", unit,
                         note))
    return rows


def _describe_bounds(calibration: Calibration, name: str) -> str:
    entry = calibration.spec()["parameters"][name]
    unit, factor = scale(entry["unit"], max(map(abs, entry["bounds"])))
    return with_unit(" to ".join(number(factor * bound, 4) for bound in entry["bounds"]), unit)


def _nominal(calibration: Calibration) -> dict[str, float]:
    return dict(zip(parameters.NAMES, calibration.model.physics.nominal, strict=True))


def calibration_text(calibration: Calibration) -> str:
    """The calibration as plain text."""
    lines = [*([" ".join(calibration.partial.warning)] if calibration.partial else []),
             f"Bench '{calibration.bench}'",
             f"{'parameter':22}{'value':>12}  {f'{calibration.level:.0%} interval':>24}  {'x nominal':>9}  "
             f"{'scatter':>8}"]
    lines += [f"{row.name:22}{row.value:>12}  {row.lower:>11} to {row.upper:<10}{row.multiple:>9}  {row.scatter:>8}  "
              f"{row.unit}" + f"  {row.note}" * bool(row.note) for row in _rows(calibration)]
    lines += _list_undetermined(calibration)
    lines.append(f"{_SCATTER}\nCorrelation of the estimates, in the same order")
    lines += ["  " + "".join(f"{value:7.2f}" for value in row) for row in calibration.correlation]
    lines.append(_NOISE)
    lines += [f"  {name:20}{calibration.noise[name]:9.3g}  {calibration.noise_correlation.get(name, 0.0):5.2f}"
              f"{value:9.2f}" for name, value in calibration.chi_square.items()]
    if _leaves_much(calibration.chi_square):
        lines += _MISSING
    if not calibration.converged:
        lines.append(_NOT_CONVERGED)
    lines.append(f"RMS of the shifting-time residual: {1e3 * calibration.rms_before:.1f} ms before the calibration, "
                 f"{1e3 * calibration.rms_after:.1f} ms after")
    return "\n".join(lines)


def calibration_summary(calibration: Calibration) -> list[str]:
    """How many parameters were fitted, what the recordings leave open, and the error of the shifting times."""
    lines = [f"{len(calibration.free)} parameters of the bench '{calibration.bench}' fitted to recordings. RMS error "
             f"of the shifting time: {1e3 * calibration.rms_before:.1f} ms before, "
             f"{1e3 * calibration.rms_after:.1f} ms after."]
    if calibration.at_bound:
        bounds = [f"{in_words(name)} (within {_describe_bounds(calibration, name)})" for name in calibration.at_bound]
        lines.append(f"At a bound of the bench file, so no estimates: {', '.join(bounds)}.")
    if calibration.undetermined:
        lines.append(f"Not determined: {', '.join(map(in_words, calibration.undetermined))}.")
    return lines if calibration.converged else [*lines, _NOT_CONVERGED]


def machine_calibration_summary(machine: str, fitted: list[MachineParameter], conditions: list[StatedCondition],
                                chi_square: Mapping[str, float], set_aside: list[str]) -> list[str]:
    """What each block of a declared machine leaves, what is not determined or outside of its declaration, and runs."""
    left = ", ".join(f"{name} {chi:.2f}" for name, chi in chi_square.items())
    lines = [f"{len(fitted)} parameters of the machine “{machine}” fitted. Reduced chi-square: {left}."]
    for words, names in (("Not determined", [each.name for each in fitted if not each.determined]),
                         ("Outside of what is declared", [each.name for each in fitted if each.beyond]),
                         ("Stated conditions outside of what is declared", list(map(state_condition, conditions))),
                         ("Runs set aside", set_aside)):
        if names:
            lines.append(f"{words}: {', '.join(names)}.")
    return lines


def calibration_specs(calibration: Calibration) -> dict[str, Spec]:
    """The pictures of a calibration by name: the parameters with their intervals, relative to their nominal values."""
    return {"parameters": parameters_picture.draw(calibration.spec()["parameters"], _nominal(calibration),
                                                  calibration.level)}


def drawn_calibration(output: Mapping[str, Any]) -> dict[str, Spec]:
    """The pictures of the output of a job; none of a declared machine, whose parameters have no common axis."""
    return {} if "machine" in output["result"] else calibration_specs(Calibration.from_spec(output["result"]))


def calibration_page(job: Mapping[str, Any], output: Mapping[str, Any]) -> str:
    """The HTML page of a calibration: `job` is its JSON of the service, and `output` that of its worker."""
    result = output["result"]
    if "machine" in result:
        return _machine_page(job, output)
    calibration = Calibration.from_spec(result)
    lead, *limits = calibration_summary(calibration)
    partial = [] if calibration.partial is None else [calibration.partial.warning]
    head = ("parameter", "value", f"{100 * calibration.level:.0f} % interval", "× nominal", "scatter", "remark")
    rows = [(row.name, with_unit(row.value, row.unit), with_unit(f"{row.lower} to {row.upper}", row.unit),
             row.multiple, row.scatter, row.note) for row in _rows(calibration)]
    noise = [(in_words(name), _state_noise(calibration.noise[name], SIGNAL_UNITS.get(name, "s")),
              signed(calibration.noise_correlation.get(name, 0.0)), f"{value:.2f}")
             for name, value in calibration.chi_square.items()]
    names = [in_words(name) for name in calibration.free]
    correlation = [(name, *map(signed, row))
                   for name, row in zip(names, calibration.correlation, strict=True)]
    title = f"Parameters of the bench {calibration.bench} from “{job['recordings']}”"
    return document("calibration to", job["recordings"], title, [*partial, *_warn(limits, calibration.chi_square)], [
        markup.section("Parameters", markup.table(head, rows, words=(5,)), markup.paragraph(f"{_SCATTER}.", "note"),
                       *(markup.paragraph(line, "note") for line in _list_undetermined(calibration))),
        markup.section("Pictures", *figures(calibration_specs(calibration), CAPTIONS).values()),
        markup.section("Noise", markup.table(("sensor", "noise", "correlation", "reduced chi-square"), noise),
                       markup.paragraph(f"{_NOISE}, which is 1 if only noise is left.", "note")),
        markup.section("Correlation of the estimates", markup.table(("", *names), correlation)),
        provenance(job, output, [*_sources(job), ("bench", f"{job['bench']}, SHA-256 {job['bench_digest']}"),
                                 ("iterations", str(calibration.evaluations))])],
        facts=[markup.paragraph(lead, "lead"), tell_facts(job, [f"Bench {calibration.bench}", tell_recordings(job)])],
        home=home_of(job))


def _machine_page(job: Mapping[str, Any], output: Mapping[str, Any]) -> str:
    result = output["result"]
    fitted = [MachineParameter(**each) for each in result["parameters"]]
    lead, *limits = machine_calibration_summary(
        result["machine"], fitted, [StatedCondition(**each) for each in result.get("conditions", [])],
        result["chi_square"], [name_run(run, result.get("run_names", [])) for run in result["set_aside"]])
    chi_square = [(name, f"{value:.2f}") for name, value in result["chi_square"].items()]
    table = tabulate_parameters(fitted)
    title = f"Parameters of the machine {result['machine']} from “{job['recordings']}”"
    return document("calibration to", job["recordings"], title, _warn(limits, result["chi_square"]), [
        markup.section("Parameters", markup.table(table.head, table.rows, table.words)),
        markup.section("Blocks", markup.table(("block", "reduced chi-square"), chi_square)),
        provenance(job, output, [*_sources(job), ("machine", result["machine"])])],
        facts=[markup.paragraph(lead, "lead"), tell_facts(job, [f"Machine {result['machine']}", tell_recordings(job)])],
        home=home_of(job))


def _state_noise(value: float, unit: str) -> str:
    shown, factor = scale(unit, value)
    return with_unit(fixed(factor * value), shown)


def _sources(job: Mapping[str, Any]) -> list[tuple[str, str | None]]:
    start = f"model with the SHA-256 {job['model_digest']}" if job["model_digest"] else "nominal parameters"
    return [("recordings", f"{job['recordings']}, SHA-256 {job['recordings_digest']}"), ("start", start)]


def _warn(limits: list[str], chi_square: Mapping[str, float]) -> list[tuple[str, str]]:
    missing = [("An effect is missing:", " ".join(_MISSING))] if _leaves_much(chi_square) else []
    return [*((f"{words.partition(':')[0]}:", words.partition(": ")[2]) for words in limits), *missing]


def _leaves_much(chi_square: Mapping[str, float]) -> bool:
    return max(chi_square.values()) > LARGE_CHI_SQUARE


def _list_undetermined(calibration: Calibration) -> list[str]:
    missing = [name for name in SIGNAL_UNITS if name not in calibration.signals]
    lines = [f"Not measured: {', '.join(map(in_words, missing))}"] if missing else []
    if calibration.undetermined:
        lines.append(f"Not determined by these recordings: {', '.join(map(in_words, calibration.undetermined))}.\n"
                     "At most combinations of them are. Among the values that fit alike, these are near the start, and "
                     "the\nintervals say what the bounds of the bench file leave open.")
    return lines
