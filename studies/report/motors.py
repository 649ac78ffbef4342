"""Which motor and gear carry a design's cycle, and why smaller ones don't."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.console import Console
from rich.text import Text

from pkm_gym.core.drives import Drives, cycle_drives
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.motor_choice import Demand, Fit, fits, pick
from pkm_gym.core.motors import DIRECT, Gear, MotorTable
from pkm_gym.core.units import WRITTEN, show
from pkm_gym.studies.cli.arguments import GivenDesign
from pkm_gym.studies.cli.terminal import BAD, FAINT, GOOD, HEAD, Sheet, section, table
from pkm_gym.studies.cli.words import evaluate_command
from pkm_gym.studies.report.records import asked, design_units, units_asked

RPM = WRITTEN["rad/s"]["rpm"]
INERTIA = "kg m^2"


@dataclass(frozen=True)
class Choice:
    """What a design's cycle asks of its drives, and what each motor of a table can do.

    Attributes:
        given: the design.
        evaluation: of it.
        drives: over the cycle.
        tried: the best that each motor can do, from the lightest motor on.
    """

    given: GivenDesign
    evaluation: Evaluation
    drives: Drives
    tried: tuple[Fit, ...]

    @property
    def picked(self) -> Fit | None:
        """The lightest motor that carries the cycle, None if none does."""
        return pick(self.tried)

    @property
    def asked(self) -> dict[str, tuple[float, str]]:
        """What the worst drive does, motor and gear without inertia: name -> number and unit."""
        drives = self.drives
        return {
            "peak torque": (float(np.abs(drives.torques).max()), "N m"),
            "rms torque": (float(drives.rms(drives.torques).max()), "N m"),
            "peak speed": (float(np.abs(drives.rates).max()), "rad/s"),
            "peak power": (float(np.abs(drives.torques * drives.rates).max()), "W"),
        }

    @property
    def command(self) -> str:
        """The command that evaluates the design with the picked motor, "" without."""
        problem, best = self.given.problem, self.picked
        if best is None or not problem.drive_option:
            return ""
        driven = problem.with_task(self.given.task, **{problem.drive_option: best.inertia})
        return evaluate_command(driven, self.given.design)


def choose(given: GivenDesign, motors: MotorTable) -> Choice:
    """Return what each motor of a table can do for a design.

    Raises:
        ValueError: for a mechanism without dynamics, or a design that can't follow its cycle.
    """
    drives = cycle_drives(given.problem, given.design, given.task)
    evaluation = given.problem.evaluate(given.design[None], given.task)
    return Choice(given, evaluation, drives, fits(drives, motors))


def content(choice: Choice) -> dict[str, Any]:
    """Return what is handed to programs: SI, a row a motor, infinite where there is no bound."""
    given, best, problem = choice.given, choice.picked, choice.given.problem
    cycle = problem.cycle(given.task)
    return {
        **asked(problem, given.task),
        "design": problem.named(given.design),
        "feasible": bool(choice.evaluation.feasible[0]),
        "cycle": {name: value for name, (value, _) in cycle.items()},
        "asked": {name: value for name, (value, _) in choice.asked.items()},
        "picked": None if best is None else _entry(best),
        "evaluate": choice.command,
        "units": {
            **units_asked(problem),
            **design_units(problem),
            "cycle": {name: unit for name, (_, unit) in cycle.items()},
            "asked": {name: unit for name, (_, unit) in choice.asked.items()},
            "picked": {"inertia": INERTIA},
            "inertia": INERTIA,
        },
        "rows": [_entry(one) for one in choice.tried],
    }


def show_choice(screen: Console, choice: Choice) -> None:
    """Print what the cycle asks, what each motor can do, and the pick."""
    given = choice.given
    screen.print(Text.assemble((given.problem.name, HEAD), ": motors and gears"))
    for note in given.notes:
        screen.print(note, style=FAINT)
    if not choice.evaluation.feasible[0]:
        screen.print(choice.evaluation.explain(0), style=BAD)
    _show_asked(screen, choice)
    screen.print(section("What each motor can do, with its best gear"))
    screen.print(_table(choice))
    screen.print()
    best = choice.picked
    if best is None:
        screen.print("no motor of the table carries the cycle", style=BAD)
        return
    screen.print(
        f"the smallest: {best.motor.name}, {_gear(best.gear)}; {show(best.inertia, INERTIA)} "
        f"about a drive's axis, {100.0 * best.load:.0f} % used",
        style=GOOD,
    )
    if choice.command:
        screen.print("with it:", style=FAINT)
        screen.print(choice.command, style=FAINT, soft_wrap=True)


def _show_asked(screen: Console, choice: Choice) -> None:
    given = choice.given
    cycle = [f"{k} {show(x, unit)}" for k, (x, unit) in given.problem.cycle(given.task).items()]
    screen.print(f"cycle: {', '.join(cycle)}, repeated without a rest")
    asked = [f"{name} {show(value, unit)}" for name, (value, unit) in choice.asked.items()]
    screen.print(f"at a drive, without motor and gear: {', '.join(asked)}")


def _table(choice: Choice) -> Sheet:
    heads = ("motor", "gear", "peak", "rms", "speed", "gear's", "")
    rows = table(*heads, numbers=heads[2:6])
    for one in choice.tried:
        peak, rms, speed, *gear = (demand.share for demand in one.demands)
        shares = [f"{100.0 * share:.0f} %" for share in (peak, rms, speed)]
        own = "" if one.gear is DIRECT else f"{100.0 * max(gear):.0f} %"
        verdict = Text("carries it", style=GOOD) if one.carries else Text(_why(one), style=BAD)
        style = HEAD if one is choice.picked else ""
        rows.add_row(one.motor.name, _gear(one.gear), *shares, own, verdict, style=style)
    return rows


def _why(one: Fit) -> str:
    """Say what a motor and its gear can't give."""
    return "; ".join(_excess(demand) for demand in one.demands if demand.share > 1.0)


def _excess(demand: Demand) -> str:
    factor, unit = (RPM, "rpm") if demand.unit == "rad/s" else (1.0, demand.unit)
    asked, given = (f"{factor * x:.4g}" for x in (demand.asked, demand.given))
    return f"{demand.what} {asked}, of {given} {unit}"


def _gear(gear: Gear) -> str:
    return "no gear" if gear is DIRECT else f"{gear.name} {gear.ratio:g}:1"


def _entry(one: Fit) -> dict[str, Any]:
    return {
        "motor": one.motor.name,
        "gear": None if one.gear is DIRECT else one.gear.name,
        "ratio": one.gear.ratio,
        "inertia": one.inertia,
        "carries": one.carries,
        "demands": {
            demand.what: {"asked": demand.asked, "given": demand.given, "unit": demand.unit}
            for demand in one.demands
        },
    }
