"""Draw the picture of the README: one recorded engagement, and its simulation before and after calibration."""

import json
import sys
from pathlib import Path

import numpy as np
import vl_convert

from slipstick.clutch import ensemble
from slipstick.clutch.model import Model
from slipstick.recordings import Recordings

CONDITION = 100
STYLES = {"measured": "#3d4852", "nominal": "#e0843a", "calibrated": "#1f5fa8"}
PANELS = (("speed", "shaft speeds [rad/s]"), ("torque", "output torque [N m]"))


def main(calibration: Path, out: Path) -> None:
    recordings = Recordings.open("tables/measured.h5")
    assert recordings.signals is not None
    time = recordings.signals.time[::4]
    conditions = recordings.conditions.take([CONDITION])
    models = {"nominal": Model(), "calibrated": Model.from_spec(json.loads(calibration.read_text())["model"])}
    lines = {"measured": {name: getattr(recordings.signals, name)[CONDITION, ::4].astype(float)
                          for name in ("input_speed", "output_speed", "output_torque")}}
    locks = {"measured": recordings.measured_time[CONDITION]}
    for name, model in models.items():
        response = ensemble.signals(model, conditions, time, accuracy=ensemble.TIGHT)
        lines[name] = {signal: getattr(response, signal)[0, 0] for signal in lines["measured"]}
        locks[name] = response.shifting_time[0, 0]
    rows = [{"t": round(float(t), 3), "who": who, "panel": panel, "line": f"{who} {signal}", "y": round(float(y), 2)}
            for who, signals in lines.items()
            for signal, panel in (("input_speed", "speed"), ("output_speed", "speed"), ("output_torque", "torque"))
            # Behind the gear: divided by g_r, so that the two shafts meet where the clutch locks.
            for t, y in zip(time, signals[signal] / (3.2 if signal == "input_speed" else 1), strict=True) if t <= 1.2]
    out.write_text(vl_convert.vegalite_to_svg(json.dumps(spec(rows, locks))))


def spec(rows: list[dict[str, object]], locks: dict[str, float]) -> dict[str, object]:
    colour = {"field": "who", "type": "nominal", "title": None,
              "scale": {"domain": list(STYLES), "range": list(STYLES.values())}, "legend": {"orient": "top"}}
    marks = [{"who": who, "t": float(t), "text": f"{1e3 * t:.0f} ms"} for who, t in locks.items() if np.isfinite(t)]

    def panel(name: str, title: str) -> dict[str, object]:
        return {"width": 720, "height": 170, "layer": [
            {"data": {"values": [row for row in rows if row["panel"] == name]},
             "mark": {"type": "line", "strokeWidth": 1.6},
             "encoding": {"x": {"field": "t", "type": "quantitative", "title": "time since the shift command [s]",
                                "axis": {"tickCount": 12, "format": ".1f"}},
                          "y": {"field": "y", "type": "quantitative", "title": title}, "color": colour,
                          "detail": {"field": "line"}}},
            {"data": {"values": marks}, "mark": {"type": "rule", "strokeDash": [4, 3]},
             "encoding": {"x": {"field": "t", "type": "quantitative"}, "color": colour}}]}

    return {"$schema": "https://vega.github.io/schema/vega-lite/v5.json", "background": "white",
            "title": "Condition 100: shaft speeds (input divided by the gear ratio), torque, and lock-up (dashed)",
            "config": {"font": "sans-serif"}, "vconcat": [panel(*entry) for entry in PANELS]}


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
