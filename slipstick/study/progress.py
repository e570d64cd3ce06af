"""What a running study is doing."""

from dataclasses import dataclass
from typing import Any, ClassVar, Literal

Stage = Literal["name", "confirm"]


@dataclass(frozen=True)
class StudyProgress:
    """What a running study is doing."""

    __pydantic_config__: ClassVar[dict[str, Any]] = {"use_attribute_docstrings": True}

    stage: Stage
    """`name`: the blocks of the model say what is missing. `confirm`: the simulation of the whole bench is fitted
    without and with it. A study that is interrupted resumes at the beginning of its stage."""
    doing: str
    """What it is doing, in words."""
