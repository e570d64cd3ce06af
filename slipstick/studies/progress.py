"""What a running study is doing, in words, and its share of the steps."""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, get_args

from slipstick.naming.asked import Asked, steps
from slipstick.naming.block import Pair
from slipstick.recordings.signals import open_blocks
from slipstick.studies.words import SIGNALS, title

Stage = Literal["name", "confirm"]
Confirming = Literal["fit", "compare", "predict"]
"""The steps of the stage `confirm`."""


@dataclass(frozen=True)
class StudyProgress:
    """What a running study is doing."""

    __pydantic_config__: ClassVar[dict[str, Any]] = {"use_attribute_docstrings": True}

    stage: Stage
    """`name`: the blocks of the model are tested for what is missing. `confirm`: the simulation of the whole bench is
    fitted without and with it. A study that is interrupted resumes at the beginning of its stage."""
    step: int
    """Its current step, from 1. If engagements are set aside, the blocks are fitted once more without them, and the
    number goes back; so it does where the blocks of a machine are studied apart after all."""
    steps: int
    """Number of its steps, which follows from the recorded signals. Where nothing is found in a declared machine, the
    steps of `confirm` are left out."""
    done: float
    """Share of the steps that are complete, as a number from 0 to 1. It never falls within a stage. Steps differ in
    duration, by how much is not known before, and so neither is the time left."""
    doing: str
    """What it is doing, in words: the blocks that it tests, and the law that it tries in them."""
    budget_left: float | None = None
    """What is left of the time budget in s when it said so; null without a budget. What it has then is its result."""


Log = Callable[[StudyProgress], None]


class Steps:
    """The steps of a study by their `names`, which are reported to `log` one after the other."""

    def __init__(self, names: Sequence[str], log: Log) -> None:
        self.names, self.log, self.furthest = names, log, 0

    def report(self, stage: Stage, name: str, doing: str) -> None:
        """Report a step, and what it is `doing`, in words."""
        complete = self.names.index(name)
        self.furthest = max(self.furthest, complete)
        self.log(StudyProgress(stage, complete + 1, len(self.names), self.furthest / len(self.names), doing))


class StudySteps(Steps):
    """The steps of a study of recordings with these signals."""

    def __init__(self, signals: Collection[str], log: Log) -> None:
        super().__init__((*steps(open_blocks(signals)), *get_args(Confirming)), log)

    def report_naming(self, question: Asked) -> None:
        """Report a step of the stage `name`."""
        self.report("name", question.step, _describe(question))

    def report_confirming(self, step: Confirming, doing: str) -> None:
        """Report a step of the stage `confirm`."""
        self.report("confirm", step, doing)


def _describe(question: Asked) -> str:
    if question.step == "engagements":
        return "Looking for engagements that are far worse than all others"
    where = _blocks(question.blocks)
    if question.tries is not None:
        return f"{where}: trying “{_law(question.tries)}”"
    if question.compares:
        return f"{where}: comparing what each law would explain"
    return f"{where}: fitting the parameters" + (" up to full contact" if question.step == "onset" else "")


def _law(pair: Pair) -> str:
    words = title(pair, None)
    return words[0].lower() + words[1:]


def _blocks(names: Iterable[str]) -> str:
    shown = [f"“{SIGNALS[name]}”" for name in names]
    return f"Block {shown[0]}" if len(shown) == 1 else f"Blocks {', '.join(shown[:-1])} and {shown[-1]}"
