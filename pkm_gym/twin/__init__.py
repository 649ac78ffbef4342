"""MuJoCo twins: a second engine for every mechanism that has a ``twin.py``, and its camera."""
