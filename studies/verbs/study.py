"""``pkm-gym study``: grid, search, polish and compare in one go, and what came out of it."""

from __future__ import annotations

import time
from typing import Annotated

from rich.text import Text

from pkm_gym.studies.cli.arguments import problem_from
from pkm_gym.studies.cli.bounds import TRIAL, check_memory
from pkm_gym.studies.cli.options import (
    DesignFileOption,
    FixOption,
    FreeOption,
    Name,
    ObjectiveOption,
    RangeOption,
    SeedOption,
    SetOption,
    TrialsOption,
    study_name_option,
)
from pkm_gym.studies.cli.terminal import BAD, HEAD, console
from pkm_gym.studies.comparison.study import study, summary
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
) -> None:
    """Evaluate a grid, search with Optuna, polish the best design, compare all ways.

    Everything goes to runs/NAME; the same command again goes on where it was.
    """
    problem = problem_from(name, set_, fix, range_, objective, free, file=design)
    check_memory("--trials", trials, TRIAL)
    screen = console()
    began = time.monotonic()
    best = study(problem, screen, trials=trials, seed=seed, name=study_name)
    screen.print(Text(f"\n{problem.title}, {time.monotonic() - began:.0f} s", style=HEAD))
    if not best.feasible[0]:
        screen.print(best.explain(0), style=BAD)
    for line in summary(best):
        screen.print(line, soft_wrap=True)
