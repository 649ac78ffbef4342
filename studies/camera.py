"""``pkm-gym picture``, ``movie`` and ``export``: a design as MuJoCo shows it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from pkm_gym.core.mechanism import Mechanism
from pkm_gym.studies.arguments import DesignOption, Name, design_from, problem_from
from pkm_gym.studies.terminal import console, counter

if TYPE_CHECKING:
    from pkm_gym.twin.camera import Camera

OutOption: TypeAlias = Annotated[
    Path | None,
    typer.Option("--out", "-o", metavar="FILE", help="Where it goes.", show_default=False),
]
WidthOption: TypeAlias = Annotated[int, typer.Option(min=64, max=3840, help="Pixels.")]
HeightOption: TypeAlias = Annotated[int, typer.Option(min=64, max=2880, help="Pixels.")]

PICTURES = (".png",)
MOVIES = (".mp4", ".gif")
MODELS = (".xml",)


def picture(
    name: Name,
    set_: DesignOption = None,
    pose: Annotated[
        int, typer.Option(min=0, help="Which of the machine's telling poses, 0 being the first.")
    ] = 0,
    width: WidthOption = 1600,
    height: HeightOption = 1200,
    out: OutOption = None,
) -> None:
    """Photograph a design; without one, the design that the paper prints.

    Writes runs/NAME/picture.png if --out names no other file.

    Example: pkm-gym picture spr3 --pose 1 --out spr3.png
    """
    path = _path(out, name, "picture", PICTURES)
    machine, notes = _machine(name, set_)
    poses = machine.sample_poses()
    if pose >= len(poses):
        raise ValueError(f"--pose {pose} is none of the {len(poses)} poses: 0 to {len(poses) - 1}")
    with _camera(width, height) as camera:
        from PIL import Image

        from pkm_gym.twin.camera import picture as photograph

        pixels = photograph(machine, camera, poses[pose] if pose else None)
        with _whole(path) as part:
            Image.fromarray(pixels).save(part)
    print(*notes, f"picture: {path}", sep="\n")


def movie(
    name: Name,
    set_: DesignOption = None,
    seconds: Annotated[
        float, typer.Option(min=0.1, max=600.0, help="How long the way there and back takes.")
    ] = 4.0,
    fps: Annotated[int, typer.Option(min=1, max=60, help="Frames per second.")] = 25,
    width: WidthOption = 960,
    height: HeightOption = 720,
    out: OutOption = None,
) -> None:
    """Film a design on the paper's path, there and back; without one, the printed design.

    Writes runs/NAME/movie.mp4 if --out names no other file; .gif works too.

    Example: pkm-gym movie diamond --seconds 2 --out diamond.gif
    """
    path = _path(out, name, "movie", MOVIES)
    write = _writer(path.suffix.lower(), fps)
    machine, notes = _machine(name, set_)
    count = 2 * max(1, round(0.5 * seconds * fps))
    with _camera(width, height) as camera, _whole(path) as part:
        from pkm_gym.twin.camera import movie as film

        with write(part) as writer, counter(console(), "frames") as bar:
            line = bar.add_task("filmed", total=count)
            for frame in film(machine, camera, count):
                writer.append_data(frame)
                bar.advance(line)
    print(*notes, f"movie: {path}", sep="\n")


def export(name: Name, set_: DesignOption = None, out: OutOption = None) -> None:
    """Write the MuJoCo model (MJCF) of a design; without one, of the design that the paper prints.

    Writes runs/NAME/twin.xml if --out names no other file. Open it with
    python -m mujoco.viewer --mjcf=FILE: its servos hold the pose, their sliders move it.

    Example: pkm-gym export diamond --set l1=260mm e=150mm l2=640mm H=493mm --out diamond.xml
    """
    path = _path(out, name, "twin", MODELS)
    machine, notes = _machine(name, set_)
    from pkm_gym.twin.camera import first_pose
    from pkm_gym.twin.model import twin_module

    spec = twin_module(machine).build(machine, first_pose(machine))
    spec.compile()
    with _whole(path) as part:
        part.write_text(spec.to_xml(), encoding="utf-8")
    print(*notes, f"model: {path}", sep="\n")


def _machine(name: str, set_: list[str] | None) -> tuple[Mechanism, tuple[str, ...]]:
    """Return the machine of a design, and how the design was completed."""
    problem = problem_from(name, set_, takes_design=True)
    given = design_from(problem, set_)
    return problem.mechanism(given.design, given.task), given.notes


def _writer(form: str, fps: int) -> Callable[[Path], Any]:
    """Return the function that opens a movie's file for writing."""
    writer = import_module("imageio.v2").get_writer
    if form == ".gif":
        return partial(writer, duration=1000.0 / fps, loop=0)
    import_module("imageio_ffmpeg")
    return partial(writer, fps=fps, quality=8, macro_block_size=2, ffmpeg_log_level="error")


def _path(out: Path | None, name: str, stem: str, forms: tuple[str, ...]) -> Path:
    """Return where to write, its folder made.

    Raises:
        ValueError: for a name of another form.
    """
    path = out or Path("runs") / name / f"{stem}{forms[0]}"
    if path.suffix.lower() not in forms:
        raise ValueError(f"can't write {str(path)!r}: its name must end in {' or '.join(forms)}")
    return path


@contextmanager
def _whole(path: Path) -> Iterator[Path]:
    """Give a file to write to that takes the path's place when it is whole."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _camera(width: int, height: int) -> Camera:
    from pkm_gym.twin.camera import Camera

    return Camera(width, height)
