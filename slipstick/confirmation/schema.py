"""How typed results become schemas."""

from typing import Any

DOCUMENTED: dict[str, Any] = {"use_attribute_docstrings": True}
"""As `__pydantic_config__` of a dataclass: the docstrings of its fields are their descriptions on the OpenAPI page."""
