"""Calibrations of all devices in SQLite, and how parameters change in time.

History judges whether a result fits the earlier ones of its device; it never enters an
estimate. Only `store` reads and writes the database.
"""
