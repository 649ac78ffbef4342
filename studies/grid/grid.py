"""A grid evaluated in one call, as an atlas and as a study of its best."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from optuna import Study, create_trial
from optuna.distributions import BaseDistribution, FloatDistribution
from optuna_dashboard import get_note  # type: ignore[attr-defined]  # has no __all__
from rich.console import Console

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.trial import trial_attributes, trial_values
from pkm_gym.studies.cli.runs import if_full
from pkm_gym.studies.cli.tasks import task_folder
from pkm_gym.studies.cli.terminal import counter
from pkm_gym.studies.dashboard.notes import write_note
from pkm_gym.studies.dashboard.pictures import Pictures
from pkm_gym.studies.grid.atlas import atlas, save_atlas
from pkm_gym.studies.grid.designs import grid_designs, grid_in_words, grid_name
from pkm_gym.studies.search.samplers import constraints_of
from pkm_gym.studies.storage.storages import artifact_folder, default_storage, open_storage, quiet
from pkm_gym.studies.storage.studies import count_finished, open_study

LOGGED = 200  # how many of the best feasible designs the study gets
PARTS = 50  # of a grid, evaluated one after the other


def evaluate_grid(
    problem: DesignProblem,
    step: float | None = None,
    progress: Callable[[int], None] = lambda _: None,
) -> Evaluation:
    """Evaluate a grid within the problem's bounds, the paper's or ours: see ``grid_designs``.

    ``progress`` is called after every part of it with the number of its designs.
    """
    designs, parts = grid_designs(problem, step), []
    for part in np.array_split(designs, min(PARTS, len(designs))):
        parts.append(problem.evaluate(part))
        progress(len(part))
    return Evaluation.joined(parts)


@contextmanager
def grid_bar(
    screen: Console, problem: DesignProblem, step: float | None = None
) -> Iterator[Callable[[int], None]]:
    """Give the ``progress`` of a grid that moves a bar."""
    with counter(screen, "designs") as bar:
        line = bar.add_task(grid_name(problem, step), total=len(grid_designs(problem, step)))
        yield lambda count: bar.advance(line, count)


def log_best(study: Study, evaluation: Evaluation) -> int:
    """Add the best feasible designs of an evaluation that a study lacks; return how many it has."""
    problem = evaluation.problem
    space: dict[str, BaseDistribution] = {
        v.name: FloatDistribution(v.low, v.high) for v in problem.variables
    }
    best = [i for i in evaluation.ranking()[:LOGGED].tolist() if evaluation.feasible[i]]
    values = trial_values(evaluation)
    study.add_trials(
        create_trial(
            values=values[i].tolist(),
            params=dict(zip(problem.variable_names, evaluation.designs[i].tolist(), strict=True)),
            distributions=space,
            user_attrs=trial_attributes(evaluation, i),
            constraints=constraints_of(evaluation, i),
        )
        for i in best[count_finished(study) :]
    )
    return len(best)


def grid(
    problem: DesignProblem,
    *,
    step: float | None = None,
    storage: str | None = None,
    name: str | None = None,
    output: Path | None = None,
    command: str = "",
    progress: Callable[[int], None] = lambda _: None,
) -> Evaluation:
    """Evaluate a grid, write the atlas and log its best feasible designs in a study.

    Args:
        problem: what is evaluated, with its task.
        step: of a grid over the bounds, in the variables' SI units; without one it is the
            problem's own grid, or where it has none, ours with the steps that the variables
            declare.
        storage: a journal file or a database URL; the problem's journal under runs/ by default.
        name: of the study; the problem's name, "grid" and the step by default.
        output: the atlas; runs/NAME/grid.nc by default.
        command: kept with the atlas and the study.
        progress: called after every part of the grid with the number of its designs.

    Raises:
        ValueError: in one sentence, for no such grid or a study that stands for something else.
    """
    evaluation = evaluate_grid(problem, step, progress)
    where = storage or default_storage(problem.name)
    folder = artifact_folder(where)
    with quiet(), if_full("what is whole is kept, and the same command makes the rest", folder):
        study = open_study(
            problem, open_storage(where), name or grid_study_name(problem, step), command=command
        )
        save_atlas(atlas(evaluation, command), output or task_folder(problem) / "grid.nc")
        if log_best(study, evaluation) == 0 or get_note(study):
            return evaluation
        best = problem.evaluate(evaluation.designs[evaluation.best()][None])
        pictures = Pictures(problem, study, folder)
        pictures.promise(study, best)
        write_note(study, best, best_of_grid(problem, step), pictures.draw(study, best.designs[0]))
    return evaluation


def grid_study_name(problem: DesignProblem, step: float | None) -> str:
    """Return the name of a grid's study."""
    return f"{problem.name}-grid" if step is None else f"{problem.name}-grid-{step:g}"


def best_of_grid(problem: DesignProblem, step: float | None) -> str:
    """Return what the best design of a grid is called."""
    return f"best of {grid_name(problem, step)}"


def grid_line(evaluation: Evaluation, step: float | None = None) -> str:
    """Return how many designs a grid has, whose it is and how many are feasible."""
    whose, feasible = grid_in_words(evaluation.problem, step), int(evaluation.feasible.sum())
    return f"{len(evaluation):,} designs of {whose}, {feasible:,} feasible"
