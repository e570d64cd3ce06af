"""The pictures of a study of a declared machine: what shows it, its laws, and the runs that are described worst."""

import math

from slipstick.machine_studies import MachineFigures, MachineStudyResult
from slipstick.machine_studies.result import ShownRun
from slipstick.machine_studies.words import name_run
from slipstick.pictures import theme, units
from slipstick.pictures.overlay import Overlay, draw_overlay
from slipstick.pictures.study.law import draw_laws
from slipstick.pictures.theme import Spec

LEVEL = 0.95
"""Probability of the intervals."""
NAMES = ("overlay", "law", "signals")
"""Names of all pictures, in the order of the report."""
_CAPTION = ("The runs that the model{0} describes worst, a column each. Of every signal: what was measured and "
            "simulated, and below it measured minus simulated. Shade: two standard deviations of the noise of a "
            "sample. Each simulation has the parameters that its fit estimates for that run.")
_SIGNAL, _DIFFERENCE = 120, 80  # px
_COLUMN_SPACING = 44  # px between the panels of runs
_MEASURED = "measured"


def machine_pictures(result: MachineStudyResult, figures: MachineFigures) -> dict[str, Spec]:
    """Return name -> specification of each picture for which there are data."""
    runs = "runs that show it" if any(finding.runs for finding in result.findings) else "runs"
    specs = {"overlay": _draw_overlay(result, figures), "law": draw_laws(result.findings, LEVEL, runs),
             "signals": _draw_signals(result, figures)}
    return {name: spec for name, spec in specs.items() if spec is not None}


def _draw_overlay(result: MachineStudyResult, figures: MachineFigures) -> Spec | None:
    """Return the signal and run in which the findings show best; None without runs."""
    if not figures.runs:
        return None

    def error(shown: ShownRun, who: str, signal: str) -> float:
        pairs = zip(shown.measured[signal], shown.models[who][signal], strict=True)
        return math.sqrt(sum((here - there) ** 2 for here, there in pairs) / len(shown.measured[signal]))

    def fall(place: tuple[ShownRun, str]) -> float:
        before, *after = (error(place[0], who, place[1]) ** 2 for who in place[0].models)
        return (before - (after[0] if after else 0.0)) / result.noise[place[1]] ** 2

    shown, signal = max(((run, signal) for run in figures.runs for signal in run.measured), key=fall)
    unit = units.raised(result.units.get(signal, ""))
    before, *after = (units.with_unit(units.number(error(shown, who, signal), 2), unit) for who in shown.models)
    title = f"Run {shown.run}: the {signal} is off by {before}" + "".join(
        f", and by {value} with what was found" for value in after)
    colours, noise = _name_models(shown), units.with_unit(units.number(result.noise[signal], 2), unit)
    return draw_overlay(title, f"Root mean square. The noise of a sample is {noise}.", Overlay(
        shown.time[:len(shown.measured[signal])], shown.measured[signal],
        {label: (curve[signal], hue)
         for (label, hue), curve in zip(colours.items(), shown.models.values(), strict=True)},
        signal if unit in ("", "1") else f"{signal} [{unit}]", result.noise[signal],
        f"Run {name_run(shown.run, result.run_names)}, numbered from 0", "run"))


def _draw_signals(result: MachineStudyResult, figures: MachineFigures) -> Spec | None:
    """Return two rows for each signal, and a column for each run; None without runs."""
    if not figures.runs:
        return None
    width = (theme.WIDTH - _COLUMN_SPACING * (len(figures.runs) - 1)) // len(figures.runs)
    colours = {_MEASURED: theme.MEASURED, **_name_models(figures.runs[0])}
    signals = list(figures.runs[0].measured)
    rows: list[Spec] = []
    for signal in signals:
        for difference in (False, True):
            is_last = difference and signal == signals[-1]
            panels = [_draw_panel(result, shown, signal, difference, colours, (width, is_last, place == 0))
                      for place, shown in enumerate(figures.runs)]
            rows.append({"spacing": _COLUMN_SPACING, "bounds": "flush", "hconcat": panels})
    names = ", ".join(name_run(shown.run, result.run_names) for shown in figures.runs)
    return theme.picture(f"The runs that are described worst: {names}", "Below each signal: measured minus simulated. "
                         "Shade: noise.", {"spacing": 12, "vconcat": rows}, _CAPTION.format(
                             " without findings" * ("after" in figures.runs[0].models)))


def _name_models(shown: ShownRun) -> dict[str, str]:
    """Return label -> colour of the models."""
    if "after" not in shown.models:
        return {"model": theme.AFTER}
    return {"best fit without findings": theme.BEFORE, "with findings": theme.AFTER}


def _draw_panel(result: MachineStudyResult, shown: ShownRun, signal: str, difference: bool, colours: dict[str, str],
                place: tuple[float, bool, bool]) -> Spec:
    """Return a signal of a run, or its differences, in a `place`: width, whether it is the last row, and the first run.
    """
    width, is_last, is_first = place
    unit = result.units.get(signal, "")
    labels = [label for label in colours if label != _MEASURED]
    curves = dict(zip(labels, shown.models.values(), strict=True))
    measured = shown.measured[signal]
    time = shown.time[:len(measured)]
    rows = [{"t": t, "y": theme.rounded(here - value if difference else value), "series": label}
            for label, curve in curves.items()
            for t, here, value in zip(time, measured, curve[signal], strict=True)]
    if not difference:
        rows += [{"t": t, "y": value, "series": _MEASURED} for t, value in zip(time, measured, strict=True)]
    title = f"{signal} [{units.raised(unit)}]" if unit not in ("", "1") else signal
    x: Spec = {"field": "t", "type": "quantitative", "title": "time [s]" if is_last else None,
               "scale": {"nice": False}, "axis": {"grid": False, "labels": is_last, "ticks": is_last, "tickCount": 5}}
    y: Spec = {"field": "y", "type": "quantitative", "scale": {"zero": False},
               "title": None if not is_first else f"Δ {title}" if difference else title,
               "axis": {"tickCount": 4}}
    colour = {**theme.series_colour(colours), "field": "series", "legend": {"symbolType": "stroke"}}
    layers: list[Spec] = [{"mark": {"type": "line", "strokeWidth": 1.4},
                           "encoding": {"x": x, "y": y, "color": colour}}]
    if difference:
        half = 2 * result.noise.get(signal, 0.0)
        layers.insert(0, theme.band(-half, half, y))
    return {"width": width, "height": _DIFFERENCE if difference else _SIGNAL, "data": {"values": rows}, "layer": layers,
            **({"title": {"text": f"run {shown.run}", "fontSize": 12, "offset": 4}}
               if not difference and signal == next(iter(shown.measured)) else {})}
