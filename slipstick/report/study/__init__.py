"""The report of a study: its content as parts, the page, and the comparison of fits on the tables of both models."""

__all__ = ["content", "findings", "fits", "glossary", "limits", "page", "parts", "simulation", "todo", "warnings",
           "words"]
