"""The parts of a study's report: the page, its sentences, its limits, and what further experiments would decide."""

__all__ = ["fits", "further", "limits", "page", "words"]
