"""How open terms are best chosen: three ways to pick one in recordings of effects that no catalogue lists.

    python -m benchmarks.study_open_terms

At the fit without any effect each way puts first one term of all quantities, signals and powers. "gain" is the rise of
the log-likelihood that its score promises, "statistic" the cluster-robust score statistic, by which the screening
judges whether anything is asked for, and "halves" the gain that is largest in most of 200 random halves of the
experiments (stability selection), with their share. A quantity is right where the term enters the equation that the
hidden effect changes.
"""

from concurrent.futures import ProcessPoolExecutor
from os import cpu_count

import numpy as np
from numba import set_num_threads

from benchmarks.benches import HEAVY
from benchmarks.results import write
from benchmarks.study_blind import cases
from benchmarks.study_signatures import recorded
from slipstick.clutch import effects
from slipstick.study import comparison, rounds, study
from slipstick.study.answer import form
from slipstick.study.score import score
from slipstick.study.settings import StudySettings
from tests.validation.hidden import EFFECTS
from tests.validation.hidden.case import Case

EQUATION = {"friction_coefficient": "friction coefficient", "valve_current": "line pressure",
            "pressure_demand": "line pressure", "load_torque": "load torque", "input_drag": "converter torque"}
"""Quantity that an unlisted effect of the bench changes -> the open term of its equation; sensors have none."""
WAYS = ("gain", "statistic", "halves")
HEADER = ("case", "hidden in", *(f"{way}: {what}" for way in WAYS for what in ("quantity", "form")), "share of halves")


def chosen(name: str, case: Case) -> list[object]:
    """The row of a case."""
    settings = StudySettings()
    compared = comparison.compare(HEAVY, recorded(case), settings.shifting_time_noise)
    state = study.start(settings, compared)
    compared = study.observed(compared, state)
    found = score(compared, rounds.restore(settings, compared, state["rounds"][0]), study.OPEN, settings.seed)
    halves = found.selected(settings.seed)
    row: list[object] = [name.removeprefix("outside/"), EQUATION.get(EFFECTS[next(iter(case.effects))].quantity, "")]
    for judged in (found.gain, found.statistic, halves):
        best = found.probes[int(np.argmax(judged))]
        shape = dict(best.shape)
        row += [effects.find(best.effect).quantity, form(shape["signal"], shape["power"])]
    return [*row, float(halves.max())]


def main() -> None:
    """Choose in all cases, and write the table, with how often each way was right."""
    outside = [one for one in cases() if one[0].startswith("outside/")]
    with ProcessPoolExecutor(cpu_count(), initializer=set_num_threads, initargs=(1,)) as pool:
        rows = list(pool.map(chosen, *zip(*outside, strict=True)))
    right = [sum(row[1] == row[2 + 2 * place] for row in rows) for place in range(len(WAYS))]
    total = ["right quantity", f"of {len(rows)}", *(entry for count in right for entry in (count, "")), ""]
    write("study_open_terms", HEADER, [*rows, total], "python -m benchmarks.study_open_terms")


if __name__ == "__main__":
    main()
