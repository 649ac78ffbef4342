"""``pkm-gym pareto``: the front of several objectives that searches have found."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.scalar import Scalarisation
from pkm_gym.core.units import parse
from pkm_gym.mechanisms import problem_type
from pkm_gym.studies.cli.arguments import problem_from
from pkm_gym.studies.cli.design_file import write_design
from pkm_gym.studies.cli.options import (
    CsvOption,
    DesignFileOption,
    FixOption,
    FreeOption,
    JsonOption,
    Name,
    ObjectiveOption,
    PictureOption,
    RangeOption,
    SetOption,
    StorageOption,
    study_name_option,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.runs import own_command
from pkm_gym.studies.cli.settings import assignments
from pkm_gym.studies.cli.tasks import task_folder
from pkm_gym.studies.front.front import Front, front, objectives_searched
from pkm_gym.studies.front.report import ROWS, Marked, content, marked, show_front
from pkm_gym.studies.front.weighing import (
    principal_components,
    tolerance_weighted,
    weighted_sum,
)
from pkm_gym.studies.storage.storages import default_storage, quiet


def command(
    name: Name,
    set_: SetOption = None,
    design: DesignFileOption = None,
    free: FreeOption = None,
    fix: FixOption = None,
    range_: RangeOption = None,
    objective: ObjectiveOption = None,
    storage: StorageOption = None,
    study_name: Annotated[
        str | None,
        study_name_option("One study; all of this task and these objectives if not said."),
    ] = None,
    reference: Annotated[
        list[str] | None,
        typer.Option(
            metavar="OBJECTIVE=VALUE ...",
            help="The point that the hypervolume is measured from, kept with the studies; a tenth "
            "beyond the worst of the objectives' own optima if none is kept.",
        ),
    ] = None,
    weights: Annotated[
        list[str] | None,
        typer.Option(
            metavar="OBJECTIVE=WEIGHT ...",
            help="Show the design that a weighted sum prefers, over what objectives vary by.",
        ),
    ] = None,
    tolerances: Annotated[
        list[str] | None,
        typer.Option(
            metavar="OBJECTIVE=VALUE ...",
            help="Show the design nearest to the best of each objective, counted in these.",
        ),
    ] = None,
    pca: Annotated[
        bool,
        typer.Option(
            "--pca", help="Show the design that principal components of what is feasible prefer."
        ),
    ] = False,
    rows: Annotated[
        int, typer.Option(metavar="N", min=1, help="How many of the front are printed.")
    ] = ROWS,
    picture: PictureOption = None,
    as_json: JsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Show the front of several objectives: distinct designs, hypervolume, picture.

    Beside it stand the paper's design, the optimum of each objective alone and, if asked for, what
    ways to weigh the objectives prefer.

    Example: pkm-gym pareto diamond --objective tau_G --objective condition --weights tau_G=2
    condition=1
    """
    out, where = Output(as_json, csv), storage or default_storage(problem_type(name).name)
    with quiet():
        asked = objective or ([] if design else objectives_searched(problem_type(name), where))
        problem = problem_from(name, set_, fix, range_, asked, free, file=design)
        with out.bars.status(f"solving {problem.name} for each objective alone"):
            point = _values(problem, "--reference", reference)
            found = front(problem, where, name=study_name, reference=point)
    ways = _ways(found, weights, tolerances, pca)
    with out.bars.status(f"searching {problem.name} for what each way prefers"):
        marks = marked(found, ways)
    show_front(out.screen, found, marks, rows)
    if csv is None and not as_json:
        out = Output(table=task_folder(problem) / "pareto.csv")
    out.give(content(found, marks))
    _draw(out, found, marks, picture)
    _write(out, found, marks)
    for way in ways:
        for warning in getattr(getattr(way, "of", None), "warnings", ()):
            out.screen.print(f"{way.name}: {warning}", soft_wrap=True)


def _draw(out: Output, found: Front, marks: list[Marked], picture: Path | None) -> None:
    """Draw the front; for programs only where a picture is named."""
    if picture is None and out.as_json:
        return
    from pkm_gym.plots import save
    from pkm_gym.studies.front.picture import front_figure

    path = picture or task_folder(found.problem) / "pareto.png"
    save(front_figure(found, marks), path)
    out.screen.print(f"picture: {path}", soft_wrap=True)


def _write(out: Output, found: Front, marks: list[Marked]) -> None:
    """Write what each way prefers to a design file."""
    for mark in (mark for mark in marks if mark.kind == "preferred"):
        path = task_folder(found.problem) / f"pareto-{mark.name}.toml"
        written = write_design(path, mark.evaluation, own_command())
        out.screen.print(f"design, {mark.name}: {written}", soft_wrap=True)


def _ways(
    found: Front, weights: list[str] | None, tolerances: list[str] | None, pca: bool
) -> list[Scalarisation]:
    """Return the ways to weigh that are asked for."""
    ways: list[Scalarisation] = []
    if weights:
        given = assignments("--weights", weights)
        ways.append(weighted_sum(found, {k: parse(x, "", what=k) for k, x in given.items()}))
    if tolerances:
        ways.append(tolerance_weighted(found, _values(found.problem, "--tolerances", tolerances)))
    if pca:
        ways.append(principal_components(found))
    return ways


def _values(problem: DesignProblem, flag: str, texts: list[str] | None) -> dict[str, float] | None:
    """Return values of objectives in SI."""
    if not texts:
        return None
    units = {objective.name: objective.unit for objective in problem.objectives}
    given = assignments(flag, texts)
    return {key: parse(text, units.get(key, ""), what=key) for key, text in given.items()}
