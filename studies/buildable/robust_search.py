"""What ``search --robust`` adds: a problem of its machines, and how its answer is shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from rich.console import Console

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.studies.buildable.dimensions import Dimensions
from pkm_gym.studies.buildable.lattice import by_dimension
from pkm_gym.studies.buildable.robust import RobustProblem, robust
from pkm_gym.studies.cli.runs import redacted
from pkm_gym.studies.cli.terminal import BAD, FAINT, table
from pkm_gym.studies.report.records import asked, design_units, units_asked
from pkm_gym.studies.search.polish import told_optimum
from pkm_gym.studies.search.samplers import HIGHER
from pkm_gym.studies.search.search import SearchResult


def robust_from(
    problem: DesignProblem, share: float | None, sigma: Sequence[str], sampler: str
) -> DesignProblem:
    """Return the problem that ``--robust`` and ``--sigma`` make of one, itself without them.

    Raises:
        ValueError: in one sentence, where one is said without the other, or what isn't allowed.
    """
    if share is None:
        if sigma:
            raise ValueError("--sigma needs --robust: the share of machines that must hold limits")
        return problem
    if sampler in HIGHER:
        raise ValueError(f"the sampler {sampler} knows nothing of errors: choose another one")
    units = Dimensions(problem, problem.printed_design()).units
    return robust(problem, by_dimension(units, sigma, "--sigma"), share)


@dataclass(frozen=True)
class Machines:
    """A design and what becomes of its machines.

    Attributes:
        name: what the design is.
        value: of the objective without errors.
        quantile: of the objective, what so many of the machines that hold every limit reach.
        share: of the machines that hold every limit.
        feasible: whether so many do.
        design: variable -> value.
    """

    name: str
    value: float
    quantile: float
    share: float
    feasible: bool
    design: Mapping[str, float]


def robust_rows(screen: Console, result: SearchResult, nominal: Evaluation) -> list[Machines]:
    """Return what a robust search found, below the optimum without errors."""
    own, plain = _own(result), nominal.problem
    optimum = told_optimum(screen, plain)
    known = [] if optimum is None else [(optimum.name, plain.design(optimum.design))]
    named = [*known, (f"best, trial {result.trial}", nominal.designs[0])]
    designs = np.array([design for _, design in named])
    told, alone, yields = own.evaluate(designs), plain.evaluate(designs), own.yields(designs)
    return [
        Machines(
            name, float(alone.objectives[k, 0]), float(told.objectives[k, 0]), float(yields[k]),
            bool(told.feasible[k]), plain.named(design),
        )
        for k, (name, design) in enumerate(named)
    ]  # fmt: skip


def robust_told(
    result: SearchResult, nominal: Evaluation, rows: Sequence[Machines]
) -> dict[str, Any]:
    """Return what is handed to programs."""
    own, unit = _own(result), nominal.problem.objectives[0].unit
    return {
        **asked(nominal.problem),
        "errors": asdict(own.errors) if own.errors else None,
        "units": {
            **units_asked(nominal.problem),
            **design_units(nominal.problem),
            "value": unit,
            "quantile": unit,
        },
        "rows": [asdict(row) for row in rows],
    }


def show_robust(screen: Console, result: SearchResult, machines: Sequence[Machines]) -> None:
    """Print what a robust search found, below the optimum without errors."""
    own = _own(result)
    assert own.errors is not None
    first, share = own.objectives[0], f"{100.0 * own.errors.share:g} %"
    heads = ["without errors", f"of {share}", "yield"]
    rows = table(first.name, *heads, "feasible", numbers=heads)
    for one in machines:
        values = f"{one.value:.6g}", f"{one.quantile:.6g}", f"{100.0 * one.share:.1f} %"
        rows.add_row(one.name, *values, "yes" if one.feasible else "no")
    screen.print(rows)
    side = "at most" if first.sign > 0.0 else "at least"
    screen.print(
        f"of {share}: {first.name} is {side} that in so many of the machines that hold every "
        f"limit; feasible: so many hold them; {own.errors.words}",
        style=FAINT,
    )
    if not result.best.feasible[0]:
        screen.print("no design was found of which so many machines are feasible", style=BAD)
    if result.note:
        screen.print(result.note, style=FAINT)
    name, where = result.study.study_name, redacted(result.storage)
    screen.print(f"study: {name} in {where}, {result.finished} trials", soft_wrap=True)


def _own(result: SearchResult) -> RobustProblem:
    problem = result.best.problem
    assert isinstance(problem, RobustProblem)
    return problem
