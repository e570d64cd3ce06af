"""Reports of fits and studies: one HTML page each that needs nothing but a browser."""

from slipstick.report.page import page
from slipstick.report.study.page import study_page

__all__ = ["page", "study_page"]
