"""A recording from elsewhere becomes a session: read, checked, aligned and written.

What formats share lives here; the formats themselves are in ``importers/``, one a file.
A session is made whole or not at all.
"""
