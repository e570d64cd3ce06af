"""What cannot be answered without the signals that were not mapped."""

from collections.abc import Collection

from slipstick.bench import Bench
from slipstick.recordings.signals import NEEDED, SIGNAL_UNITS, open_blocks

_LINKED = ("current_gain", "pressure_bias", "initial_position", "temperature_gain", "friction_coefficient")
"""Only products and ratios of these change torque and speeds: together they undo a change of any of them."""


def open_questions(signals: Collection[str], bench: Bench) -> tuple[str, ...]:
    """Sentences on recordings with some of the `signals`; none for all of them."""
    missing = [name for name in SIGNAL_UNITS if name not in signals]
    if not missing:
        return ()
    can = open_blocks(signals)
    closed = [f"{block} ({_join([name for name in missing if name in needed])})" for block, needed in NEEDED.items()
              if block not in can]
    study = "A study tests no block, because none has the signals at both of its ends. It says whether the " \
            "simulation of the whole bench explains the recordings, and which effects would. A block needs the " \
            "pressure, or the output torque and a speed"
    if can:
        study = (f"A study tests the block{'s' if len(can) > 1 else ''} {_join(can)}. It cannot test "
                 f"{_join(closed)}, which need what is in brackets")
    calibration = "A calibration uses the signals that there are, and lists the parameters that they do not determine"
    if "pressure" in missing and set(_LINKED) <= set(bench.uncertain):
        calibration += f". Without pressure {_join(_LINKED)} cannot be told apart, only products and ratios of them"
    return (f"{_join(missing)} not mapped: the recordings hold {_join(list(signals))} only", study, calibration)


def _join(names: Collection[str]) -> str:
    *most, last = names
    return f"{', '.join(most)} and {last}" if most else last
