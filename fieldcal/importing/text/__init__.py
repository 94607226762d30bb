"""Texts with columns, and those that become such: lines, labels, tags, cells."""
