"""Optuna studies of the design problems."""
