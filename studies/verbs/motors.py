"""``pkm-gym motors``: the smallest motor and gear that carry a design's cycle."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pkm_gym.core.motors import read_motors
from pkm_gym.studies.cli.arguments import design_from
from pkm_gym.studies.cli.options import (
    CsvOption,
    DesignFileOption,
    DesignOption,
    Name,
    PlainJsonOption,
)
from pkm_gym.studies.cli.output import Output
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
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Pick the smallest motor and gear that carry a design's cycle; without one, the printed one's.

    Every motor of the table is tried with every gear and without one: peak torque, rms torque and
    speed, with the inertia of rotor and gear, and what the gear bears. The smallest is the lightest
    motor, with its lightest gear. The exit code is 1 where none carries the cycle.

    Example: pkm-gym motors diamond --set inertia=static task.payload=1.5kg
    """
    sent = Output(as_json, csv)
    choice = choose(design_from(name, set_, file=design), read_motors(motors))
    show_choice(sent.screen, choice)
    sent.give(content(choice))
    if choice.picked is None:
        raise typer.Exit(1)
