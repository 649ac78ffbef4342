"""``pkm-gym evaluate``: a design of one's own in numbers, words and a picture."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pkm_gym.core.statics import held
from pkm_gym.mechanisms import declaration
from pkm_gym.studies.cli.arguments import design_from, load_from
from pkm_gym.studies.cli.options import (
    CsvOption,
    DesignFileOption,
    DesignOption,
    JsonOption,
    LoadOption,
    Name,
    ObjectiveOption,
    PictureOption,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.tasks import task_folder
from pkm_gym.studies.report.design import Report, content, draw, show_report


def command(
    name: Name,
    set_: DesignOption = None,
    design: DesignFileOption = None,
    objective: ObjectiveOption = None,
    load: LoadOption = None,
    picture: PictureOption = None,
    as_json: JsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Evaluate a design of your own; without one, the one that the paper prints.

    Example: pkm-gym evaluate diamond --set e=150mm l1=250mm l2=640mm H=493mm task.payload=1kg
    """
    out = Output(as_json, csv)
    report = _evaluate(name, set_, objective, design)
    if load:
        machine = report.problem.mechanism(report.given.design, report.given.task)
        report = replace(report, holding=held(machine, load_from(machine, load)))
    if picture is None and not as_json:
        picture = task_folder(report.problem.with_task(report.given.task)) / "evaluate.png"
    if picture is not None:
        draw(report, picture)
    show_report(out.screen, report)
    out.screen.print(f"\npicture: {picture}", soft_wrap=True)
    out.give(content(report))


def _evaluate(
    name: str, set_: list[str] | None, objective: list[str] | None, file: Path | None
) -> Report:
    options = declaration(name).reporting
    given = design_from(name, set_, objective=objective, file=file, **options)
    evaluation = given.problem.evaluate(given.design[None], given.task)
    if given.file and not set_:
        notes = given.notes + given.file.differences(evaluation)
        given = replace(given, notes=notes)
    return Report(given, evaluation)
