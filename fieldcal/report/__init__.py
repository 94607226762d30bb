"""The report: one page that opens offline and shows what a session found.

To add a section, write a module with a pure function of `ReportMaterial` that returns
blocks, and a line in `page.sections`. Nothing is estimated here.
"""

from fieldcal.report.gather import EarlierCalibration, ReportMaterial, gather
from fieldcal.report.page import render

__all__ = ["EarlierCalibration", "ReportMaterial", "gather", "render"]
