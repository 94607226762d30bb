"""The report: one page that opens offline and shows what a session found."""

from fieldcal.report.gather import Earlier, Material, gather
from fieldcal.report.page import render

__all__ = ["Earlier", "Material", "gather", "render"]
