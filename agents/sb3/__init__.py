"""Agents of Stable-Baselines3: their environments, training, networks and checkpoints."""
