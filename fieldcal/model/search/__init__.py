"""The search for the set of causes with the highest weight.

`offers` names the causes that may be added to a set, each with a predicted score.
`selection` changes a set step by step until no change raises its weight. `gauss_newton`
moves the base state to the estimate of a set, `refinement` moves time constants and
instants off their grid, and `inference` does all of this in turn until set and state
stay the same. Nothing here states a probability; that is done in `posterior`.
"""
