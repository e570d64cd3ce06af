"""What uploaded files were recorded on, as a child process learns it: the file of a bench, or the data of a machine."""

import json
from pathlib import Path

from slipstick.bench import Bench
from slipstick.machine import MachineDescription

Subject = Path | MachineDescription
"""The file of a bench, or what a machine declares; the file of a machine is never opened here."""


def name_subject(subject: Subject, **further: str | bool) -> bytes:
    """Return a line that says what files were recorded on, and what is asked about them."""
    named = {"machine": subject.to_json()} if isinstance(subject, MachineDescription) else {
        "bench": str(subject.resolve())}
    return json.dumps({**named, **further}).encode() + b"\n"


def open_subject(said: bytes) -> Bench | MachineDescription:
    """Return the bench that the line names, or what it says of a machine."""
    given = json.loads(said)
    return Bench.open(given["bench"]) if "bench" in given else MachineDescription.from_json(given["machine"])
