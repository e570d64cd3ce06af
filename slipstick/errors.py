"""The errors of the public interface. Each has a `cause` (what is wrong) and a `remedy` (how to fix it)."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from numbers import Integral

_LONGEST_NAME, _MOST_LISTED = 100, 50
"""Maximum length of a name that a message quotes, and maximum number of names that it lists."""


def quoted(name: str) -> str:
    """A name or text of a file in quotes, shortened where it would make a message unreadable."""
    return f"'{name}'" if len(name) <= _LONGEST_NAME else f"'{name[:_LONGEST_NAME]}...'"


class SlipstickError(Exception):
    """Base class of all errors raised on purpose; `str()` gives the cause and the remedy in one line."""

    def __init__(self, cause: str, remedy: str) -> None:
        self.cause, self.remedy = cause, remedy
        super().__init__(f"{cause}. {remedy}.")

    def __reduce__(self) -> tuple[type, tuple[str, str]]:
        """Allow pickling, so that the error can be passed between processes."""
        return type(self), (self.cause, self.remedy)


class InvalidValue(SlipstickError):
    """A value has the wrong shape, unit or range, or is not finite."""


class UnknownName(SlipstickError):
    """There is no parameter, effect, table or recordings file with this name."""

    @classmethod
    def of(cls, kind: str, name: str, known: Iterable[str]) -> "UnknownName":
        """Build the error; the remedy suggests the closest of the `known` names and lists them."""
        names = sorted(known)
        closest = get_close_matches(name[:_LONGEST_NAME], names, n=1)
        hint = f"Did you mean {quoted(closest[0])}? " if closest else ""
        listed = ", ".join(names[:_MOST_LISTED]) if names else "none"
        if len(names) > _MOST_LISTED:
            listed += f" and {len(names) - _MOST_LISTED} more"
        return cls(f"There is no {kind} {quoted(name)}", f"{hint}Known: {listed}")


class BadRecording(SlipstickError):
    """A recordings file is invalid; the cause names the row and column, or the dataset."""


class BadBench(SlipstickError):
    """A bench file cannot be used; the cause names the key and the line."""


class BadMachine(SlipstickError):
    """A file that declares a machine cannot be used; the cause names the line."""


class BadTable(SlipstickError):
    """A table file is invalid."""


class WrongLayout(BadTable):
    """The file has another layout version, or is not a table."""


class WrongDigest(BadTable):
    """The content of the file does not match its stored digest."""


class CorruptTable(BadTable):
    """The file is damaged, incomplete or inconsistent."""


class RefusedTable(SlipstickError):
    """An uploaded table is invalid."""


class NoFolder(SlipstickError):
    """The folder of the tables does not exist, such as that of a disk that is not mounted."""


class LimitExceeded(SlipstickError):
    """A file would exceed a limit of the folder that is to hold it."""


class OutsideTable(SlipstickError):
    """A point lies outside the table and the policy for such points is `error`."""


def require_whole(**numbers: int | None) -> None:
    """Raise `InvalidValue` for an argument that is given and is not a whole number."""
    for name, number in numbers.items():
        if number is not None and (isinstance(number, bool) or not isinstance(number, Integral)):
            raise InvalidValue(f"`{name}` is {number!r}", "Give a whole number")


@contextmanager
def within_memory() -> Iterator[None]:
    """Raise `InvalidValue` instead of a `MemoryError`, which numbers that are too large cause; for `with`, or `@`."""
    try:
        yield
    except MemoryError as error:
        raise InvalidValue(f"This takes more memory than there is ({error})",
                           "Give smaller numbers, such as of samples, points, axes, engagements or runs") from error
