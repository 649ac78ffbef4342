"""Agents that learn to design, and the trained ones that are shipped."""
