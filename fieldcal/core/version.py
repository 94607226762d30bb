"""The version of fieldcal, as results and reports state it."""

__version__ = "0.1.0"
