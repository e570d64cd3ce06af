"""The blocks, the closed gap and the fitted simulation in sentences and tables."""

import math
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass

import scipy

from slipstick.bench.parameters import PARAMETERS
from slipstick.pictures import units
from slipstick.pictures.study.words import effect_title, within
from slipstick.pictures.theme import in_words
from slipstick.pictures.units import fixed, number
from slipstick.report.study.parts import Note, Part, Section, Table, show
from slipstick.report.study.words import CHANNELS, between, describe_closure, many, percent
from slipstick.report.words import listed
from slipstick.studies.result import WITHIN, Closure, Gap, SimulationResult, StudyResult
from slipstick.studies.settings import StudySettings

_CLOSED = ("Gap closed: 1 − (after² − right²) / (before² − right²). Before: the best fit without the findings to the "
           "same recordings. After: the fit with them. Right: what sensor noise and the scatter of the parameters "
           "alone would leave. A motor speed or current profile is predicted by means and coefficients that are "
           "estimated without it; names, measured laws and scatter are those of all engagements. Within engagements: "
           "all signals, beside the scatter of the parameters, in standard deviations of the noise. What a right model "
           "leaves is a mean: an error that is below it by chance closes all of the gap, and ends of intervals may be "
           "above 100 %.")
_BLOCKS = ("The model is cut at its measured signals into blocks. Each block is driven by what was measured at its "
           "input, so that an error upstream does not reach it. Reduced chi-square is 1 if only noise is left.")
_FITTED = ("Deviations of the mean from the nominal value, and standard deviations from engagement to engagement, both "
           "relative to nominal. Those of conditions are relative to what the blocks measure.")
AT_BOUND, NOT_DETERMINED = "at a bound", "not determined"
_BOUND = (" At a bound: as far from nominal as the fit lets it, so that the value means little; without the findings "
          "it stands for what is missing.")
_MEASURED = ("Torque and speeds show how far the bench is from the stated conditions. The simulation has the measured "
             "values of each engagement, so that they do not count as an error of a prediction.")
UNITS = {"motor_speed": "rad/s", "load_inertia": "kg m²", "brake_torque": "N m"}


@dataclass(frozen=True)
class ParameterValue:
    """A parameter of a refitted model in words: its value in its unit, and the `nominal` one that it replaces.

    `interval` is empty where a `remark` says why there is none.
    """

    name: str
    symbol: str
    text: str
    interval: str
    nominal: str
    remark: str

    def is_in(self, written: str) -> bool:
        """Whether its symbol is in an equation."""
        return re.search(rf"(?<!\w){re.escape(self.symbol)}(?!\w)", written) is not None


def values_of(fit: SimulationResult, level: float) -> list[ParameterValue]:
    """Return the parameters that were fitted, with intervals of probability `level`."""
    wide, values = float(scipy.special.ndtri((1 + level) / 2)), []
    for parameter in PARAMETERS:
        if parameter.name not in fit.parameters or parameter.name not in fit.model["parameters"]:
            continue
        value, change = fit.model["parameters"][parameter.name], fit.parameters[parameter.name]
        nominal, (unit, factor) = value / (1 + change), units.scale(parameter.unit, value)
        remark = AT_BOUND if parameter.name in fit.at_bound else \
            NOT_DETERMINED if parameter.name in fit.undetermined else ""
        interval = ""
        if parameter.name in fit.errors and not remark:
            half = wide * fit.errors[parameter.name] * abs(nominal)
            interval = between(factor * (value - half), factor * (value + half), unit)
        values.append(ParameterValue(
            in_words(parameter.name), parameter.symbol, units.with_unit(fixed(factor * value, 4), unit), interval,
            units.with_unit(fixed(factor * nominal, 4), unit), remark))
    return values


def tell_confidence(result: StudyResult) -> str:
    """Return how sure the names of the findings are; empty without findings, or in results of earlier versions."""
    known = [finding for finding in result.findings if finding.confidence is not None and finding.counted is not None]
    if not known:
        return ""
    sure = listed([f"{finding.confidence:.2f}" + f" for {within(finding.title)}" * (len(known) > 1)
                   for finding in known])
    first = known[0].counted
    assert first is not None
    return (f"Confidence {sure}: of {first.of} findings with a confidence of {first.lower:g} to {first.upper:g} on "
            f"simulated benches with hidden effects, {first.right} were right.")


def lead(result: StudyResult, settings: StudySettings) -> str:
    """What the answer means for predictions, or what it means that nothing was found."""
    if result.partial is not None:
        return ("The simulation of the whole bench was not fitted. Whether it supports the findings, their "
                "coefficients and the size of their effects are not known.")
    if not result.blocks:
        return _explain_untested(result)
    chi_square = [block.chi_square for block in result.blocks]
    if result.kind == "none":
        return (f"In {'the' if result.closed else 'all'} {len(result.blocks)} blocks of the model"
                f"{' that could be tested' if result.closed else ''}, {many(result.experiments, 'engagement')} leave "
                f"no more than noise: reduced chi-square is {min(chi_square):.2f} to {max(chi_square):.2f}, and 1 "
                "is expected. No change of any quantity with anything gains the "
                f"{number(settings.naming.nats)} nats and {number(settings.naming.errors)} standard errors that a "
                f"finding needs. The model of the bench{', once corrected,' * bool(result.beyond)} describes these "
                "recordings; an effect that gains less remains unseen.")
    if not result.findings and all(block.is_explained for block in result.blocks):
        return "To find where it is missing, record the signals that are lacking."
    if not result.findings:
        return "The block is known, but not the law: record under other conditions, or look at its signals."
    if result.gap is None:
        return "The simulation of the whole bench supports none of the findings of the blocks, so no gap is computed."
    time = result.gap.closures["shifting_time"]
    text = (f"On conditions that the fit has not seen, the error of the shifting time goes from "
            f"{fixed(1e3 * time.rms_before)} to {fixed(1e3 * time.rms_after)} ms (root mean square); sensor noise and "
            f"scatter alone leave {fixed(1e3 * time.rms_expected)} ± {fixed(1e3 * _spread(time, result), 2)} ms.")
    if time.closure is None:
        return f"{text} There is no significant gap in the shifting time to close.{_within(result.gap)}"
    text += "" if time.closure < 0 else f" That closes {describe_closure(time)} of the gap."
    return text + _compare_control(result.gap)


def _spread(time: Closure, result: StudyResult) -> float:
    """The standard error of the root mean square that so many normal errors leave."""
    return time.rms_expected / math.sqrt(2 * result.experiments)


def _compare_control(gap: Gap) -> str:
    """What a wrong effect leaves of the shifting time; empty without one."""
    if gap.control is None or "shifting_time" not in gap.control.closures:
        return ""
    left = fixed(1e3 * gap.control.closures["shifting_time"].rms_after)
    return f" A wrong effect, added as a control, leaves {left} ms."


def _explain_untested(result: StudyResult) -> str:
    """What the answer means where no block could be tested."""
    what = ("Each engagement is one number, which the scatter of any parameter explains: only differences between the "
            "conditions tell anything, as far as the means of the parameters do not explain these as well."
            if result.times else "No block has signals at both of its ends, so that no law is measured.")
    if result.kind == "none":
        return (f"The simulation of the whole bench explains {many(result.experiments, 'engagement')} with its "
                f"parameters. {what} An effect that they can make good remains unseen.")
    return f"{what} To find where it is missing, record pressure, speeds and torque."


def _within(gap: Gap) -> str:
    """The gap beside the scatter of the parameters, which hides that of the shifting time; empty if there is none."""
    beside = gap.closures.get(WITHIN)  # results of earlier versions do not have it
    if beside is None or beside.closure is None or beside.closure < 0:
        return ""
    return (f" Beside the scatter of the parameters between engagements, the error of all signals goes from "
            f"{fixed(beside.rms_before)} to {fixed(beside.rms_after)} standard deviations of the noise, which closes "
            f"{describe_closure(beside)} of that gap.")


def blocks(result: StudyResult, pictures: Collection[str]) -> Section:
    """The findings of every block, and what it leaves unexplained."""
    rows = list[tuple[str, ...]]()
    for block in result.blocks:
        shown = [within(title) for title in block.findings]
        if block.unexplained:
            shown.append("something that no law explains")
        shown += [f"left over: {within(remainder.title)}?" for remainder in result.remainders
                  if block.name in remainder.blocks]
        rows.append((block.signals, f"{block.chi_square:.2f}", "; ".join(shown) or "none"))
    rows += [(block.signals, "", f"not tested: {listed([in_words(name) for name in block.missing])} not measured")
             for block in result.closed]
    return Section("Blocks of the model", [
        *show("blocks", pictures), Table(("block", "reduced chi-square", "findings"), rows, words=(2,)), Note(_BLOCKS)])


def gap(result: StudyResult, pictures: Collection[str]) -> Section:
    """The closed gap of every signal; empty if the simulation supports no finding."""
    if result.gap is None:
        return Section("", [])
    control = result.gap.control
    rows = []
    for name, closure in result.gap.closures.items():
        unit, factor = CHANNELS[name]
        errors = (fixed(factor * error) for error in (closure.rms_before, closure.rms_after, closure.rms_expected))
        rows.append((f"{in_words(name)} [{unit}]", *errors, describe_closure(closure),
                     *([describe_closure(control.closures[name])] if control else [])))
    note = f" Control: a wrong effect for comparison, {within(effect_title(control.effect))}, which acts on another " \
        "quantity." if control else ""
    head = ("RMS error on held-out conditions", "before", "after", "right model", "gap closed (90 %)")
    return Section("Gap closed by what was found", [
        *show("gap", pictures), Table((*head, "by the control") if control else head, rows), Note(_CLOSED + note)])


def simulation(result: StudyResult, level: float) -> Section:
    """Values, chi-square, deviations and scatter of the fits of the whole simulation; empty in a partial result."""
    if result.before is None or result.after is None:
        return Section("", [])
    rows: list[tuple[str, ...]] = [(value.name, value.text, value.interval or value.remark, value.nominal)
                                   for value in values_of(result.after, level)]
    fits = [result.before] if result.gap is None else [result.before, result.after]
    head = ("without", "with the findings")[:len(fits)] if len(fits) > 1 else ("model of the bench",)
    chi_square = [(in_words(name), *(f"{fit.chi_square[name]:.2f}" for fit in fits)) for name in fits[0].chi_square]
    values: list[Part] = [Table(("parameter", "value in the " + ("extended" if result.gap else "refitted") + " model",
                                 f"{100 * level:.0f} % interval", "in the bench file"), rows)] if rows else []
    parts: list[Part] = [*values, Table(("mean squared residual in units of the noise", *head), chi_square)]
    if len(fits) > 1:
        rise = result.after.log_likelihood - result.before.log_likelihood
        limit = "" if result.before.converged else (" The fit without them had not converged when its iterations "
                                                    "ended, so that the rise may be somewhat smaller.")
        parts.append(f"The log-likelihood of all signals rises by {rise:,.0f} nats.{limit}")
    heads = tuple(f"{kind}{' ' + name if len(fits) > 1 else ''}" for kind in ("mean", "scatter") for name in head)
    parts += [Table(("parameter or condition", *heads), list(_parameters(fits))),
              Note(_FITTED + _BOUND * any(fit.at_bound for fit in fits))]
    return Section("The fitted simulation of the whole bench", parts)


def conditions(result: StudyResult) -> Section:
    """What the blocks measure of the stated conditions; empty if none was measured."""
    if not result.conditions:
        return Section("", [])
    rows: list[tuple[str, ...]] = [
        (in_words(condition.name), f"{number(condition.stated, 4)} {UNITS[condition.name]}",
         percent(condition.deviation), f"{100 * condition.scatter:.2f} %", str(condition.engagements))
        for condition in result.conditions]
    return Section("Conditions as measured", [
        Table(("condition", "stated", "measured minus stated", "scatter", "engagements"), rows), Note(_MEASURED)])


def _parameters(fits: list[SimulationResult]) -> Iterator[tuple[str, ...]]:
    for name in fits[0].parameters:
        yield (in_words(name), *(percent(fit.parameters[name]) + _remark(fit, name) for fit in fits),
               *(f"{100 * fit.scatter[name]:.2f} %" for fit in fits))


def _remark(fit: SimulationResult, name: str) -> str:
    return f" ({AT_BOUND})" if name in fit.at_bound else f" ({NOT_DETERMINED})" if name in fit.undetermined else ""
