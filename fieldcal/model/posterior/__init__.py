"""What follows from the sets that were visited: probabilities, numbers, predictions.

Probabilities of causes and their aliases, mean and covariance mixed over hypotheses,
and residuals of positions that were held out. Only results are formed here; nothing
goes back into the search.
"""
