"""``pkm-gym study``: grid, search, polish and compare in one go, and what came out of it."""

from __future__ import annotations

import time
from typing import Annotated

from rich.text import Text

from pkm_gym.studies.cli.arguments import problem_from
from pkm_gym.studies.cli.bounds import TRIAL, check_memory
from pkm_gym.studies.cli.options import (
    CsvOption,
    DesignFileOption,
    FixOption,
    FreeOption,
    Name,
    ObjectiveOption,
    PlainJsonOption,
    RangeOption,
    SeedOption,
    SetOption,
    TrialsOption,
    study_name_option,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.tasks import task_folder
from pkm_gym.studies.cli.terminal import BAD, HEAD
from pkm_gym.studies.comparison.compare import runs_of
from pkm_gym.studies.comparison.study import DESIGN, study, summary
from pkm_gym.studies.report.answer import handed_over
from pkm_gym.studies.report.records import told
from pkm_gym.studies.search.search import TRIALS


def command(
    name: Name,
    trials: TrialsOption = TRIALS,
    seed: SeedOption = 0,
    study_name: Annotated[
        str | None,
        study_name_option("What the names of its studies begin with; NAME if not said."),
    ] = None,
    set_: SetOption = None,
    design: DesignFileOption = None,
    free: FreeOption = None,
    fix: FixOption = None,
    range_: RangeOption = None,
    objective: ObjectiveOption = None,
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Evaluate a grid, search with Optuna, polish the best design, compare all ways.

    Everything goes to runs/NAME; the same command again goes on where it was.
    """
    problem = problem_from(name, set_, fix, range_, objective, free, file=design)
    check_memory("--trials", trials, TRIAL)
    out = Output(as_json, csv)
    screen = out.screen
    began = time.monotonic()
    done = study(problem, screen, out.bars, trials=trials, seed=seed, name=study_name)
    screen.print(Text(f"\n{problem.title}, {time.monotonic() - began:.0f} s", style=HEAD))
    if not done.best.feasible[0]:
        screen.print(done.best.explain(0), style=BAD)
    lines = summary(done.best)
    for line in lines:
        screen.print(line, soft_wrap=True)
    path = task_folder(problem) / DESIGN
    runs = runs_of(done.comparison)
    found = {"summary": lines, **handed_over(done.best, path), "runs": runs}
    out.give(told(problem, done.comparison.rows, **found))
