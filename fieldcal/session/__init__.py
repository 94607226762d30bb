"""A session on disk: its description, samples, marks, and whether they are whole.

Only this package knows how the files of a session folder are laid out and written. It
calculates nothing from the samples. A new kind of sample file is a branch of `files`.
"""
