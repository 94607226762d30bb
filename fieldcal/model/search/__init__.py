"""The search for the set of causes with the highest weight.

Single causes and pairs are offered to a set, the best are evaluated in full, and
`inference` moves the base state and searches again until both stay. Nothing here states
a probability; that is done in `posterior`.
"""
