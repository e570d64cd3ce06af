"""Query parameters: unknown and repeated ones are refused, because a misspelt one would be ignored otherwise.

Integers are decimal digits.
"""

import re
from collections import Counter
from difflib import get_close_matches
from typing import get_args, get_origin

from fastapi import Request, params
from fastapi.dependencies.models import Dependant
from fastapi.dependencies.utils import get_flat_params

from slipstick.errors import InvalidValue

_INTEGER = re.compile(r"-?[0-9]+")


class QueryNames:
    """The query parameters of a route, and which of them may be repeated."""

    def __init__(self, dependant: Dependant) -> None:
        fields = [field for field in get_flat_params(dependant)
                  if not isinstance(field.field_info, params.Path | params.Header | params.Cookie)]
        self.names = sorted(field.alias for field in fields)
        self.lists = {field.alias for field in fields if _has_list(field.field_info.annotation)}
        self.integers = {field.alias for field in fields if _has_integer(field.field_info.annotation)}

    def require(self, request: Request) -> None:
        """Raise `InvalidValue` for an unknown or repeated parameter."""
        for name, count in Counter(name for name, _ in request.query_params.multi_items()).items():
            if name not in self.names:
                nearest = get_close_matches(name[:100], self.names, n=1)
                hint = f"Did you mean '{nearest[0]}'? " if nearest else ""
                raise InvalidValue(f"There is no query parameter '{name[:100]}' here",
                                   f"{hint}Known: {', '.join(self.names) or 'none'}")
            if count > 1 and name not in self.lists:
                raise InvalidValue(f"The query parameter '{name}' is given {count} times", "Give it once")
            for value in request.query_params.getlist(name) if name in self.integers else ():
                if not _INTEGER.fullmatch(value):  # pydantic also reads 1_0 and 1.0
                    raise InvalidValue(f"The query parameter '{name}' is '{value[:100]}', not an integer",
                                       "Write decimal digits only")


def _has_list(annotation: object) -> bool:
    return get_origin(annotation) is list or any(_has_list(part) for part in get_args(annotation))


def _has_integer(annotation: object) -> bool:
    return annotation is int or any(_has_integer(part) for part in get_args(annotation))
