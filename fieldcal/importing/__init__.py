"""Import: a recording of another program is read, validated, aligned and written.

What formats share lives here; the formats themselves are in ``importers/``, one a file.
A session is made whole or not at all. From below: `files` and `words` read bytes and
names, `recording` is what every format offers, `times` and `units` say what numbers
are, `headings`, `text`, `arrays`, `records` and `messages` find them in a file,
`tables` says which column is what, and `session` writes the folder.
"""
