"""Fronts of several objectives: gathered from studies, measured, weighed, drawn."""
