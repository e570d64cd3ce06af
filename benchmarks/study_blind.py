"""Studies of sealed recordings whose hidden effects an independent bench has made: how often the answer is right.

    python -m benchmarks.study_blind [PART ...]

A case is a seed: the study sees only the file. Every finished case is a line of var/study_blind.jsonl, so that the same
command goes on where it was; study_blind.csv is the summary. PART is a beginning of the names of cases, such as "null".
"""

import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.study_table import summarise
from slipstick.recordings import Recordings
from slipstick.study import comparison, conclusion, study
from slipstick.study.settings import StudySettings
from tests.validation.hidden import case as hidden
from tests.validation.hidden import files
from tests.validation.hidden.catalogue import PHYSICAL, UNLISTED
from tests.validation.hidden.sensors import SENSORS

FILE = Path("var/study_blind.jsonl")
NULLS = ({}, {"shift": "ten percent"}, {"drifting": True})
PAIRS, OUTSIDE = 20, 20


def cases() -> Iterator[tuple[str, hidden.Case]]:
    """Every case with its name, `kind/what/...`."""
    listed = (*PHYSICAL, *SENSORS)
    seed = 1000
    for count, signals, tag in ((54, True, ""),):
        for effect in listed:
            for strength in (0.5, 1.0):
                for noise in (0.01, 0.03):
                    seed += 1
                    yield (f"effect{tag}/{effect.name}/{strength:g}/{noise:g}",
                           hidden.Case({effect.name: strength * effect.typical}, seed, noise, count, signals))
    for i in range(60):
        options: dict[str, Any] = dict(NULLS[i % len(NULLS)])
        yield f"null/{'-'.join(options) or 'plain'}/{i:02d}", hidden.Case({}, 2000 + i, 0.01, 54, **options)
    pairs = list(combinations(PHYSICAL, 2))
    for i, place in enumerate(np.random.default_rng(3000).choice(len(pairs), PAIRS, replace=False)):
        first, second = pairs[place]
        yield (f"pair/{first.name}+{second.name}",
               hidden.Case({first.name: first.typical, second.name: second.typical}, 3000 + i, 0.01, 54))
    for i in range(OUTSIDE):
        effect = UNLISTED[i % len(UNLISTED)]
        yield (f"outside/{effect.name}/{i // len(UNLISTED)}",
               hidden.Case({effect.name: effect.typical}, 4000 + i, 0.01, 54))
    for i, effect in enumerate(listed[::3]):
        for count, signals, tag in ((216, True, "216"), (20, True, "20"), (216, False, "times")):
            yield (f"effect-{tag}/{effect.name}/1/0.01",
                   hidden.Case({effect.name: effect.typical}, 5000 + i, 0.01, count, signals))


def answered(name: str, case: hidden.Case) -> dict[str, Any]:
    """Study one case as a user would, with default settings."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "recordings.h5"
        files.write(path, case)
        recordings = Recordings.open(path)
    begun, settings = time.perf_counter(), StudySettings()
    try:
        compared = comparison.compare(recordings, settings.shifting_time_noise)
        state = study.start(settings, compared)
        while not study.finished(state):
            state = study.advance(settings, compared, state)
        result = conclusion.conclude(settings, compared, state)
    except Exception as error:  # a case that fails is a wrong answer, not the end of the benchmark
        return {"case": name, "hidden": dict(case.effects), "failed": repr(error)}
    return {"case": name, "hidden": dict(case.effects), "truth": asdict(case), "answer": result["answer"],
            "rounds": [{**one, "screening": one["screening"][:12]} for one in result["rounds"]], "gap": result["gap"],
            "seconds": time.perf_counter() - begun}


def main() -> None:
    """Run what has not been run, and summarise all."""
    FILE.parent.mkdir(exist_ok=True)
    done = {json.loads(line)["case"] for line in FILE.read_text().splitlines()} if FILE.exists() else set()
    waiting = [(name, case) for name, case in cases()
               if name not in done and (len(sys.argv) == 1 or name.startswith(tuple(sys.argv[1:])))]
    with ProcessPoolExecutor(os.cpu_count()) as pool, FILE.open("a") as file:
        for future in as_completed([pool.submit(answered, *one) for one in waiting]):
            found = future.result()
            file.write(json.dumps(found) + "\n")
            file.flush()
            print(found["case"], "->", found.get("failed") or found["answer"]["effects"], flush=True)
    summarise(FILE)


if __name__ == "__main__":
    main()
