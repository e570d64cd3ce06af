"""What a cell of a text file states: a number, or a date with a time. Every reader of text goes by this grammar."""

import math
import re
from datetime import datetime

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?|[+-]?(inf(inity)?|nan)", re.ASCII | re.IGNORECASE)
_DAY_FIRST = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})[ T]+(.+)")
_TIME = re.compile(r"\d{1,2}:\d{2}:\d{2}(\.\d+)?")


TIME_OF_DAY = 1
"""The year of times without a date."""


def number(cell: str, decimal: str = ".") -> float | None:
    """The number that a cell states with the given decimal sign; None for other text, also for an empty cell.

    Neither thousands separators nor the underscores and further digits that Python accepts are part of a number.
    """
    text = cell.strip()
    if decimal != ".":
        if "." in text:
            return None
        text = text.replace(decimal, ".")
    if not _NUMBER.fullmatch(text):
        return None
    value = float(text)
    return None if math.isinf(value) and text[-1:].isdigit() else value  # 1e400 is no infinite reading


def timestamp(cell: str) -> datetime | None:
    """The time that a cell states: ISO 8601, day.month.year with a time, or a time of day; None for other text.

    `month/day/year` is none, because half of the world reads it as day/month. A time of day has the year `TIME_OF_DAY`.
    """
    text = cell.strip().replace(",", ".")
    if _TIME.fullmatch(text):
        whole, point, fraction = text.partition(".")
        text = f"000{TIME_OF_DAY}-01-01 {whole.zfill(8)}{point}{fraction}"
    elif date := _DAY_FIRST.fullmatch(text):
        day, month, year, rest = date.groups()
        text = f"{year}-{int(month):02}-{int(day):02} {rest}"
    if ":" not in text:
        return None
    try:
        return datetime.fromisoformat(text)
    except ValueError:
        return None
