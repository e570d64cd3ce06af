"""Dates with times, and times of day, as text files have them in their column of time."""

import re
from datetime import UTC, datetime

_DAY_FIRST = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})[ T]+(.+)")
_TIME = re.compile(r"\d{1,2}:\d{2}:\d{2}(\.\d+)?")


def timestamp(cell: str) -> datetime | None:
    """The time that a cell states: ISO 8601, day.month.year with a time, or a time of day; None for other text.

    `month/day/year` is none, because half of the world reads it as day/month. Without a time zone it is taken as UTC,
    of which only differences matter.
    """
    text = cell.strip().replace(",", ".")
    if _TIME.fullmatch(text):
        whole, point, fraction = text.partition(".")
        text = f"2000-01-01 {whole.zfill(8)}{point}{fraction}"
    elif found := _DAY_FIRST.fullmatch(text):
        day, month, year, rest = found.groups()
        text = f"{year}-{int(month):02}-{int(day):02} {rest}"
    if ":" not in text:
        return None
    try:
        stated = datetime.fromisoformat(text)
    except ValueError:
        return None
    return stated if stated.tzinfo else stated.replace(tzinfo=UTC)
