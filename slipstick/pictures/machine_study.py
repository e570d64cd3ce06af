"""The pictures of a study of a declared machine: its laws, and the runs that the model describes worst."""

from slipstick.machine_studies import MachineFigures, MachineStudyResult
from slipstick.machine_studies.result import ShownRun
from slipstick.pictures import theme, units
from slipstick.pictures.study.law import draw_laws
from slipstick.pictures.theme import Spec

LEVEL = 0.95
"""Probability of the intervals."""
CAPTIONS = {
    "law": ("Dots: the change as it is measured in all runs at once, without a formula. Shade: its 95 % interval at "
            "each point. Where a law is known up to a constant or a straight line, parameters take that part as well."),
    "signals": ("The runs that the model without findings describes worst, a column each. Of every signal: what was "
                "measured and simulated, and below it measured minus simulated. Shade: two standard deviations of the "
                "noise of a sample. Each simulation has the parameters that its fit estimates for that run.")}
"""Name of each picture -> caption."""
_SIGNAL, _DIFFERENCE = 120, 80  # px
_COLUMN_SPACING = 44  # px between the panels of runs
_MEASURED = "measured"


def machine_pictures(result: MachineStudyResult, figures: MachineFigures) -> dict[str, Spec]:
    """Return name -> specification of each picture for which there are data."""
    specs = {"law": draw_laws(result.findings, LEVEL), "signals": _draw_signals(result, figures)}
    return {name: spec for name, spec in specs.items() if spec is not None}


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
    names = ", ".join(str(shown.run) for shown in figures.runs)
    return theme.picture(f"The runs that are described worst: {names}", "Below each signal: measured minus simulated. "
                         "Shade: noise.", {"spacing": 12, "vconcat": rows})


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
    rows = [{"t": t, "y": theme.rounded(here - value if difference else value), "series": label}
            for label, curve in curves.items()
            for t, here, value in zip(shown.time, measured, curve[signal], strict=True)]
    if not difference:
        rows += [{"t": t, "y": value, "series": _MEASURED} for t, value in zip(shown.time, measured, strict=True)]
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
        layers.insert(0, {"data": {"values": [{"low": -half, "high": half}]},
                          "mark": {"type": "rect", "color": theme.MEASURED, "opacity": 0.13},
                          "encoding": {"y": {**y, "field": "low"}, "y2": {"field": "high"}}})
    return {"width": width, "height": _DIFFERENCE if difference else _SIGNAL, "data": {"values": rows}, "layer": layers,
            **({"title": {"text": f"run {shown.run}", "fontSize": 12, "offset": 4}}
               if not difference and signal == next(iter(shown.measured)) else {})}
