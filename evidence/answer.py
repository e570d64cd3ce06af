"""What a method says of the recordings of a case, in the words of quantities and of what they depend on.

An answer of another program is a line of JSON: `{"case": NAME, "findings": [{"pair": [QUANTITY, DEPENDS_ON]}, ...]}`,
the largest finding first; all other entries may be left out.
"""

from dataclasses import asdict, dataclass, replace
from typing import Any

Pair = tuple[str, str]


@dataclass(frozen=True)
class NamedPair:
    """A finding: a quantity that depends on something, and the pairs that it is not told from, its `rivals`.

    `effect` is the name that a catalogue has for it, and `left_out` the one that remains if the catalogue lacks that
    name; both are empty for none. `confidence` is the stated probability that it is right. A finding is `reported`
    unless the method takes it for a consequence of another one.
    """

    pair: Pair
    rivals: tuple[Pair, ...] = ()
    effect: str = ""
    left_out: str = ""
    nats: float = 0.0
    confidence: float = 0.0
    reported: bool = True


@dataclass(frozen=True)
class LawOfPair:
    """A measured law: `change` (m,) of the quantity at `x` (m,), with standard errors `std` (m,).

    A change is a share of the quantity if it is `relative`, and is known up to `up_to`: nothing, a constant or a line.
    """

    pair: Pair
    x: list[float]
    change: list[float]
    std: list[float]
    relative: bool
    up_to: str


@dataclass(frozen=True)
class Answer:
    """The findings, the parts of the machine that are left `unexplained`, and what else a method says.

    `explanations` are pairs that would explain recordings in which the part that lacks something cannot be tested.
    `set_aside` are rows of runs that were not used. `error` is the exception that the method raised.
    """

    case: str
    findings: tuple[NamedPair, ...] = ()
    unexplained: tuple[str, ...] = ()
    explanations: tuple[Pair, ...] = ()
    set_aside: tuple[int, ...] = ()
    laws: tuple[LawOfPair, ...] = ()
    error: str = ""
    seconds: float = 0.0

    @property
    def is_silent(self) -> bool:
        """Whether nothing is said to be missing."""
        return not (self.findings or self.unexplained or self.explanations)

    @property
    def reported(self) -> "Answer":
        """The answer with the findings that are reported; what the others leave is not explained."""
        left = [block_of(each.pair) for each in self.findings if not each.reported]
        return replace(self, findings=tuple(each for each in self.findings if each.reported),
                       unexplained=tuple(dict.fromkeys((*self.unexplained, *left))))

    def to_json(self) -> dict[str, Any]:
        """Return the answer as JSON has it."""
        return asdict(self)

    @classmethod
    def from_json(cls, content: dict[str, Any]) -> "Answer":
        """Return the answer of `to_json`, or of another program."""
        findings = tuple(NamedPair(**{**each, "pair": tuple(each["pair"]),
                                      "rivals": tuple(tuple(rival) for rival in each.get("rivals", ()))})
                         for each in content.get("findings", ()))
        laws = tuple(LawOfPair(**{**each, "pair": tuple(each["pair"])}) for each in content.get("laws", ()))
        pairs = tuple(tuple(pair) for pair in content.get("explanations", ()))
        rest = {key: tuple(content[key]) for key in ("unexplained", "set_aside") if key in content}
        return cls(content["case"], findings, explanations=pairs, laws=laws, error=content.get("error", ""),
                   seconds=content.get("seconds", 0.0), **rest)


BLOCK = {"line pressure": "valve", "valve current": "valve", "valve delay": "valve", "pressure sensor": "valve",
         "load torque": "load", "brake torque": "load", "output speed sensor": "load",
         "input torque": "input", "converter torque": "input", "converter lag": "input",
         "input speed sensor": "input", "stick torque": "lock"}
"""Part of the machine in which a quantity acts; all others act in the clutch."""


def block_of(pair: Pair) -> str:
    """Return the part of the machine in which the quantity of a pair acts."""
    return BLOCK.get(pair[0], "clutch")
