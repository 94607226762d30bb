"""Recalibrate an inertial measurement unit in the field, with honest uncertainty."""
