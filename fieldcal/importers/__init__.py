"""Recordings of others made into sessions, one format a file.

To add one, write importers/<name>.py with ``WHAT`` (a line for the help),
``recognises(head, path)``, which judges a file by its first bytes, and a subclass of
`recording.Recording` called ``File``. Nothing is guessed in silence: units and the
sensor of several are named by the file, or by the user.
"""
