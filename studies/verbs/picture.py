"""``pkm-gym picture``: a design as MuJoCo shows it."""

from __future__ import annotations

from typing import Annotated

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

PICTURES = (".png",)


def command(
    name: Name,
    set_: DesignOption = None,
    design: DesignFileOption = None,
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
    path = output_path(out, name, "picture", PICTURES)
    machine, notes = machine_from(name, set_, design)
    poses = machine.sample_poses()
    if pose >= len(poses):
        raise ValueError(f"--pose {pose} is none of the {len(poses)} poses: 0 to {len(poses) - 1}")
    from PIL import Image

    from pkm_gym.twin.camera import Camera
    from pkm_gym.twin.camera import picture as photograph

    with Camera(width, height) as camera:
        pixels = photograph(machine, camera, poses[pose] if pose else None)
        with whole_file(path) as part:
            Image.fromarray(pixels).save(part)
    print(*notes, f"picture: {path}", sep="\n")
