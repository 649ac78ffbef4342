"""``pkm-gym movie``: a design on its path, as MuJoCo shows it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from pkm_gym.core.files import whole_file
from pkm_gym.studies.cli.arguments import machine_from
from pkm_gym.studies.cli.options import (
    DesignFileOption,
    DesignOption,
    HeightOption,
    Name,
    OutOption,
    WidthOption,
)
from pkm_gym.studies.cli.runs import output_path
from pkm_gym.studies.cli.terminal import console, counter

MOVIES = (".mp4", ".gif")


def command(
    name: Name,
    set_: DesignOption = None,
    design: DesignFileOption = None,
    seconds: Annotated[
        float,
        typer.Option(
            min=0.1, max=600.0, help="How long the way there and back, or once around, takes."
        ),
    ] = 4.0,
    fps: Annotated[int, typer.Option(min=1, max=60, help="Frames per second.")] = 25,
    width: WidthOption = 960,
    height: HeightOption = 720,
    out: OutOption = None,
) -> None:
    """Film a design on its path, there and back or once around; without one, the printed design.

    Writes runs/NAME/movie.mp4 if --out names no other file; .gif works too.

    Example: pkm-gym movie diamond --seconds 2 --out diamond.gif
    """
    path = output_path(out, name, "movie", MOVIES)
    write = _writer(path.suffix.lower(), fps)
    machine, notes = machine_from(name, set_, design)
    count = 2 * max(1, round(0.5 * seconds * fps))
    from pkm_gym.twin.camera import Camera
    from pkm_gym.twin.camera import movie as film

    with (
        Camera(width, height) as camera,
        whole_file(path) as part,
        write(part) as writer,
        counter(console(), "frames") as bar,
    ):
        line = bar.add_task("filmed", total=count)
        for frame in film(machine, camera, count):
            writer.append_data(frame)
            bar.advance(line)
    print(*notes, f"movie: {path}", sep="\n")


def _writer(form: str, fps: int) -> Callable[[Path], Any]:
    """Return the function that opens a movie's file for writing."""
    writer = import_module("imageio.v2").get_writer
    if form == ".gif":
        return partial(writer, duration=1000.0 / fps, loop=0)
    import_module("imageio_ffmpeg")
    return partial(writer, fps=fps, quality=8, macro_block_size=2, ffmpeg_log_level="error")
