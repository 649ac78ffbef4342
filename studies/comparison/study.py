"""Grid, search, polish and compare in one go, and what came out of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.text import Text

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.rows import Dimension
from pkm_gym.core.units import show
from pkm_gym.mechanisms import called
from pkm_gym.studies.cli.design_file import write_design
from pkm_gym.studies.cli.runs import own_command
from pkm_gym.studies.cli.tasks import task_folder
from pkm_gym.studies.cli.terminal import HEAD
from pkm_gym.studies.cli.words import evaluate_command
from pkm_gym.studies.comparison.compare import (
    EVALUATIONS,
    SEEDS,
    Comparison,
    compare,
    comparison_bar,
)
from pkm_gym.studies.comparison.compare import save as save_comparison
from pkm_gym.studies.grid.designs import grid_name
from pkm_gym.studies.grid.grid import grid, grid_bar, grid_line
from pkm_gym.studies.report.answer import edge_note
from pkm_gym.studies.report.rows import (
    asks_the_papers_task,
    judged_value,
    printed_value,
    rich_table,
    row_of,
)
from pkm_gym.studies.search.polish import judged, polish, told_optimum, verified_optimum
from pkm_gym.studies.search.search import TRIALS, search, search_bar
from pkm_gym.studies.storage.storages import default_storage

PICTURE, DESIGN = "design.png", "study.toml"


class Done(NamedTuple):
    """What a study found.

    Attributes:
        best: the evaluation of the best design, one design.
        comparison: of the ways to one.
    """

    best: Evaluation
    comparison: Comparison


def study(
    problem: DesignProblem,
    screen: Console,
    bars: Console | None = None,
    *,
    trials: int = TRIALS,
    seed: int = 0,
    name: str | None = None,
) -> Done:
    """Evaluate a grid, search, polish, compare; write everything under runs/.

    Args:
        problem: what is studied, with its task; one objective.
        screen: where each step reports.
        bars: where progress is shown; the screen if not said.
        trials: of the search.
        seed: of the search.
        name: what the names of its two studies begin with; the problem's by default.

    Raises:
        ValueError: in one sentence, for what one of the steps refuses.
    """
    if len(problem.objectives) > 1:
        raise ValueError("study compares designs by one objective: give a single --objective")
    name, command, bars = name or problem.name, own_command(), bars or screen
    screen.print(_step(1, grid_name(problem)))
    with grid_bar(bars, problem) as progress:
        evaluated = grid(problem, name=f"{name}-grid", command=command, progress=progress)
    starts = [problem.printed_design(), evaluated.designs[evaluated.best()]]
    screen.print(grid_line(evaluated))
    screen.print(_step(2, "search with TPE"))
    with search_bar(bars, problem, trials) as report:
        result = search(
            problem,
            trials=trials,
            seed=seed,
            name=f"{name}-tpe",
            command=command,
            report=report,
        )
    if result.stopped:
        raise KeyboardInterrupt
    starts.append(result.best.designs[0])
    screen.print(f"{result.finished} trials in the study {result.study.study_name}")
    screen.print(_step(3, "polish the best design"))
    polished = polish(problem, np.array(starts))
    optimum = told_optimum(bars, problem)
    screen.print(judged(row_of("polished", polished, 0, optimum), optimum))
    screen.print(_step(4, f"compare {SEEDS} runs of {EVALUATIONS} evaluations of each sampler"))
    with comparison_bar(bars, SEEDS, full=False) as progress:
        comparison = compare(problem, progress=progress)
    save_comparison(comparison, task_folder(problem), command)
    screen.print(rich_table(problem, comparison.rows))
    if comparison.verdict:
        screen.print(comparison.verdict)
    _draw(polished)
    write_design(task_folder(problem) / DESIGN, polished, command)
    return Done(polished, comparison)


def _step(number: int, what: str) -> Text:
    return Text(f"\n{number}/4 {what}", style=HEAD)


def _draw(best: Evaluation) -> None:
    from pkm_gym.plots import design_figure, save

    save(design_figure(best.problem, best.designs[0]), task_folder(best.problem) / PICTURE)


def summary(best: Evaluation) -> list[str]:
    """Say what was found, how it compares, where the files are and how to look at them."""
    problem = best.problem
    folder = task_folder(problem)
    first = problem.objectives[0]
    value = float(best.objectives[0, 0])
    units = {v.name: v.unit for v in problem.all_variables}
    named = {name: Dimension(x, units[name]) for name, x in problem.named(best.designs[0]).items()}
    at, lengths = _listed(named), _listed(problem.derived(best.designs[0]))
    lines = [f"found: {first.name} = {show(value, first.unit)} at {at}"]
    lines[0] += f" ({lengths})" if lengths else ""
    optimum = verified_optimum(problem)
    lines.append(f"checked: {judged(row_of('found', best, 0, optimum), optimum)}")
    lines += _beside_paper(best)
    lines += filter(None, [edge_note(problem, best.designs[0])])
    files = ", ".join(("grid.nc", "compare.md", "compare.json", PICTURE, DESIGN))
    lines.append(f"files: {files} in {folder}; studies in {default_storage(problem.name)}")
    lines.append(f"all digits: {evaluate_command(problem, best.designs[0])}")
    lines.append(f"look at it: pkm-gym dashboard {called(problem)}")
    return lines


def _listed(values: Mapping[str, Dimension]) -> str:
    return ", ".join(f"{name} = {show(*dimension)}" for name, dimension in values.items())


def _beside_paper(best: Evaluation) -> list[str]:
    problem = best.problem
    printed, judged_one = printed_value(problem), judged_value(problem)
    paper = problem.evaluate(problem.printed_design()[None])
    unjudged = printed is not None and judged_one is None
    if unjudged or not (asks_the_papers_task(problem) and best.feasible[0] and paper.feasible[0]):
        return []
    theirs, ours = float(paper.objectives[0, 0]), float(best.objectives[0, 0])
    line = (
        f"paper: its design has {theirs:.4g} with our model, so ours is "
        f"{100.0 * abs(ours / theirs - 1.0):.2f} % better; "
    )
    if judged_one is None:
        return [f"{line}it prints no {problem.objectives[0].name}"]
    return [f"{line}the printed {judged_one.printed:g} is {judged_one.verdict}"]
