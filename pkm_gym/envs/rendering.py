"""Pictures of a session's designs; what draws them is imported when the first is asked for."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from pkm_gym.core.names import check_known
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

Frame = npt.NDArray[np.uint8]


RENDERERS = ("matplotlib", "mujoco")
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
    """A window that shows one picture after the other; nothing, where there is no display."""

    def __init__(self) -> None:
        self._figure: Any = None

    def show(self, painter: Painter, design: FloatArray, task: FloatArray) -> None:
        """Show a design (d,) on a packed task (m,)."""
        if not _interactive():
            return
        from matplotlib import pyplot

        if self._figure is None:
            self._figure = pyplot.figure(painter.problem.title, figsize=(10.0, 6.0))
        self._figure.clear()
        axes = self._figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.imshow(painter.frame(design, task))
        axes.set_axis_off()
        pyplot.pause(0.001)

    def close(self) -> None:
        """Close the window."""
        if self._figure is not None:
            from matplotlib import pyplot

            pyplot.close(self._figure)
            self._figure = None

    def __getstate__(self) -> dict[str, Any]:
        """Leave the window where it was opened."""
        return {"_figure": None}


def _interactive() -> bool:
    """Return whether matplotlib's backend opens windows."""
    import matplotlib
    from matplotlib.backends.registry import backend_registry

    backend = matplotlib.get_backend()
    _, framework = backend_registry.resolve_backend(backend)  # type: ignore[no-untyped-call]  # matplotlib gives no type
    return framework is not None
