"""Bytes of a file: unpacked, as UTF-8, spooled to disk."""
