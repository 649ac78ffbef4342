"""``pkm-gym evaluate``: a design of one's own in numbers, words and a picture."""

from __future__ import annotations

import json

from pkm_gym.mechanisms import declaration
from pkm_gym.studies.cli.arguments import design_from, problem_from
from pkm_gym.studies.cli.options import (
    DesignOption,
    JsonOption,
    Name,
    ObjectiveOption,
    PictureOption,
)
from pkm_gym.studies.cli.terminal import console
from pkm_gym.studies.report.design import Report, content, draw, show_report
from pkm_gym.studies.storage.storages import run_folder


def command(
    name: Name,
    set_: DesignOption = None,
    objective: ObjectiveOption = None,
    picture: PictureOption = None,
    as_json: JsonOption = False,
) -> None:
    """Evaluate a design of your own; without one, the one that the paper prints.

    Example: pkm-gym evaluate diamond --set e=150mm l1=250mm l2=640mm H=493mm task.payload=1kg
    """
    report = _evaluate(name, set_, objective)
    if picture is None and not as_json:
        picture = run_folder(report.problem.name) / "evaluate.png"
    if picture is not None:
        draw(report, picture)
    if as_json:
        print(json.dumps(content(report), indent=2))
    else:
        show_report(console(), report)
        print(f"\npicture: {picture}")


def _evaluate(name: str, set_: list[str] | None, objective: list[str] | None) -> Report:
    problem = problem_from(
        name, set_, objective=objective, takes_design=True, **declaration(name).reporting
    )
    given = design_from(problem, set_)
    return Report(problem, given, problem.evaluate(given.design[None], given.task))
