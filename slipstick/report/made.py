"""Reports and pictures from JSON, as a child process makes them: they take seconds of the interpreter.

A request is the JSON object `{"kind": ..., ...}` with the arguments of the page: for a `fit` its `job`, `output`,
`other` and `description`, for a `study` its `job`, `output` and `fits`, for a `calibration` its
`job` and `output`, for a `propagation` the `answer`, the `request`,
the `conditions`, and the relative address `home` of the service.
"""

import importlib
import json
from collections.abc import Mapping
from typing import Any

from slipstick.errors import UnknownName
from slipstick.pictures import CAPTIONS, Spec, pictures, propagation, theme
from slipstick.pictures.rendering import inline, render
from slipstick.report.calibration import CAPTIONS as CALIBRATION_CAPTIONS
from slipstick.report.calibration import calibration_page, drawn_calibration
from slipstick.report.machine_study import machine_study_page, machine_study_specs
from slipstick.report.page import page as fit_page
from slipstick.report.propagation import propagation_page
from slipstick.report.study.page import study_page, study_specs

PROPAGATION = "propagation"
"""The only picture of a propagation."""


def prepare(_: bytes) -> None:
    """Start the renderer with fonts and axes, and import what scipy imports late, before a picture is asked for."""
    importlib.import_module("scipy.interpolate")
    axes = {name: {"field": name, "type": "quantitative"} for name in ("x", "y")}
    body = {"data": {"values": [{"x": 0, "y": 1}]}, "mark": "line", "encoding": axes}
    render(theme.picture("Title", "", body), "svg")


def page(request: bytes) -> bytes:
    """The HTML page of a fit, a study, a calibration or a propagation."""
    given = json.loads(request)
    match given["kind"]:
        case "fit":
            text = fit_page(given["job"], given["output"], given["other"], given["description"])
        case "study":
            text = machine_study_page(given["job"], given["output"]) if _is_of_machine(given) else study_page(
                given["job"], given["output"], given["fits"])
        case "calibration":
            text = calibration_page(given["job"], given["output"])
        case _:
            text = propagation_page(given["answer"], given["request"], given["conditions"], given["home"])
    return text.encode()


def titles(request: bytes) -> bytes:
    """A JSON object: the name of each picture, in the order of the report, with its title and its caption."""
    specs = _specs(json.loads(request))
    return json.dumps({name: [spec["title"]["text"], _caption(name, spec)] for name, spec in specs.items()}).encode()


def picture(request: bytes) -> bytes:
    """The picture `name` of the request in its `form`: `json` (Vega-Lite), `svg` or `png`; raises `UnknownName`."""
    given = json.loads(request)
    spec, caption = _drawn(given)
    if given["form"] == "json":
        return json.dumps(spec, ensure_ascii=False, separators=(",", ":")).encode()
    return render(spec, given["form"], caption)


def element(request: bytes) -> bytes:
    """The picture `name` as an SVG element of a page, in which identifiers begin with `prefix`; raises `UnknownName`.
    """
    given = json.loads(request)
    (spec, caption), prefix = _drawn(given), given["prefix"]
    return inline({prefix: spec}, {prefix: caption})[prefix].encode()


def _drawn(given: Mapping[str, Any]) -> tuple[Spec, str]:
    """The picture `name` of a request, and its caption; raises `UnknownName`."""
    name = given["name"]
    specs = pictures(given["output"], [name]) if given["kind"] == "fit" else _specs(given)
    if name not in specs:
        raise UnknownName.of("picture", name, _specs(given))
    return specs[name], _caption(name, specs[name])


def _caption(name: str, spec: Spec) -> str:
    """The caption of a picture: that of what is drawn, or else of all pictures of this name."""
    return str(spec.get("description", {**CAPTIONS, **CALIBRATION_CAPTIONS}.get(name)))


def elements(request: bytes) -> bytes:
    """A JSON object: the name of each of the `specs` and its SVG element, with its caption of `captions`."""
    given = json.loads(request)
    return json.dumps(inline(given["specs"], given["captions"])).encode()


def svg(request: bytes) -> bytes:
    """The picture `spec` as an SVG file without its title as text; that and the `caption` describe it."""
    given = json.loads(request)
    return inline({"picture": given["spec"]}, {"picture": given["caption"]})["picture"].encode()


def _is_of_machine(given: Mapping[str, Any]) -> bool:
    return bool(given.get("job", {}).get("machine"))


def _specs(given: Mapping[str, Any]) -> dict[str, Spec]:
    match given["kind"]:
        case "fit":
            return pictures(given["output"])
        case "study":
            return machine_study_specs(given["output"]) if _is_of_machine(given) else study_specs(
                given["job"], given["output"], given["fits"])
        case "calibration":
            return drawn_calibration(given["output"])
    return {PROPAGATION: propagation.draw(given["answer"], given["request"]["quantiles"], given["conditions"])}
