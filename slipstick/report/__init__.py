"""Reports of jobs: one self-contained HTML page each."""

from slipstick.report.page import page
from slipstick.report.study.page import study_page

__all__ = ["page", "study_page"]
