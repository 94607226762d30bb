"""Drivers: one link a file, found by its scheme."""
