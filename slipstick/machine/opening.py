"""Open the Python file that declares a machine. It is run, with the rights of whoever opens it."""

import sys
import traceback
import types
from pathlib import Path

from slipstick.errors import BadMachine, InvalidValue, UnknownName
from slipstick.machine.declaration import Machine
from slipstick.machine.trial import try_equations
from slipstick.storage.shipped import FOLDER, file_of

NAME = "MACHINE"
"""What a file calls its machine."""


def open_machine(path: Path | str) -> Machine:
    """Return the machine that a Python file declares as `MACHINE`; a plain name may be that of a shipped machine.

    Modules beside the file may be imported by it. Raises `UnknownName` where there is no file, and `BadMachine`, with
    the line, where the file cannot be run or declares no machine, or where its equations fail.
    """
    path = file_of(path, ".py", "machines")
    if not path.is_file():
        shipped = [other.stem for other in (FOLDER / "machines").glob("*.py")]
        raise UnknownName.of("machine", path.name, [*shipped, *(other.name for other in path.parent.glob("*.py"))])
    if path.suffix != ".py":  # such as a bench, of which a line would be called wrong
        raise BadMachine(f"{path.name} is no Python file, and declares no machine",
                         "Give the file that declares it; `slipstick machine new FILE.py` writes a template")
    module, folder = types.ModuleType(path.stem), str(path.resolve().parent)
    module.__file__ = str(path)
    sys.path.insert(0, folder)
    try:
        exec(compile(path.read_bytes(), str(path), "exec"), module.__dict__)
    except InvalidValue as error:
        raise BadMachine(f"{_place(path, error)}: {error.cause}", error.remedy) from error
    except SyntaxError as error:
        raise BadMachine(f"{path.name}, line {error.lineno}: {error.msg}", "Correct the line") from error
    except Exception as error:
        raise BadMachine(f"{_place(path, error)}: {type(error).__name__}: {error}", "Correct the line") from error
    finally:
        sys.path.remove(folder)
    machine = module.__dict__.get(NAME)
    if not isinstance(machine, Machine):
        raise BadMachine(f"{path.name} declares no {NAME}",
                         f"Write {NAME} = Machine(...); `slipstick machine new FILE` writes a template")
    try:
        try_equations(machine)
    except InvalidValue as error:
        raise BadMachine(f"{path.name}: {error.cause}", error.remedy) from error
    return machine


def _place(path: Path, error: Exception) -> str:
    """Return the file and the last line of it that led to an error."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    return f"{path.name}, line {lines[-1]}" if lines else path.name
