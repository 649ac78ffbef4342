"""What ``search --robust`` adds: a problem of its machines, and how its answer is shown."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.studies.buildable.dimensions import Dimensions
from pkm_gym.studies.buildable.lattice import by_dimension
from pkm_gym.studies.buildable.robust import RobustProblem, robust
from pkm_gym.studies.cli.runs import redacted
from pkm_gym.studies.cli.terminal import BAD, FAINT, table
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


def show_robust(screen: Console, result: SearchResult, nominal: Evaluation) -> None:
    """Print what a robust search found, beside the optimum without errors."""
    own = result.best.problem
    assert isinstance(own, RobustProblem)
    assert own.errors is not None
    optimum = told_optimum(screen, nominal.problem)
    first, share = own.objectives[0], f"{100.0 * own.errors.share:g} %"
    heads = ["without errors", f"of {share}", "yield"]
    rows = table(first.name, *heads, "feasible", numbers=heads)
    known = [] if optimum is None else [(optimum.name, nominal.problem.design(optimum.design))]
    for what, design in [*known, (f"best, trial {result.trial}", nominal.designs[0])]:
        told = own.evaluate(design[None])
        plain = nominal.problem.evaluate(design[None])
        values = (f"{float(e.objectives[0, 0]):.6g}" for e in (plain, told))
        held = f"{100.0 * own.yields(design[None])[0]:.1f} %"
        rows.add_row(what, *values, held, "yes" if told.feasible[0] else "no")
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
