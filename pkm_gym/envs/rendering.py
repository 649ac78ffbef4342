"""Pictures of a session's designs; matplotlib is imported when the first one is asked for."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

Frame = npt.NDArray[np.uint8]


def frame(problem: DesignProblem, design: FloatArray, task: FloatArray) -> Frame:
    """Return the picture (height, width, 3) of a design (d,) on a packed task (m,)."""
    from pkm_gym.plots import design_figure, figure_to_array

    return figure_to_array(design_figure(problem, design, problem.unpack(task)))


class Window:
    """A window that shows one picture after the other; nothing, where there is no display."""

    def __init__(self) -> None:
        self._figure: Any = None

    def show(self, problem: DesignProblem, design: FloatArray, task: FloatArray) -> None:
        """Show a design (d,) on a packed task (m,)."""
        if not _interactive():
            return
        from matplotlib import pyplot

        if self._figure is None:
            self._figure = pyplot.figure(problem.title, figsize=(10.0, 6.0))
        self._figure.clear()
        axes = self._figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.imshow(frame(problem, design, task))
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
