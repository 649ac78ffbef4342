"""``pkm-gym tolerance``: what errors of the dimensions do to a design."""

from __future__ import annotations

import shlex
from typing import Annotated

import typer
from rich.console import Console
from rich.text import Text

from pkm_gym.core.units import converted
from pkm_gym.mechanisms import called
from pkm_gym.studies.buildable.content import of_tolerances
from pkm_gym.studies.buildable.dimensions import Dimensions
from pkm_gym.studies.buildable.lattice import by_dimension
from pkm_gym.studies.buildable.start import start_from
from pkm_gym.studies.buildable.tolerance import GOAL, SAMPLES, Tolerances, tolerance
from pkm_gym.studies.cli.options import (
    CsvOption,
    DesignFileOption,
    DesignOption,
    JsonOption,
    Name,
    ObjectiveOption,
    PictureOption,
    SeedOption,
    SigmaOption,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.tasks import task_folder
from pkm_gym.studies.cli.terminal import FAINT, counter, section, table
from pkm_gym.studies.cli.words import with_products, words_of
from pkm_gym.studies.report.answer import hand_over

TOLD = (0.05, 0.5, 0.95)


def command(
    name: Name,
    sigma: SigmaOption = None,
    set_: DesignOption = None,
    design: DesignFileOption = None,
    objective: ObjectiveOption = None,
    samples: Annotated[
        int, typer.Option(metavar="N", help="Sobol points, a power of 2; twice as many machines.")
    ] = SAMPLES,
    goal: Annotated[
        float, typer.Option(metavar="SHARE", help="Of the machines, that margins are told for.")
    ] = GOAL,
    seed: SeedOption = 0,
    picture: PictureOption = None,
    as_json: JsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Build machines of a design with errors: distributions, yield, and which error matters.

    Errors are normal and independent, one for each dimension. Without a design it is the optimum of
    the task, recorded or solved now.

    Example: pkm-gym tolerance diamond --sigma 0.1mm
    """
    out = Output(as_json, csv)
    start = start_from(name, set_, design, objective)
    units = Dimensions(start.problem, start.design).units
    sizes = by_dimension(units, sigma or (), "--sigma")
    progress = counter(out.bars, "designs")
    line = progress.add_task("built with errors", total=samples * (len(sizes) + 2))
    with progress:
        found = tolerance(
            start.problem, start.design, sizes, samples=samples, goal=goal, seed=seed,
            report=lambda n: progress.update(line, completed=n),
        )  # fmt: skip
    if picture is None and not as_json:
        picture = task_folder(start.problem) / "tolerance.png"
    if picture is not None:
        from pkm_gym.plots import save
        from pkm_gym.studies.buildable.pictures import tolerance_figure

        save(tolerance_figure(found), picture)
    screen, path = out.screen, task_folder(start.problem) / "tolerance.toml"
    screen.print(f"{start.problem.name}: {found.machines:,} machines of {start.words}")
    for note in start.notes:
        screen.print(note, style=FAINT)
    show_tolerances(screen, found)
    hand_over(screen, found.nominal, path)
    screen.print(f"picture: {picture}", soft_wrap=True)
    out.give(of_tolerances(found, path))


def show_tolerances(screen: Console, found: Tolerances) -> None:
    """Print the yield, the objective's distribution, and where both come from."""
    first = found.nominal.problem.objectives[0]
    own = found.objective
    if not found.nominal.feasible[0]:
        screen.print("without errors it is not feasible:")
        screen.print(found.nominal.explain(0))
    screen.print(Text(f"yield {100.0 * found.share:.1f} %: so many hold every limit"))
    heads = ["nominal", "mean", "deviation", *(f"{100 * q:g} %" for q in TOLD)]
    rows = table(f"{first.name} of all machines", *heads, numbers=heads)
    numbers = [own.nominal, own.mean, own.std, *(own.quantiles.get(q, float("nan")) for q in TOLD)]
    unit = converted(0.0, first.unit)[1]
    shown = [f"{converted(x, first.unit)[0]:.5g}" for x in numbers]
    rows.add_row(unit and f"in {unit}", *shown)
    screen.print(rows)
    screen.print(section(f"What makes {first.name} vary"))
    heads = ["first order", "total"]
    rows = table("dimension", "deviation", *heads, numbers=["deviation", *heads])
    for name, size in found.sigma.items():
        number, unit = converted(size, found.units[name])
        shares = [_share(of.get(name)) for of in (own.first, own.total)]
        rows.add_row(name, f"{number:.4g} {unit}".rstrip(), *shares)
    screen.print(rows)
    if found.broken:
        _show_broken(screen, found)


def _show_broken(screen: Console, found: Tolerances) -> None:
    goal = f"for {100 * found.goal:g} %"
    heads = ["broken by", "margin", goal]
    screen.print(section("Limits that machines break"))
    rows = table("limit", *heads, "mostly by the error of", numbers=heads)
    for name, share in sorted(found.broken.items(), key=lambda item: -item[1]):
        own = found.constraints[name]
        cause = max(own.total, key=lambda k: own.total[k]) if own.total else ""
        rows.add_row(name, _share(share), _margin(own.nominal), f"{found.margins[name]:.2g}", cause)
    screen.print(rows)
    problem = found.nominal.problem
    hidden = problem.declared.reporting
    sizes = [f"{k}={_typed(x, found.units[k])}" for k, x in found.sigma.items()]
    said = with_products(problem, words_of(problem))
    settings = [f"{k}={x}" for k, x in said.items() if k not in hidden]
    words = ["pkm-gym", "search", called(problem), "--objective", problem.objectives[0].name]
    words += [*(["--set", *settings] if settings else []), "--robust", f"{found.goal:g}"]
    screen.print(
        Text(
            f"margin: of the nominal design; {goal}: what it must be for so many machines to hold "
            "the limit. A design that keeps such margins:",
            style=FAINT,
        )
    )
    screen.print(shlex.join([*words, "--sigma", *sizes]), style=FAINT, soft_wrap=True)


def _margin(constraint: float) -> str:
    return "0" if abs(constraint) < 1e-6 else f"{-constraint:.2g}"


def _typed(value: float, unit: str) -> str:
    number, name = converted(value, unit)
    return f"{number:.6g}{name}"


def _share(share: float | None) -> str:
    return "" if share is None else f"{100.0 * share:.1f} %"
