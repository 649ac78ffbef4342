"""From a figure to pixels or to a file."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from pkm_gym.core.files import whole_file

# What keeps two runs' files the same: no date, no version.
FORMATS = {
    ".png": {"Software": None},
    ".svg": {"Date": None, "Creator": None},
    ".pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}

# Matplotlib's font and mathematics caches are shared by all threads.
_drawing = threading.Lock()


def figure_to_array(figure: Figure) -> npt.NDArray[np.uint8]:
    """Return the figure's pixels: array (height, width, 3), uint8, of its own."""
    canvas = FigureCanvasAgg(figure)
    with _drawing:
        canvas.draw()  # type: ignore[no-untyped-call]  # matplotlib gives no type
        pixels = canvas.buffer_rgba()  # type: ignore[no-untyped-call]  # likewise
        return np.asarray(pixels, dtype=np.uint8)[..., :3].copy()


def text_width(figure: Figure, text: str, **style: Any) -> float:
    """Return how much of the figure's width a text takes in the given style."""
    with _drawing:
        probe = figure.text(0.0, 0.0, text, **style)
        pixels = float(probe.get_window_extent().width)
        probe.remove()
    return pixels / float(figure.bbox.width)


def save(figure: Figure, path: str | Path, *, dpi: float | None = None) -> Path:
    """Write the figure to a .png, .svg or .pdf file, whole or not at all, and return its path.

    Its folder is made.

    Raises:
        ValueError: for another extension.
        OSError: where the file can't be written.
    """
    path = Path(path)
    form = path.suffix.lower()
    if form not in FORMATS:
        raise ValueError(f"can't write {str(path)!r}: a picture's name ends in .png, .svg or .pdf")
    with whole_file(path) as part, _drawing:
        figure.savefig(part, format=form[1:], dpi=dpi or "figure", metadata=FORMATS[form])
    return path


def save_animation(figures: Iterable[Figure], path: str | Path, fps: float) -> Path:
    """Write figures of one size as the frames of an endless .gif, and return its path.

    Its folder is made. All frames share the first one's colours.

    Raises:
        OSError: where the file can't be written.
    """
    path = Path(path)
    frames = [Image.fromarray(figure_to_array(figure)) for figure in figures]
    palette = frames[0].quantize(128, Image.Quantize.MAXCOVERAGE)
    small = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    with whole_file(path) as part:
        small[0].save(
            part, format="GIF", save_all=True, append_images=small[1:], duration=1000.0 / fps,
            loop=0, optimize=False,
        )  # fmt: skip
    return path
