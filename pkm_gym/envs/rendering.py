"""Pictures of a session's designs; what draws them is imported when the first is asked for."""

from __future__ import annotations

import os
import sys
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import logger

from pkm_gym.core.names import check_known
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

Frame = npt.NDArray[np.uint8]

RENDERERS = ("matplotlib", "mujoco")
TOOLKITS = ("macosx", "qtagg", "gtk4agg", "gtk3agg", "tkagg", "wxagg")  # as matplotlib tries them
NO_DISPLAY = (
    "render_mode='human' shows nothing: there is no display here, or no toolkit to open a window "
    "with; render_mode='rgb_array' returns the pictures"
)
BLANK = 235  # grey of a picture without a machine


class Painter:
    """Draws a problem's designs: as a sheet with map and numbers, or as MuJoCo's camera sees them.

    Args:
        problem: whose designs are drawn.
        renderer: "matplotlib" or "mujoco", which needs OpenGL; started with the first picture.

    Raises:
        ValueError: for another renderer, with its closest match.
    """

    def __init__(self, problem: DesignProblem, renderer: str) -> None:
        check_known("renderer", [renderer], RENDERERS)
        self.problem, self.renderer = problem, renderer
        self._camera: Any = None

    def frame(self, design: FloatArray, task: FloatArray) -> Frame:
        """Return the picture (height, width, 3) of a design (d,) on a packed task (m,).

        Raises:
            OSError: where MuJoCo can't draw.
        """
        if self.renderer == "mujoco":
            return self._photograph(design, task)
        from pkm_gym.plots import design_figure, figure_to_array

        return figure_to_array(design_figure(self.problem, design, self.problem.unpack(task)))

    def close(self) -> None:
        """Give OpenGL back."""
        if self._camera is not None:
            self._camera.close()

    def _photograph(self, design: FloatArray, task: FloatArray) -> Frame:
        from pkm_gym.twin.camera import Camera, picture

        if self._camera is None:
            self._camera = Camera()
        try:
            machine = self.problem.mechanism(design, self.problem.unpack(task))
            return picture(machine, self._camera)
        except ValueError:  # no machine, or one that reaches nothing
            return np.full((self._camera.height, self._camera.width, 3), BLANK, dtype=np.uint8)


class Window:
    """A window of its own that shows one picture after the other, until somebody closes it.

    It is apart from pyplot, so that what others choose or draw there makes no difference.
    """

    def __init__(self) -> None:
        self._manager: Any = None
        self._over = False  # closed, or never to be opened

    def show(self, painter: Painter, design: FloatArray, task: FloatArray) -> None:
        """Show a design (d,) on a packed task (m,); warn, once, where no window can be opened."""
        if self._manager is None and not self._over:
            self._open(painter.problem.title)
        if self._over:
            return
        canvas = self._manager.canvas
        canvas.figure.clear()
        axes = canvas.figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.imshow(painter.frame(design, task))
        axes.set_axis_off()
        canvas.draw()
        canvas.start_event_loop(0.001)

    def close(self) -> None:
        """Close the window."""
        manager, self._manager = self._manager, None
        if manager is not None and not self._over:
            manager.destroy()

    def __getstate__(self) -> dict[str, Any]:
        """Leave the window where it was opened."""
        return {"_manager": None, "_over": False}

    def _open(self, title: str) -> None:
        self._manager = _new_window(title)
        if self._manager is None:
            logger.warn(NO_DISPLAY)
            self._over = True
        else:
            self._manager.canvas.mpl_connect("close_event", self._closed)

    def _closed(self, _: Any) -> None:
        self._over = True


def _new_window(title: str) -> Any:
    """Return the manager of a new figure's window, by the first toolkit that opens one, or None."""
    from matplotlib.backends.registry import backend_registry
    from matplotlib.figure import Figure

    if sys.platform == "linux" and not any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY"))):
        return None
    for name in TOOLKITS:
        try:
            backend: Any = backend_registry.load_backend_module(name)  # type: ignore[no-untyped-call]  # matplotlib gives no type
            manager = backend.FigureCanvas.new_manager(Figure(figsize=(10.0, 6.0)), 0)
            manager.set_window_title(title)
            manager.show()
        except (Exception, SystemExit):  # each toolkit has its own for what it lacks
            continue
        return manager
    return None
