"""``pkm-gym validate``: do the torque indices rank designs as a simulated machine's motors do?"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.text import Text

from pkm_gym.core.problem import DesignProblem
from pkm_gym.mechanisms import declaration
from pkm_gym.studies.cli.arguments import problem_from
from pkm_gym.studies.cli.options import (
    CsvOption,
    DesignFileOption,
    Name,
    SeedOption,
    json_option,
    out_option,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.tasks import task_folder
from pkm_gym.studies.cli.terminal import FAINT, counter, section, table
from pkm_gym.studies.report.records import asked, units_asked
from pkm_gym.studies.twins.validation import INDICES, Validation, scatter, validate


def command(
    name: Name,
    designs: Annotated[int, typer.Option(min=3, help="Random feasible designs.")] = 200,
    seed: SeedOption = 0,
    design: DesignFileOption = None,
    out: Annotated[
        Path | None,
        out_option("The scatter plot (.png, .svg or .pdf); runs/NAME/validate.png if not said."),
    ] = None,
    as_json: Annotated[bool, json_option("Print JSON; a plot only if --out names one.")] = False,
    csv: CsvOption = None,
) -> None:
    """Compare torque indices with the peak motor torque of simulated machines.

    Each design's MuJoCo twin, with uniform rods, runs our pick-and-place cycle once under computed
    torque.

    Example: pkm-gym validate diamond
    """
    sent = Output(as_json, csv)
    problem = _problem(name, design)
    with counter(sent.bars, "designs") as bar:
        line = bar.add_task("simulated", total=designs)
        validation = validate(problem, designs, seed, partial(bar.advance, line))
    path = out or (None if as_json else task_folder(problem) / "validate.png")
    if path is not None:
        from pkm_gym.plots import save

        save(scatter(validation), path, dpi=150)
    _show(sent.screen, validation)
    sent.screen.print(f"\npicture: {path}", soft_wrap=True)
    sent.give(_content(problem, validation))


def _problem(name: str, file: Path | None) -> DesignProblem:
    problem = problem_from(name, file=file, **declaration(name).reporting)
    missing = [index for index in INDICES if index not in problem.index_names]
    if missing:
        raise ValueError(f"{problem.name} has no {' and no '.join(missing)} to validate")
    return problem


def _content(problem: DesignProblem, validation: Validation) -> dict[str, Any]:
    extremes = ("least", "median", "largest")
    return {
        **asked(problem),
        "designs": len(validation.peaks),
        "largest_path_error": validation.errors.max(),
        "units": {"largest_path_error": "m", **units_asked(problem)},
        "rows": [
            {
                "index": name,
                "unit": validation.units[name],
                "rank_correlation": validation.rank(name),
                "measured_over_index": dict(zip(extremes, validation.ratio(name), strict=True)),
            }
            for name in INDICES
        ],
    }


def _show(screen: Console, validation: Validation) -> None:
    heads = ("index", "unit", "rank correlation", "least", "median", "largest")
    shown = table(*heads, numbers=heads[2:])
    for name in INDICES:
        ratios = [f"{ratio:.4g}" for ratio in validation.ratio(name)]
        shown.add_row(name, validation.units[name], f"{validation.rank(name):.4f}", *ratios)
    screen.print(section(f"Peak motor torque of {len(validation.peaks)} twins over their indices"))
    screen.print(shown)
    screen.print(
        Text(f"largest distance from the path: {1e3 * validation.errors.max():.2f} mm", style=FAINT)
    )
