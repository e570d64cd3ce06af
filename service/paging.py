"""Lists in pages: how many entries there are in all, and the addresses of the next and the previous page."""

from typing import Annotated

from fastapi import Query, Request
from pydantic import BaseModel, Field

Limit = Annotated[int, Query(ge=1, le=1000, description="Maximum number of entries to return.")]
Offset = Annotated[int, Query(ge=0, le=2**53, description="Number of entries to skip, in the order of the list.")]


class Page(BaseModel):
    """What the page of a list says about the whole list."""

    total: int = Field(description="Number of entries on all pages together, after the filters.")
    links: dict[str, str] = Field(description="Addresses of the pages `next` and `previous`, if there are any.")


def page_links(request: Request, limit: int, offset: int, total: int) -> dict[str, str]:
    """Return the addresses of the neighbouring pages, with the filters of the request."""
    pages = {"previous": max(0, offset - limit)} if offset else {}
    if offset + limit < total:
        pages["next"] = offset + limit
    return {name: f"{request.url.path}?{request.url.include_query_params(limit=limit, offset=start).query}"
            for name, start in pages.items()}
