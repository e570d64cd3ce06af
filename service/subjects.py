"""What uploaded files were recorded on: a bench of the folder, or a declared machine that workers have told of."""

from contextlib import suppress
from typing import Annotated

from fastapi import Query

from slipstick.acquisition.subject import Subject
from slipstick.errors import InvalidValue
from slipstick.machine import MachineDescription
from slipstick.storage.library import Library

from .machines import Machines

ImportBench = Annotated[str | None, Query(
    description="Name of the bench of the files. Exactly one of `bench` and `machine` is given.",
    openapi_examples={"heavy": {"summary": "The shipped bench of the recordings `measured`", "value": "heavy"}})]
ImportMachine = Annotated[str | None, Query(
    description="Name of the declared machine of the files, of which a worker has told; the files become runs of it.")]


def find_subject(library: Library, machines: Machines, bench: str | None, machine: str | None) -> Subject:
    """Return the file of the bench, or what the machine declares.

    Raises `InvalidValue` unless exactly one is given, and `UnknownName`.
    """
    if bench is not None and machine is None:
        library.bench(bench)  # refuses an unknown one before files are read
        return library.folder / f"{bench}.toml"
    if machine is not None and bench is None:
        return find_declared(machines, machine)
    raise InvalidValue(f"{'A bench and a machine are' if bench else 'Neither a bench nor a machine is'} given",
                       "Give `bench` or `machine`, of which the files are")


def find_declared(machines: Machines, name: str) -> MachineDescription:
    """Return what a machine declares; raises `InvalidValue` for one that is simulated alone, and `UnknownName`."""
    declared = machines.find(name).known.declared
    if declared is None:
        raise InvalidValue(f"The machine '{name}' declares outputs, and no channels",
                           "Upload its measurements as CSV, or declare it in Python")
    return declared


def list_declared(machines: Machines) -> list[str]:
    """Return the names of the machines of which files can be imported; one that cannot be read is left out."""
    names = []
    for stored in machines.read_all():
        with suppress(InvalidValue):
            names += [stored.name] if stored.known.declared is not None else []
    return names
