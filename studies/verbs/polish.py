"""``pkm-gym polish``: from a known design to the optimum near it, beside the verified one."""

from __future__ import annotations

from typing import Annotated

import typer

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.studies.cli.arguments import design_from
from pkm_gym.studies.cli.options import (
    CsvOption,
    DesignFileOption,
    DesignOption,
    FixOption,
    FreeOption,
    Name,
    ObjectiveOption,
    PlainJsonOption,
    RangeOption,
    StorageOption,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.tasks import task_folder
from pkm_gym.studies.cli.terminal import BAD
from pkm_gym.studies.report.answer import hand_over, handed_over
from pkm_gym.studies.report.records import told
from pkm_gym.studies.report.rows import paper_rows, rich_table, row_of
from pkm_gym.studies.search.polish import best_known, judged, polish, told_optimum
from pkm_gym.studies.search.starts import warm_designs
from pkm_gym.studies.storage.storages import default_storage, quiet


def command(
    name: Name,
    source: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="paper|grid|STUDY",
            help="Where the start is from; the best study of this problem, or the printed design, "
            "if neither this nor a design is given.",
            show_default=False,
        ),
    ] = None,
    set_: DesignOption = None,
    design: DesignFileOption = None,
    free: FreeOption = None,
    fix: FixOption = None,
    range_: RangeOption = None,
    objective: ObjectiveOption = None,
    storage: StorageOption = None,
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Polish a design: search its neighbourhood for the optimum and compare with the verified one.

    Example: pkm-gym polish diamond --set lam_e=0.6 lam_l=2.5 gap=0.4
    """
    out = Output(as_json, csv)
    given = design_from(name, set_, fix, range_, objective, free, file=design)
    problem = given.problem
    if given.names:
        if source is not None:
            raise ValueError(f"--from {source} and a given design are two starts: leave one out")
        problem, source = problem.with_task(given.task), "the given design"
        start = given.design[None]
    else:
        source, start = _start(problem, source, storage or default_storage(problem.name))
    before = problem.evaluate(start)
    after = polish(problem, start)
    screen = out.screen
    optimum = told_optimum(out.bars, problem)
    rows = [*paper_rows(problem, optimum)]
    rows.append(row_of("start", before, before.best(), optimum))
    polished = row_of("polished", after, 0, optimum)
    rows += [polished, optimum] if optimum else [polished]
    screen.print(f"start: {source}")
    screen.print(rich_table(problem, rows))
    screen.print(f"polished: {judged(polished, optimum)}")
    if not after.feasible[0]:
        screen.print(after.explain(0), style=BAD)
    path = task_folder(problem) / "polish.toml"
    hand_over(screen, after, path)
    sentence = judged(polished, optimum)
    out.give(told(problem, rows, start=source, judged=sentence, **handed_over(after, path)))


def _start(problem: DesignProblem, source: str | None, where: str) -> tuple[str, FloatArray]:
    with quiet():
        if source is None:
            return best_known(problem, where)
        return f"the best of {source}", warm_designs(problem, source, where)
