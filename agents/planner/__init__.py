"""The designer that plans: a surrogate of the problem, what a session teaches, and a plan."""
