"""Drawings, pictures and pages that are made from the code."""
