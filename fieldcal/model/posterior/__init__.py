"""Results of the visited sets: probabilities, estimates, predictions.

Probabilities of causes and their aliases, mean and covariance mixed over hypotheses,
and residuals of held-out positions. To find aliases, `probabilities` visits further
sets; if one of them is better than the best, `diagnosis.explain` resumes the search.
"""
