"""``pkm-gym score``: score logs of what a method evaluated."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pkm_gym.benchmark.record import EvaluationLog
from pkm_gym.benchmark.standings import standings
from pkm_gym.studies.benchmark.tables import show
from pkm_gym.studies.cli.terminal import console


def command(
    files: Annotated[list[Path], typer.Argument(metavar="FILE ...", help="Logs of evaluations.")],
) -> None:
    """Score logs of evaluations: regret, share solved, headline score, paired comparisons.

    The designs in them are evaluated anew. All logs must be of one problem and split.
    """
    show(console(), standings([EvaluationLog.load(path) for path in files]))
