"""Import: a recording of another program is read, validated, aligned and written.

What formats share lives here; the formats themselves are in ``importers/``, one a file.
A session is made whole or not at all.
"""
