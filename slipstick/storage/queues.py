"""The queues of jobs: a worker runs one job of each at a time, so that a short job does not wait for a long one."""

QUEUES = "short", "long"
"""Names of the queues of jobs that any worker can do."""
_MACHINE = "machine "
"""Begin of the name of the queue of a machine: only workers that have its file take jobs from it."""


def name_machine_queue(machine: str) -> str:
    """Return the queue of the jobs that need a machine."""
    return f"{_MACHINE}{machine}"


def find_machine(queue: str) -> str | None:
    """Return the machine of a queue; None for jobs that any worker can do."""
    return queue.removeprefix(_MACHINE) if queue.startswith(_MACHINE) else None
