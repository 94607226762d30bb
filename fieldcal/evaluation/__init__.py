"""From a recorded session to a calibration: window means, observations, solution.

Here a session on disk meets the estimators, which see arrays only. No estimation is
done in this package, and nothing is printed.
"""
