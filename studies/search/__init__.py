"""Searches of the design space: with Optuna, by a local polish, over a Family's tasks."""
