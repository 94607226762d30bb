"""Recalibrate an inertial measurement unit in the field, with honest uncertainty."""

__version__ = "0.1.0"
