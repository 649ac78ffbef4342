"""MuJoCo twins: a second engine for every mechanism that has a ``twin.py``, and its camera.

Without a screen, MuJoCo draws through EGL where there is one; the environment variable MUJOCO_GL
says otherwise. MuJoCo reads it when it is imported, which this package does after it.
"""

import ctypes
import os
import sys
from importlib import import_module


def _draw_without_screen() -> None:
    if sys.platform != "linux" or any(os.environ.get(n) for n in ("DISPLAY", "WAYLAND_DISPLAY")):
        return
    try:
        ctypes.CDLL("libEGL.so.1")
    except OSError:
        return
    os.environ.setdefault("MUJOCO_GL", "egl")


def _start() -> None:
    try:
        import_module("mujoco")
    except RuntimeError as error:  # for a MUJOCO_GL that it doesn't know
        raise OSError(f"MuJoCo does not start: {error}") from error


_draw_without_screen()
_start()
