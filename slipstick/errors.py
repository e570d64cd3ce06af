"""Every error a caller can meet: each says what is wrong (`cause`) and what to do about it (`remedy`)."""

from collections.abc import Iterable
from difflib import get_close_matches


class SlipstickError(Exception):
    """Base of all errors raised on purpose; `str()` gives the cause and the remedy in one line."""

    def __init__(self, cause: str, remedy: str) -> None:
        self.cause, self.remedy = cause, remedy
        super().__init__(f"{cause}. {remedy}.")

    def __reduce__(self) -> tuple[type, tuple[str, str]]:
        """Survive the way back from a worker process."""
        return type(self), (self.cause, self.remedy)


class InvalidValue(SlipstickError):
    """A value has the wrong shape, unit, range or is not finite."""


class UnknownName(SlipstickError):
    """No parameter, effect, table or recording of that name."""

    @classmethod
    def of(cls, kind: str, name: str, known: Iterable[str]) -> "UnknownName":
        """Build the error from what was asked for and what there is, with the nearest spelling first."""
        names = sorted(known)
        near = get_close_matches(name, names, n=1)
        hint = f"Did you mean '{near[0]}'? " if near else ""
        listed = ", ".join(names) if names else "none so far"
        return cls(f"There is no {kind} '{name}'", f"{hint}Known: {listed}")


class BadRecording(SlipstickError):
    """A recordings file cannot be used; the cause names the row and the column."""


class BadTable(SlipstickError):
    """A table file cannot be trusted."""


class WrongLayout(BadTable):
    """The file is of another layout version, or no table at all."""


class WrongDigest(BadTable):
    """What the file says it holds is not what it holds."""


class CorruptTable(BadTable):
    """Bits are missing or flipped."""


class OutsideTable(SlipstickError):
    """A point lies beyond the axes of the table and the caller asked for an error."""
