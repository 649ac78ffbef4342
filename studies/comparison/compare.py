"""The paper, its grid, a polished design and the samplers, side by side."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.files import whole_file
from pkm_gym.core.names import imported
from pkm_gym.core.problem import DesignProblem
from pkm_gym.mechanisms import called
from pkm_gym.studies import create_study
from pkm_gym.studies.cli.output import plainly
from pkm_gym.studies.cli.tasks import differences
from pkm_gym.studies.cli.terminal import counter
from pkm_gym.studies.cli.words import with_products
from pkm_gym.studies.grid.designs import grid_name
from pkm_gym.studies.grid.grid import evaluate_grid
from pkm_gym.studies.report.records import record
from pkm_gym.studies.report.rows import Row, markdown, paper_rows, row_of, verdict
from pkm_gym.studies.search.polish import polish, verified_optimum
from pkm_gym.studies.search.runner import Runner
from pkm_gym.studies.search.samplers import check_sampler, make_sampler, values_for
from pkm_gym.studies.storage.storages import quiet

SAMPLERS = ("tpe", "cmaes", "qmc", "random")
SLOW = ("gp",)
AGENTS = "pkm_gym.agents.sb3.comparison:algorithm_rows"  # of a higher room
SLOW_EVALUATIONS = 100  # a Gaussian process takes seconds a trial
EVALUATIONS = 300
SEEDS = 5
POLISHED = 10  # how many of the best known designs are polished


@dataclass(frozen=True)
class Comparison:
    """A table of the ways to a design.

    Attributes:
        problem: what was searched.
        rows: one for each way; of a sampler's runs, that of median regret.
        runs: sampler -> one row for each seed.
        verdict: a sentence on the printed value.
    """

    problem: DesignProblem
    rows: list[Row]
    runs: dict[str, list[Row]]
    verdict: str


def compare(
    problem: DesignProblem,
    *,
    evaluations: int = EVALUATIONS,
    seeds: int = SEEDS,
    full: bool = False,
    agents: bool = False,
    progress: Callable[[], None] = lambda: None,
) -> Comparison:
    """Compare the ways to a design of one problem and its task.

    Args:
        problem: with one objective.
        evaluations: how many designs each run of a sampler may evaluate.
        seeds: runs of each sampler.
        full: whether slow samplers run too, with at most 100 evaluations.
        agents: whether agents are trained on the task, too; every design in it counts.
        progress: called after each run.

    Raises:
        ValueError: in one sentence, for several objectives or numbers below 1.
    """
    if len(problem.objectives) > 1:
        raise ValueError("compare ranks designs by one objective: give a single --objective")
    for what, number in (("evaluations", evaluations), ("seeds", seeds)):
        if number < 1:
            raise ValueError(f"{what} is {number}: it must be at least 1")
    optimum = verified_optimum(problem)
    starts = [problem.printed_design()[None]]
    rows = paper_rows(problem, optimum)
    if problem.grid() is None:
        rows += [Row("grid: none printed", None)] if problem.reference else []
    else:
        grid = evaluate_grid(problem)
        name = grid_name(problem).removeprefix("the ")
        rows.append(row_of(name, grid, grid.best(), optimum, evaluations=len(grid)))
        starts.append(grid.designs[grid.ranking()[:POLISHED]])
    place = len(rows)
    runs: dict[str, list[Row]] = {}
    for sampler in SAMPLERS + (SLOW if full else ()):
        number = min(evaluations, SLOW_EVALUATIONS) if sampler in SLOW else evaluations
        runs[sampler] = []
        for seed in range(seeds):
            best = run(problem, sampler, seed=seed, evaluations=number)
            name = f"{sampler}, seed {seed}"
            runs[sampler].append(row_of(name, best, 0, optimum, evaluations=number))
            progress()
    if agents:
        runs |= imported(AGENTS)(problem, optimum, seeds, progress)
    if len(starts) == 1:  # no grid: from what the runs found
        found = [row.design for own in runs.values() for row in own if row.feasible == "yes"]
        starts += [problem.design(design)[None] for design in found]
    rows += [median(name, own) for name, own in runs.items()]
    rows.insert(place, row_of("polished", polish(problem, np.concatenate(starts)), 0, optimum))
    if optimum is not None:
        rows.append(optimum)
    return Comparison(problem, rows, runs, verdict(problem))


def run(problem: DesignProblem, sampler: str, *, seed: int, evaluations: int) -> Evaluation:
    """Search in memory and return the evaluation of the answer, one design."""
    check_sampler(sampler, len(problem.objectives))
    values = values_for(sampler)
    with quiet():
        study = create_study(problem, sampler=make_sampler(sampler, seed=seed))
        runner = Runner(study, problem, trials=evaluations, values=values)
        if runner.run():
            raise KeyboardInterrupt
    assert runner.best is not None
    return runner.best


def median(name: str, runs: Sequence[Row]) -> Row:
    """Return the run of median regret, empty if that one found no feasible design.

    ``feasible`` says how many runs found one. A single run stays what it is.
    """
    if len(runs) == 1:
        return runs[0]
    feasible = sum(row.feasible == "yes" for row in runs)
    order = sorted(runs, key=lambda row: row.regret if row.feasible == "yes" else np.inf)
    middle = order[(len(runs) - 1) // 2]
    share = f"{feasible} of {len(runs)}"
    if middle.feasible != "yes":
        return Row(name, None, evaluations=middle.evaluations, feasible=share, runs=len(runs))
    return replace(middle, name=name, feasible=share, runs=len(runs))


def save(comparison: Comparison, folder: Path, command: str = "") -> tuple[Path, Path]:
    """Write compare.json and compare.md, each whole or not at all; return their paths."""
    problem = comparison.problem
    content: dict[str, Any] = {
        "problem": problem.name,
        "objective": asdict(problem.objectives[0]),
        "hash": problem.hash(),
        "task": asdict(problem.task),
        "options": asdict(problem.options),
        "fixed": dict(problem.fixed),
        "rows": [record(problem, row) for row in comparison.rows],
        "runs": runs_of(comparison),
        "verdict": comparison.verdict,
        "version": version("pkm_gym"),
        "command": command,
    }
    words = with_products(problem, differences(problem))
    asked = ", ".join(f"{key} = {x}" for key, x in words.items())
    text = f"{called(problem)}: {f'{asked} (SI)' if asked else 'as it comes'}\n\n"
    text += markdown(problem, comparison.rows)
    if comparison.verdict:
        text += f"\n\n{comparison.verdict}"
    paths = folder / "compare.json", folder / "compare.md"
    for path, written in zip(paths, (json.dumps(plainly(content), indent=2), text), strict=True):
        with whole_file(path) as part:
            part.write_text(written + "\n", encoding="utf-8")
    return paths


def runs_of(comparison: Comparison) -> dict[str, list[dict[str, Any]]]:
    """Return every run of each sampler as programs read it."""
    return {
        name: [record(comparison.problem, row) for row in rows]
        for name, rows in comparison.runs.items()
    }


@contextmanager
def comparison_bar(
    screen: Console, seeds: int, *, full: bool, agents: bool = False
) -> Iterator[Callable[[], None]]:
    """Give the ``progress`` of a comparison that moves a bar."""
    ways = len(SAMPLERS) + len(SLOW) * full + 2 * agents
    bar = counter(screen, "runs")
    with bar:
        line = bar.add_task("ways", total=seeds * ways)
        yield lambda: bar.advance(line)
