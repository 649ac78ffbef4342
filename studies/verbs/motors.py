"""``pkm-gym motors``: the smallest motor and gear that carry a design's cycle."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from pkm_gym.core.motors import read_motors
from pkm_gym.studies.cli.arguments import design_from
from pkm_gym.studies.cli.options import DesignFileOption, DesignOption, Name, json_option
from pkm_gym.studies.report.motors import choose, content, show_choice


def command(
    name: Name,
    set_: DesignOption = None,
    design: DesignFileOption = None,
    motors: Annotated[
        Path | None,
        typer.Option(
            "--table",
            metavar="FILE",
            help="Motors and gears of your own (TOML); those that are shipped if not said.",
            show_default=False,
        ),
    ] = None,
    as_json: Annotated[bool, json_option("Print JSON in SI units only.")] = False,
) -> None:
    """Pick the smallest motor and gear that carry a design's cycle; without one, the printed one's.

    Every motor of the table is tried with every gear and without one: peak torque, rms torque and
    speed, with the inertia of rotor and gear, and what the gear bears. The smallest is the lightest
    motor, with its lightest gear. The exit code is 1 where none carries the cycle.

    Example: pkm-gym motors diamond --set inertia=static task.payload=1.5kg
    """
    table = read_motors(motors)
    choice = choose(design_from(name, set_, file=design), table)
    if as_json:
        print(json.dumps(content(choice), indent=2))
    else:
        show_choice(choice)
    if choice.picked is None:
        raise typer.Exit(1)
