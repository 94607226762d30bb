"""The sentences of a diagnosis: what was found, and what to do next.

Text is made here from the parts in `findings`, and nowhere else; nothing is decided
here and no program reads these sentences.
"""
