"""Estimators: from window averages to parameters with their covariance."""
