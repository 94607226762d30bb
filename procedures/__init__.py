"""Procedures: generators of steps, one a file."""
