"""The constants that decide what is named, and their digest."""

import ast
import hashlib
import json
import math
from dataclasses import asdict, dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

from slipstick.errors import InvalidValue

_WITHIN: dict[str, tuple[float, float]] = {
    **dict.fromkeys(("knots", "fine_knots", "finer_knots"), (2, 100)), "smoothing": (0.1, 30), "fewest": (12, math.inf)}
"""Least and largest values, where not 0 and infinity. A line has two knots, a kernel of 0.1 samples smooths nothing,
and each of six folds needs two engagements; the largest values bound time and memory."""


@dataclass(frozen=True)
class NamingSettings:
    """What laws look like, and what a pair of quantity and dependence must show to be named; raises `InvalidValue`."""

    __pydantic_config__: ClassVar[dict[str, Any]] = {"use_attribute_docstrings": True, "extra": "forbid"}

    nats: float = 12.0
    """Least gain in natural log-likelihood. One odd engagement can give nats: `errors` is required as well."""
    errors: float = 4.0
    """Standard errors over engagements in which they must show a law, as a standard normal deviate. With 70 pairs
    tried, noise exceeds 3.6 once in a hundred sets of recordings."""
    apart: float = 2.5
    """Standard errors by which the best pair must lead another one, or both are reported as a tie."""
    further: float = 0.03
    """Share of what the first pair of a block explains that a further one must add. Less may be no more than what a
    free law with few knots leaves of the first."""
    most: int = 3
    """Pairs named in a block at most."""
    rivals: int = 3
    """Pairs fitted in full beside the best one."""
    knots: int = 5
    """Knots of a law over what is constant in an engagement, or of which an engagement shows little: more would fit the
    scatter. Over a constant with more values than knots there is one fewer, but at least two, at quantiles."""
    fine_knots: int = 9
    """Knots of a law over what runs through its range in each engagement, so that many samples determine each."""
    strong: float = 2.0
    """Reduced chi-square from which something is far off: full contact begins later if that of the onset is, because it
    relies on that, and a study without some of the signals says that something is missing if that of a channel is."""
    finer_knots: int = 17
    """Knots of a law in a block that is not explained without laws, at half the distance of 9: what few knots leave of
    a strong law would look like another one."""
    smoothing: float = 3.0
    """Standard deviation in samples of the Gaussian kernel that smooths signals until a block explains them. Columns of
    laws are computed from smooth signals, because those of noisy ones are biased; a wider kernel rounds off corners."""
    fewest: int = 24
    """Engagements that are needed at least. Gains are held out in six folds, and fewer engagements in each are too few
    for a standard error."""
    outlying: float = 6.0
    """Robust standard deviations of the logarithm of chi-square beyond which an engagement is set aside."""
    most_outlying: float = 0.1
    """Largest share of engagements that may be set aside. More is no accident, but something to name."""
    few_leave: float = 0.2
    """Share of what a block lacks that a law may leave which acts on too few engagements to gain in most. In three
    cases that asked for it right laws leave 0.03 to 0.15, and the best wrong ones 0.3 or more: half of this value loses
    a right law, and twice this value changes nothing there."""
    noise: float = 0.05
    """Standard error of the logarithm of chi-square that all engagements of a block share. A block whose chi-square
    exceeds 1 by more than `errors` standard errors, this one included, is not explained: by more than a fifth, as no
    model leaves nothing. The estimated noise itself contributes 0.009, the root mean square of the logarithm of
    chi-square over the blocks of the 15 development cases without an effect."""

    def __post_init__(self) -> None:
        """Refuse what cannot decide anything."""
        for setting in fields(self):
            value, is_whole = getattr(self, setting.name), isinstance(setting.default, int)
            least, largest = _WITHIN.get(setting.name, (0, math.inf))
            is_number = isinstance(value, int if is_whole else int | float) and not isinstance(value, bool)
            if not (is_number and least <= value <= largest):
                within = f"from {least} to {largest}" if largest < math.inf else f"of {least} or more"
                raise InvalidValue(f"{setting.name} is {value!r}", f"Give a {'whole ' * is_whole}number {within}")
        if self.most_outlying >= 0.5:
            raise InvalidValue(f"most_outlying is {self.most_outlying}", "Give less than half of the engagements")

    @property
    def digest(self) -> str:
        """SHA-256 of all settings and of the method."""
        return digest_of(self, "blocks", "naming", "engine")


def digest_of(settings: Any, *packages: str) -> str:
    """SHA-256 of the fields of `settings`, and of the code of these packages of slipstick, without its texts.

    Constants in the source decide as well: equal digests stand for the same method with the same settings.
    """
    hashed = hashlib.sha256(json.dumps(asdict(settings), sort_keys=True).encode())
    for package in packages:
        hashed.update(_read_code(package))
    return hashed.hexdigest()


@cache
def _read_code(package: str) -> bytes:
    """The code of a package of slipstick, which does not change while it runs: to parse it takes half a second."""
    sources = sorted((Path(__file__).parents[1] / package).glob("*.py"))
    assert sources, package
    return "".join(_code_of(path.read_text()) for path in sources).encode()


def _is_text(node: Any) -> bool:
    return (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str))


def _code_of(source: str) -> str:
    """The syntax tree of a module, without comments and without expressions that are texts, such as docstrings."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(body := getattr(node, "body", None), list):
            node.body = [each for each in body if not _is_text(each)]  # type: ignore[attr-defined]
    return ast.dump(tree)
