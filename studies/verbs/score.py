"""``pkm-gym score``: score logs of what a method evaluated."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pkm_gym.benchmark.record import EvaluationLog
from pkm_gym.benchmark.standings import check_log, standings
from pkm_gym.core.reading import about
from pkm_gym.studies.benchmark.scored import scored
from pkm_gym.studies.benchmark.tables import show
from pkm_gym.studies.cli.options import (
    CsvOption,
    PlainJsonOption,
)
from pkm_gym.studies.cli.output import Output


def command(
    files: Annotated[list[Path], typer.Argument(metavar="FILE ...", help="Logs of evaluations.")],
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Score logs of evaluations: regret, share solved, headline score, paired comparisons.

    The designs in them are evaluated anew. All logs must be of one problem and split.
    """
    out = Output(as_json, csv)
    measured = standings([read_log(path) for path in files])
    show(out.screen, measured)
    out.give(scored(measured))


def read_log(path: Path) -> EvaluationLog:
    """Return a log whose tasks are known.

    Raises:
        ValueError: in one sentence naming the file.
    """
    log = EvaluationLog.load(path)
    with about(path, "log of a run"):
        check_log(log)
    return log
