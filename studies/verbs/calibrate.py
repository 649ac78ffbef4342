"""``pkm-gym calibrate``: scale, penalty weight and worst value, measured on solved tasks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import tomli_w
import typer
from rich.progress import Progress, TaskID

from pkm_gym.core.calibration import FILE
from pkm_gym.core.files import whole_file
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reading import read_toml
from pkm_gym.mechanisms import family_problem, problem_type
from pkm_gym.studies.cli.bounds import check_memory, solved_task
from pkm_gym.studies.cli.options import (
    CsvOption,
    Name,
    PlainJsonOption,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.terminal import FAINT, counter, table
from pkm_gym.studies.search.calibrating import Calibration, calibrate


def command(
    name: Name,
    number: Annotated[
        int,
        typer.Option("-n", "--number", metavar="N", min=1, help="Tasks solved for each objective."),
    ] = 256,
    seed: Annotated[
        int, typer.Option(metavar="S", min=0, help="Of the tasks and the searches.")
    ] = 0,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help=f"Where they are kept; {FILE} beside the problem's module if not said.",
            show_default=False,
        ),
    ] = None,
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Measure what merit must know of a problem, and keep it where the problem looks for it.

    Tasks of the Family are solved for each objective. Its scale goes with the task's fields, so
    that merit is 1 at the default task's optimum; the weight of the penalty exceeds the multipliers
    of the limits; no feasible design was as bad as its worst. What a Declaration says itself goes
    before what is measured.

    Example: pkm-gym calibrate my_package.problem:MyProblem -n 64
    """
    kind = problem_type(name)
    check_memory("-n", number, solved_task(family_problem(name)))
    out = Output(as_json, csv)
    screen = out.screen
    calibrations = []
    with counter(out.bars, "tasks") as bar:
        for objective in kind.declared.objectives:
            problem = family_problem(name, objective=objective.name)
            line = bar.add_task(objective.name, total=number)
            calibrations.append(
                calibrate(
                    problem,
                    number,
                    seed=seed,
                    progress=partial(_advance, bar, line),
                )
            )
    rows = table(
        "objective", "scale", "goes with", "within", "worst", "multiplier",
        numbers=["scale", "worst", "multiplier"],
    )  # fmt: skip
    for item in calibrations:
        powers = " ".join(
            [f"{field}^{power:g}" for field, power in item.powers.items()]
            + [f"exp({rate:g} {field})" for field, rate in item.rates.items()]
        )
        low, high = item.extremes
        within = f"{100.0 * item.within:.0f} % (merit {low:.3g} to {high:.3g})"
        rows.add_row(
            item.objective, f"{item.scale:.6g}", powers, within, f"{item.worst:g}",
            f"{item.multiplier:.3g}",
        )  # fmt: skip
    screen.print(rows)
    solvable = ", ".join(f"{item.solvable} of {item.tasks}" for item in calibrations)
    weight = max(item.penalty_weight for item in calibrations)
    screen.print(f"solvable: {solvable} tasks; weight of the penalty: {weight:g}")
    if output is None and not kind.declared.measured:
        said = f"{name} declares these itself (weight {kind.declared.penalty_weight:g})"
        screen.print(f"{said}: nothing is written without -o", style=FAINT, soft_wrap=True)
        out.give(_content(name, weight, calibrations, None))
        return
    path = output or _beside(kind)
    keep(
        path,
        kind.declared.name,
        calibrations,
        f"pkm-gym calibrate {name} -n {number} --seed {seed}",
    )
    screen.print(f"calibration: {path}", soft_wrap=True)
    out.give(_content(name, weight, calibrations, path))


def _content(
    name: str, weight: float, calibrations: Sequence[Calibration], path: Path | None
) -> dict[str, Any]:
    rows = [asdict(item) for item in calibrations]
    return {"mechanism": name, "penalty_weight": weight, "calibration": path, "rows": rows}


def _advance(bar: Progress, line: TaskID, done: int) -> None:
    bar.update(line, completed=done)


def kept(path: Path) -> dict[str, Any]:
    """Return what a file keeps so far, nothing where there is none.

    Raises:
        ValueError: for a file that is there and is no TOML.
    """
    try:
        return read_toml(path, "calibration") if path.exists() else {}
    except ValueError as error:
        raise ValueError(f"{error}; move it away first") from None


def keep(path: Path, name: str, calibrations: list[Calibration], command: str) -> None:
    """Write what was measured of a problem into a file; other problems' parts of it stay.

    Raises:
        ValueError: for a file that is there and is no TOML.
    """
    content = kept(path)
    objectives: dict[str, Any] = {
        item.objective: {
            "worst": item.worst,
            "scale": item.scale,
            "powers": dict(item.powers),
            "rates": dict(item.rates),
        }
        for item in calibrations
    }
    content[name] = {
        "command": command,
        "penalty_weight": max(item.penalty_weight for item in calibrations),
        "objectives": objectives,
    }
    with whole_file(path) as part:
        part.write_text(tomli_w.dumps(content), encoding="utf-8")


def _beside(kind: type[DesignProblem]) -> Path:
    module = import_module(kind.declared.package or kind.__module__)
    return Path(str(module.__file__)).parent / FILE
