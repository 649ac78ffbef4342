"""``pkm-gym validate``: do the torque indices rank designs as a simulated machine's motors do?"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.text import Text

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms import declaration, make_problem
from pkm_gym.studies.arguments import Name
from pkm_gym.studies.terminal import FAINT, console, counter, section, table

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

INDICES = ("tau_G", "tau_peak")


@dataclass(frozen=True)
class Validation:
    """Indices of designs beside what the motors of their twins did.

    Attributes:
        predicted: name of an index -> its values (n,).
        units: name of an index -> its unit.
        peaks: array (n,), the largest motor torque, N m.
        errors: array (n,), the largest distance from the path, m.
    """

    predicted: dict[str, FloatArray]
    units: dict[str, str]
    peaks: FloatArray
    errors: FloatArray

    def rank(self, index: str) -> float:
        """Return Spearman's rank correlation of an index with the measured peaks."""
        from scipy.stats import spearmanr

        return float(spearmanr(self.predicted[index], self.peaks).statistic)

    def ratio(self, index: str) -> tuple[float, float, float]:
        """Return least, median and largest ratio of the measured peak to an index."""
        ratios = self.peaks / self.predicted[index]
        return float(ratios.min()), float(np.median(ratios)), float(ratios.max())


def command(
    name: Name,
    designs: Annotated[int, typer.Option(min=3, help="Random feasible designs.")] = 200,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random designs.")] = 0,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE",
            help="The scatter plot (.png, .svg or .pdf); runs/NAME/validate.png if not said.",
            show_default=False,
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON; a plot only if --out names one.")
    ] = False,
) -> None:
    """Compare torque indices with the peak motor torque of simulated machines.

    Each design's MuJoCo twin, with uniform rods, runs the paper's pick-and-place cycle once under
    computed torque.

    Example: pkm-gym validate diamond
    """
    problem = _problem(name)
    screen = Console(stderr=True) if as_json else console()
    with counter(screen, "designs") as bar:
        line = bar.add_task("simulated", total=designs)
        found = validate(problem, designs, seed, partial(bar.advance, line))
    path = out or (None if as_json else Path("runs") / name / "validate.png")
    if path is not None:
        from pkm_gym.plots import save

        path.parent.mkdir(parents=True, exist_ok=True)
        save(scatter(found), path, dpi=150)
    if as_json:
        print(json.dumps(_content(found), indent=2))
    else:
        _show(screen, found)
        print(f"\npicture: {path}")


def validate(
    problem: DesignProblem, n: int, seed: int, progress: Callable[[], None] = lambda: None
) -> Validation:
    """Simulate n random feasible designs; ``progress`` is called after each."""
    from pkm_gym.twin.check import random_designs
    from pkm_gym.twin.drive import computed_torque

    designs = random_designs(problem, n, seed)
    indices = problem.evaluate(designs).indices
    peaks, errors = np.empty(n), np.empty(n)
    for k, design in enumerate(designs):
        drive = computed_torque(problem.mechanism(design))
        peaks[k], errors[k] = drive.peak, drive.errors.max()
        progress()
    units = {index.name: index.unit for index in problem.index_table}
    return Validation(
        {name: indices[name] for name in INDICES}, {i: units[i] for i in INDICES}, peaks, errors
    )


def scatter(found: Validation) -> Figure:
    """Draw the measured peaks over each index."""
    from pkm_gym import plots

    figure = plots.new_figure(8.0, 3.6)
    plots.headline(
        figure,
        "Peak motor torque of the simulated machines, against two indices",
        f"{len(found.peaks)} random feasible designs, the paper's pick-and-place cycle, "
        "computed torque, uniform rods",
    )
    for k, name in enumerate(INDICES):
        axes = plots.panel(
            figure,
            (0.075 + 0.5 * k, 0.135, 0.40, 0.62),
            x=plots.label(name, found.units[name]),
            y="measured peak (N·m)",
            title=f"rank correlation {found.rank(name):.3f}",
        )
        axes.scatter(found.predicted[name], found.peaks, s=9, color=plots.STYLE["rod"], alpha=0.8)
        if found.units[name] == "N m":
            axes.axline((found.peaks.min(),) * 2, slope=1.0, color=plots.STYLE["faint"], lw=0.8)
    return figure


def _problem(name: str) -> DesignProblem:
    problem = make_problem(name, **declaration(name).reporting)
    missing = [index for index in INDICES if index not in problem.index_names]
    if missing:
        raise ValueError(f"{name} has no {' and no '.join(missing)} to validate")
    return problem


def _content(found: Validation) -> dict[str, Any]:
    return {
        "designs": len(found.peaks),
        "largest_path_error": float(found.errors.max()),
        "indices": {
            name: {
                "unit": found.units[name],
                "rank_correlation": found.rank(name),
                "measured_over_index": dict(
                    zip(("least", "median", "largest"), found.ratio(name), strict=True)
                ),
            }
            for name in INDICES
        },
    }


def _show(screen: Console, found: Validation) -> None:
    heads = ("index", "unit", "rank correlation", "least", "median", "largest")
    shown = table(*heads, numbers=heads[2:])
    for name in INDICES:
        ratios = [f"{ratio:.4g}" for ratio in found.ratio(name)]
        shown.add_row(name, found.units[name], f"{found.rank(name):.4f}", *ratios)
    screen.print(section(f"Peak motor torque of {len(found.peaks)} twins over their indices"))
    screen.print(shown)
    screen.print(
        Text(f"largest distance from the path: {1e3 * found.errors.max():.2f} mm", style=FAINT)
    )
