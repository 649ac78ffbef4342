"""``pkm-gym grid``: a grid in one call, as an atlas and as a study of its best."""

from __future__ import annotations

import json
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer
from optuna import Study, create_trial
from optuna.distributions import BaseDistribution, FloatDistribution

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.trial import trial_attributes, trial_values
from pkm_gym.studies.arguments import (
    FixOption,
    Name,
    ObjectiveOption,
    RangeOption,
    SetOption,
    problem_from,
)
from pkm_gym.studies.artifacts import Pictures, write_note
from pkm_gym.studies.report import ranking, rich_table, rows_beside_paper, whole_file
from pkm_gym.studies.samplers import constraints_of
from pkm_gym.studies.search import StorageOption, own_command
from pkm_gym.studies.starts import STEP, grid_designs, grid_name
from pkm_gym.studies.storage import (
    artifact_folder,
    count_finished,
    default_storage,
    open_storage,
    open_study,
    quiet,
    redacted,
    run_folder,
)
from pkm_gym.studies.terminal import BAD, console

if TYPE_CHECKING:
    import xarray

LOGGED = 200  # how many of the best feasible designs the study gets


def evaluate_grid(problem: DesignProblem, step: float | None = None) -> Evaluation:
    """Evaluate the paper's grid within the problem's bounds, or ours: see ``grid_designs``."""
    return problem.evaluate(grid_designs(problem, step))


def atlas(evaluation: Evaluation, command: str = "") -> xarray.Dataset:
    """Return an evaluated grid as a Dataset: a dimension a variable.

    It holds every index by name, ``constraints`` (with the dimension ``constraint``), ``feasible``
    and ``merit``; units and descriptions are attributes. Where the grid has a hole, values are NaN.
    """
    import xarray

    problem = evaluation.problem
    names = list(problem.variable_names)
    axes = [np.unique(column) for column in evaluation.designs.T]
    pairs = zip(axes, evaluation.designs.T, strict=True)
    places = tuple(np.searchsorted(axis, column) for axis, column in pairs)

    def spread(values: np.ndarray, hole: object = np.nan) -> np.ndarray:
        whole = np.full((*map(len, axes), *values.shape[1:]), hole, dtype=values.dtype)
        whole[places] = values
        return whole

    data = {
        index.name: (names, spread(evaluation.indices[index.name]), _about(index.unit, index.doc))
        for index in problem.index_table
    }
    limits = _about("", "feasible where every one is <= 0")
    data["constraints"] = ([*names, "constraint"], spread(evaluation.constraints), limits)
    data["feasible"] = (names, spread(evaluation.feasible, hole=False), {})
    data["merit"] = (names, spread(evaluation.merit), _about("", "what a search descends"))
    coords = {
        v.name: ([v.name], axis, _about(v.unit, v.doc))
        for v, axis in zip(problem.variables, axes, strict=True)
    }
    coords["constraint"] = (["constraint"], np.array(problem.constraint_names), {})
    return xarray.Dataset(data, coords, _origin(problem, command))


def _about(unit: str, doc: str) -> dict[str, str]:
    return {"units": unit or "1", "long_name": doc}


def _origin(problem: DesignProblem, command: str) -> dict[str, str]:
    return {
        "problem": problem.name,
        "title": problem.title,
        "hash": problem.hash(),
        "task": json.dumps(asdict(problem.task)),
        "options": json.dumps(asdict(problem.options)),
        "fixed": json.dumps(dict(problem.fixed)),
        "version": version("pkm_gym"),
        "command": command,
    }


def save_atlas(dataset: xarray.Dataset, path: Path) -> None:
    """Write an atlas to a NetCDF file, whole or not at all."""
    packed = {str(name): {"zlib": True} for name in dataset.data_vars}
    with whole_file(path) as part:
        dataset.to_netcdf(part, engine="netcdf4", encoding=packed)


def log_best(study: Study, evaluation: Evaluation) -> int:
    """Add the best feasible designs of an evaluation to an empty study; return how many."""
    problem = evaluation.problem
    space: dict[str, BaseDistribution] = {
        v.name: FloatDistribution(v.low, v.high) for v in problem.variables
    }
    best = [i for i in ranking(evaluation)[:LOGGED] if evaluation.feasible[i]]
    values = trial_values(evaluation)
    study.add_trials(
        create_trial(
            values=values[i].tolist(),
            params=dict(zip(problem.variable_names, evaluation.designs[i].tolist(), strict=True)),
            distributions=space,
            user_attrs=trial_attributes(evaluation, i),
            constraints=constraints_of(evaluation, i),
        )
        for i in best
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
) -> Evaluation:
    """Evaluate a grid, write the atlas and log its best feasible designs in a study.

    Args:
        problem: what is evaluated, with its task.
        step: of a grid over the bounds, in the variables' SI units; without one it is the paper's
            grid, or where the paper has none, ours with the step 0.01.
        storage: a journal file or a database URL; the problem's journal under runs/ by default.
        name: of the study; the problem's name, "grid" and the step by default.
        output: the atlas; runs/NAME/grid.nc by default.
        command: kept with the atlas and the study.

    Raises:
        ValueError: in one sentence, for no such grid or a study that stands for something else.
    """
    evaluation = evaluate_grid(problem, step)
    where = storage or default_storage(problem.name)
    with quiet():
        study = open_study(
            problem, open_storage(where), name or _study_name(problem, step), command=command
        )
        save_atlas(atlas(evaluation, command), output or run_folder(problem.name) / "grid.nc")
        if count_finished(study) or log_best(study, evaluation) == 0:
            return evaluation
        best = problem.evaluate(evaluation.designs[evaluation.best()][None])
        pictures = Pictures(problem, study, artifact_folder(where))
        pictures.promise(study)
        write_note(study, best, _best_of(problem, step), pictures.draw(study, best.designs[0]))
    return evaluation


def _study_name(problem: DesignProblem, step: float | None) -> str:
    return f"{problem.name}-grid" if step is None else f"{problem.name}-grid-{step:g}"


def _best_of(problem: DesignProblem, step: float | None) -> str:
    return f"best of {grid_name(problem, step)}"


def command(
    name: Name,
    step: Annotated[
        float | None,
        typer.Option(
            metavar="S",
            help="Evaluate our grid, this step in SI apart in every variable over its bounds, in "
            "place of the paper's; 0.01 where the paper has none.",
            show_default=False,
        ),
    ] = None,
    storage: StorageOption = None,
    study_name: Annotated[
        str | None,
        typer.Option(
            "--name",
            metavar="STUDY",
            help="Of the study; NAME-grid, with a step NAME-grid-S, if not said.",
            show_default=False,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="The atlas; runs/NAME/grid.nc if not said.",
            show_default=False,
        ),
    ] = None,
    set_: SetOption = None,
    fix: FixOption = None,
    range_: RangeOption = None,
    objective: ObjectiveOption = None,
) -> None:
    """Evaluate the paper's grid in one call, write all of it to a file and log its best designs.

    Where the paper has no grid, or with --step, it is one of ours. The file is NetCDF:
    xarray.open_dataset reads it.
    """
    problem = problem_from(name, set_, fix, range_, objective)
    evaluation = grid(
        problem, step=step, storage=storage, name=study_name, output=output, command=own_command()
    )
    screen = console()
    feasible = int(evaluation.feasible.sum())
    screen.print(grid_line(evaluation, step))
    best = problem.evaluate(evaluation.designs[evaluation.best()][None])
    screen.print(rich_table(problem, rows_beside_paper(best, _best_of(problem, step))))
    if not feasible:
        screen.print("no design of the grid is feasible, so none is logged", style=BAD)
    else:
        where = redacted(storage or default_storage(name))
        logged = f"{study_name or _study_name(problem, step)} in {where}"
        screen.print(f"study: {logged}, the best {min(feasible, LOGGED)} designs", soft_wrap=True)
    screen.print(f"atlas: {output or run_folder(name) / 'grid.nc'}", soft_wrap=True)


def grid_line(evaluation: Evaluation, step: float | None = None) -> str:
    """Return how many designs a grid has, whose it is and how many are feasible."""
    whose, feasible = grid_name(evaluation.problem, step), int(evaluation.feasible.sum())
    if whose == "our grid":
        whose += f" (a step of {STEP if step is None else step:g} over the bounds)"
    return f"{len(evaluation):,} designs of {whose}, {feasible:,} feasible"
