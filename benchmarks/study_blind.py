"""Studies of sealed recordings whose hidden effects an independent bench has made: how often the answer is right.

    python -m benchmarks.study_blind [PART ...]

Strengths are those of `study_signatures.csv`, and half of them. Beside each study stands what a one-shot regression on
the residuals of the fit without any effect would have named.

A case is a seed: the study sees only the file. Every finished case is a line of var/study_blind.jsonl, so that the same
command goes on where it was; study_blind.csv is the summary. PART is a beginning of the names of cases, such as "null".
"""

import json
import os
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numba import set_num_threads
from scipy.stats import chi2

from benchmarks.benches import HEAVY
from benchmarks.study_quantity import error
from benchmarks.study_signatures import recorded, strengths
from benchmarks.study_table import SAME, summarise
from slipstick.study import comparison, conclusion, rounds, study
from slipstick.study.linearised import linearise
from slipstick.study.score import probes
from slipstick.study.settings import StudySettings
from tests.validation.hidden import case as hidden
from tests.validation.hidden import files
from tests.validation.hidden.catalogue import PHYSICAL, UNLISTED

FILE = Path("var/study_blind.jsonl")
NULLS = ({}, {"shift": "ten percent"}, {"drifting": True})
PAIRS, OUTSIDE, SAMPLED = 20, 20, 4


def cases() -> Iterator[tuple[str, hidden.Case]]:
    """Every case with its name, `kind/what/...`."""
    typical, seed = strengths(), 1000
    for name in typical:
        for strength in (0.5, 1.0):
            for noise in (0.01, 0.03):
                seed += 1
                yield (f"effect/{name}/{strength:g}/{noise:g}",
                       hidden.Case({name: strength * typical[name]}, seed, noise, 54))
    for i in range(60):
        options: dict[str, Any] = dict(NULLS[i % len(NULLS)])
        yield f"null/{'-'.join(options) or 'plain'}/{i:02d}", hidden.Case({}, 2000 + i, 0.01, 54, **options)
    pairs = list(combinations([effect.name for effect in PHYSICAL], 2))
    for i, place in enumerate(np.random.default_rng(3000).choice(len(pairs), PAIRS, replace=False)):
        both = pairs[place]
        yield f"pair/{'+'.join(both)}", hidden.Case({name: typical[name] for name in both}, 3000 + i, 0.01, 54)
    for i in range(OUTSIDE):
        effect = UNLISTED[i % len(UNLISTED)]
        yield (f"outside/{effect.name}/{i // len(UNLISTED)}",
               hidden.Case({effect.name: effect.typical}, 4000 + i, 0.01, 54))
    for i, name in enumerate(list(typical)[::SAMPLED]):
        for count, signals, tag in ((216, True, "216"), (20, True, "20"), (216, False, "times")):
            yield f"effect-{tag}/{name}/1/0.01", hidden.Case({name: typical[name]}, 5000 + i, 0.01, count, signals)


def answered(name: str, case: hidden.Case) -> dict[str, Any]:
    """Study one case as a user would, with default settings."""
    recordings = recorded(case)
    begun, settings = time.perf_counter(), StudySettings()
    found = {"case": name, "hidden": dict(case.effects), "truth": asdict(case)}
    try:
        compared = comparison.compare(HEAVY, recordings, settings.shifting_time_noise)
        state = study.start(settings, compared)
        while not study.finished(state):
            state = study.advance(settings, compared, state)
        result = conclusion.conclude(settings, compared, state)
        seconds = time.perf_counter() - begun
    except Exception as failure:  # a case that fails is a wrong answer, not the end of the benchmark
        return {**found, "failed": repr(failure)}
    quantity = {one["effect"]: error(one, SAME[one["effect"]], result["models"]["after"], case.count)
                for one in files.truth(case)["changed"] if SAME.get(one["effect"]) in result["answer"]["effects"]}
    return {**found, "answer": result["answer"], "gap": result["gap"], "quantity": quantity, "seconds": seconds,
            "rounds": [{**one, "screening": one["screening"][:12]} for one in result["rounds"]],
            "regression": regression(settings, compared, state)}


def regression(settings: StudySettings, compared: comparison.Comparison, state: study.State) -> dict[str, Any]:
    """What a one-shot regression on the residuals names: the effect that explains most of them, parameters held.

    Every value counts as an observation; `coefficient` is in typical values.
    """
    seen = study.observed(compared, state)
    fit, tried = rounds.restore(settings, seen, state["rounds"][0]), probes(settings.catalogue, seen.bench)
    about = linearise(seen, fit.design, fit.points, tried, columns=())
    gram = about.weighted(fit.state.noise).sum(axis=0)
    explained = gram[:-1, -1] ** 2 / np.maximum(np.diag(gram)[:-1], 1e-12)
    best = int(explained.argmax())
    return {"effect": tried[best].effect if explained[best] > chi2.isf(settings.significance / len(tried), 1) else None,
            "coefficient": float(gram[best, -1] / gram[best, best])}


def main() -> None:
    """Run what has not been run, and summarise all."""
    FILE.parent.mkdir(exist_ok=True)
    done = {json.loads(line)["case"] for line in FILE.read_text().splitlines()} if FILE.exists() else set()
    waiting = [(name, case) for name, case in cases()
               if name not in done and (len(sys.argv) == 1 or name.startswith(tuple(sys.argv[1:])))]
    waiting.sort(key=lambda one: one[1].count)
    few = [one for one in waiting if one[1].count <= 54]
    order = np.random.default_rng(0).permutation(len(few))  # an unfinished run is a fair sample
    waiting[:len(few)] = [few[place] for place in order]
    # A study on each core, and not each on all of them.
    each = ProcessPoolExecutor(os.cpu_count(), initializer=set_num_threads, initargs=(1,))
    with each as pool, FILE.open("a") as file:
        for future in as_completed([pool.submit(answered, *one) for one in waiting]):
            found = future.result()
            file.write(json.dumps(found) + "\n")
            file.flush()
            print(found["case"], "->", found.get("failed") or found["answer"]["effects"], flush=True)
    summarise(FILE)


if __name__ == "__main__":
    main()
