"""Real recordings of machines that others measured and published: what the engine says of them, beside what is known.

    python -m evidence.real FOLDER [MACHINE ...]

FOLDER has one folder for each machine, as its module says. The recordings are not part of this repository.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """A `value` with its standard `error`, in `unit`, beside the `published` value."""

    what: str
    value: float
    error: float
    unit: str
    published: float
