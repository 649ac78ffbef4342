"""Designers: trained agents that answer tasks, their files, and those that are shipped."""
