"""The report of a fit: one HTML page that needs nothing but a browser."""

from slipstick.report.page import page

__all__ = ["page"]
