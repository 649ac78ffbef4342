"""How a verb hands an answer over: as a file, and as a command that gives it again."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.core.units import show
from pkm_gym.studies.cli.design_file import write_design
from pkm_gym.studies.cli.runs import own_command
from pkm_gym.studies.cli.terminal import FAINT
from pkm_gym.studies.cli.words import evaluate_command

EDGE = 1e-6  # a share of the range


def hand_over(screen: Console, best: Evaluation, path: Path) -> None:
    """Write the first design of an evaluation to a file; print how to have it again."""
    problem, design = best.problem, best.designs[0]
    if best.feasible[0] and (note := edge_note(problem, design)):
        screen.print(note, soft_wrap=True)
    screen.print(evaluate_command(problem, design), style=FAINT, soft_wrap=True)
    screen.print(f"design: {write_design(path, best, own_command())}", soft_wrap=True)


def handed_over(best: Evaluation, path: Path) -> dict[str, str]:
    """Return how to have the first design of an evaluation again, as programs read it."""
    return {"design_file": str(path), "command": evaluate_command(best.problem, best.designs[0])}


def edge_note(problem: DesignProblem, design: FloatArray) -> str:
    """Return a sentence on the variables of a design (d,) that are on an edge, "" if none is."""
    notes = [
        f"{v.name} at {show(v.low if x - v.low < v.high - x else v.high, v.unit)}"
        for v, x in zip(problem.variables, design.tolist(), strict=True)
        if min(x - v.low, v.high - x) <= EDGE * (v.high - v.low)
    ]
    return f"on the edge of the search box: {', '.join(notes)}; --range widens it" if notes else ""
