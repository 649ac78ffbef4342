"""The learned designer: a surrogate of the problem, what a session teaches, and a plan."""
