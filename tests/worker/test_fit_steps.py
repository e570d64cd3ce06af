"""Steps of a fit: the first one refuses recordings that the simulator cannot reach, the last one tells what it has."""

import math
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from slipstick.errors import InvalidValue
from slipstick.recordings import Recordings
from slipstick.storage.library import Library
from slipstick.time_budget import TimeBudgetEnded
from worker import fit_steps
from worker.computing import Report
from worker.orders import time_left, with_time
from worker.simulators import Simulators


@pytest.mark.parametrize(("changed", "message"), [
    ({}, None),
    ({"measured_time": 1e-3}, r"The measured shifting time is .* s in the median of 216 conditions"),
    ({"load_inertia": 10.0}, r"The output speed of the recordings is 9\.\d+ times that to which their output torque")],
    ids=["right", "times", "inertia"])
def test_a_fit_by_simulation_starts_only_with_recordings_of_the_bench(
        shelf: Path, tmp_path: Path, changed: dict[str, float], message: str | None) -> None:
    folder = shutil.copytree(shelf, tmp_path / "tables")
    whole = Recordings.open(folder / "measured.h5")
    conditions = replace(whole.conditions,
                         load_inertia=changed.get("load_inertia", 1.0) * whole.conditions.load_inertia)
    (folder / "changed.h5").write_bytes(replace(
        whole, conditions=conditions, measured_time=changed.get("measured_time", 1.0) * whole.measured_time).to_bytes())
    library = Library(folder)
    bench, table = library.bench("heavy"), library.table("nominal")
    order: dict[str, Any] = {
        "table": "nominal", "table_digest": table.digest, "recordings": "changed",
        "recordings_digest": library.recording("changed").digest, "bench": "heavy", "bench_digest": bench.digest,
        "sensing_digest": bench.sensing_digest, "outside": "clip", "settings": {}, "simulate": True,
        "parameters": ["pressure_bias", "initial_position"]}
    if message is None:
        fit_steps.start(library, lambda _: None, Simulators(), order)
    else:
        with pytest.raises(InvalidValue, match=message):
            fit_steps.start(library, lambda _: None, Simulators(), order)


def test_what_a_fit_has_at_the_end_of_its_time_is_its_result(shelf: Path) -> None:
    library, settings = Library(shelf), {"population": 4, "generations": 2, "patience": 2}
    order: dict[str, Any] = {
        "table": "nominal", "table_digest": library.table("nominal").digest, "recordings": "measured",
        "recordings_digest": library.recording("measured").digest, "outside": "clip", "settings": settings,
        "simulate": False, "parameters": ["pressure_bias", "initial_position"], "time_budget": 5.0}
    report = Report(lambda _: None)
    begun = fit_steps.start(library, report, Simulators(), order)
    with pytest.raises(TimeBudgetEnded, match="5 s ended before the first generation of the search"):
        fit_steps.conclude(library, report, Simulators(), order, begun)
    searched = fit_steps.search(library, report, Simulators(), order, begun)
    result = fit_steps.conclude(library, report, Simulators(), order, searched)["result"]
    assert result["partial"] == {"budget": 5.0, "done": ["search"], "missing": ["refinement", "intervals"]}
    assert result["mean"] == result["searched"]["mean"]
    refined = fit_steps.refine(library, report, Simulators(), order, searched)
    result = fit_steps.conclude(library, report, Simulators(), order, refined)["result"]
    assert result["partial"] == {"budget": 5.0, "done": ["search", "refinement"], "missing": ["intervals"]}
    assert result["refined"]
    begun = fit_steps.interval(library, report, Simulators(), order, refined)
    result = fit_steps.conclude(library, report, Simulators(), order, begun)["result"]
    assert result["partial"]["done"][2].startswith("1 of ")
    assert result["partial"]["missing"] == ["the rest of the intervals"]
    assert len(result["intervals"]) == 1
    order["settings"] |= {"refine": False, "intervals": False}
    assert fit_steps.conclude(library, report, Simulators(), order, searched)["result"]["partial"] is None


def test_the_time_budget_counts_what_earlier_steps_took() -> None:
    assert time_left({}, {"seconds": {"open": 3.0}}) == time_left({"time_budget": None}, {}) == math.inf
    stopped = with_time({"seconds": {"open": 1.0, "search": 2.0}}, "search", 3.5)
    assert stopped == {"seconds": {"open": 1.0, "search": 5.5}}
    assert time_left({"time_budget": 10.0}, stopped) == 3.5
    assert time_left({"time_budget": 5.0}, stopped) == 0.0
