"""What the application holds for its routes, as dependencies of these."""

from typing import Any

from fastapi import Depends, Request


def held(name: str) -> Any:
    """Dependency: what the state of the application has under a `name`."""
    # A coroutine, because FastAPI calls any other dependency in a thread, which takes longer than an evaluation.
    async def read(request: Request) -> Any:
        return getattr(request.app.state, name)

    return Depends(read)
