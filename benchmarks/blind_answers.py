"""Answers to sealed recordings, one row a finding, appended to blind_answers.csv.

    python -m benchmarks.blind_answers FILE...

A file is called BENCH-NUMBER.h5, BENCH being the name of a shipped bench. A tree with changes is refused, so that the
commit of a row is the code that gave it. Every run stays in the table.
"""

import csv
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from numba import set_num_threads

from benchmarks.benches import BENCHES
from slipstick.naming.answer import answer
from slipstick.naming.settings import NamingSettings
from slipstick.naming.study import Naming, name
from slipstick.recordings import Recordings
from slipstick.study.confidence import are_reported, confidence, evidence_of

TABLE = Path(__file__).with_name("blind_answers.csv")
HEADER = ("run", "commit", "settings", "case", "answer", "effect", "block", "quantity", "depends_on", "confidence",
          "others", "seconds")


def answered(file: Path) -> Naming:
    """The answer to a file with the default settings, on one core."""
    set_num_threads(1)
    return name(BENCHES[file.stem.split("-")[0]], Recordings.open(file), NamingSettings())


def _git(*arguments: str) -> str:
    return subprocess.run(["git", *arguments], capture_output=True, text=True, check=True).stdout.strip()


def main(files: list[Path]) -> None:
    """Answer all files with the default settings."""
    if _git("status", "--porcelain"):
        raise SystemExit("The tree has changes: commit them first, so that the rows name the code that gave them")
    commit = _git("rev-parse", "--short", "HEAD")
    earlier = list(csv.DictReader(TABLE.open())) if TABLE.exists() else []
    run = 1 + max((int(row["run"]) for row in earlier), default=0)
    settings = NamingSettings()
    rows: list[list[object]] = []
    with ProcessPoolExecutor(2) as pool:
        answers = list(pool.map(answered, files))
    for file, found in zip(files, answers, strict=True):
        start = [run, commit, settings.digest[:12], file.stem]
        seconds = round(found.seconds, 1)
        every = [evidence_of(finding, found.findings) for finding in found.findings]
        are = are_reported(every, [finding.nats for finding in found.findings])
        for finding, evidence, is_reported in zip(found.findings, every, are, strict=True):
            if is_reported:
                its = answer(finding, found.measured.get(finding.pair))
                rows.append([*start, its.kind, its.effect, "+".join(finding.blocks), *its.pair,
                             round(confidence(evidence), 2), "+".join(its.others), seconds])
        rows += [[*start, "unlisted", "", block, "", "", "", "", seconds] for block in found.lacking]
        if not found.findings and not found.lacking:
            rows.append([*start, "none", "", "", "", "", "", "", seconds])
    for row in rows:
        print(row, flush=True)
    with TABLE.open("a", newline="") as table:
        writer = csv.writer(table)
        if not earlier:
            writer.writerow(HEADER)
        writer.writerows(rows)


if __name__ == "__main__":
    main([Path(one) for one in sys.argv[1:]])
