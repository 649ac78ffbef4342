"""``pkm-gym evaluate``: a design of one's own in numbers, words and a picture."""

from __future__ import annotations

import json

from pkm_gym.mechanisms import declaration
from pkm_gym.studies.cli.arguments import design_from
from pkm_gym.studies.cli.options import (
    DesignOption,
    JsonOption,
    Name,
    ObjectiveOption,
    PictureOption,
)
from pkm_gym.studies.cli.runs import run_folder
from pkm_gym.studies.cli.terminal import console
from pkm_gym.studies.report.design import Report, content, draw, show_report


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
    given = design_from(name, set_, objective=objective, **declaration(name).reporting)
    return Report(given, given.problem.evaluate(given.design[None], given.task))
