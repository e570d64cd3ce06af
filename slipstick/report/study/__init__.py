"""The report of a study: page, sentences, limitations, and further experiments that resolve ties."""

__all__ = ["fits", "further", "limits", "page", "words"]
