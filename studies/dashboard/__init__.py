"""Optuna's dashboard, and what it shows beside numbers."""
