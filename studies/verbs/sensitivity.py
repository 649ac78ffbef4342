"""``pkm-gym sensitivity``: slopes and bends of the objective, and what each limit costs."""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from pkm_gym.core.units import converted
from pkm_gym.studies.buildable.content import of_sensitivity
from pkm_gym.studies.buildable.dimensions import BUILT
from pkm_gym.studies.buildable.sensitivity import Price, Sensitivity, sensitivity
from pkm_gym.studies.buildable.start import start_from
from pkm_gym.studies.cli.options import (
    CsvOption,
    DesignFileOption,
    DesignOption,
    FreeOption,
    Name,
    ObjectiveOption,
    PlainJsonOption,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.tasks import task_folder
from pkm_gym.studies.cli.terminal import BAD, FAINT, section, table
from pkm_gym.studies.report.answer import hand_over

SMALL = 5e-7  # a share that is shown as 0


def command(
    name: Name,
    set_: DesignOption = None,
    design: DesignFileOption = None,
    objective: ObjectiveOption = None,
    free: FreeOption = None,
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Tell how the objective goes with each dimension, and what 1 % of each limit is worth.

    Without a design it is the optimum of the task, recorded or solved now. Prices of limits and of
    the task hold at an optimum only.

    Example: pkm-gym sensitivity diamond
    """
    out = Output(as_json, csv)
    start = start_from(name, set_, design, objective, free)
    found = sensitivity(start.problem, start.design)
    screen, path = out.screen, task_folder(start.problem) / "sensitivity.toml"
    screen.print(f"{start.problem.name}: {start.words}")
    for note in start.notes:
        screen.print(note, style=FAINT)
    show_sensitivity(screen, found)
    hand_over(screen, found.nominal, path)
    out.give(of_sensitivity(found, path))


def show_sensitivity(screen: Console, found: Sensitivity) -> None:
    """Print slopes and bends by dimension, and prices where they hold."""
    first, value = found.nominal.problem.objectives[0], found.nominal.objectives[0, 0]
    unit = converted(0.0, first.unit)[1]
    screen.print(f"{first.name} {converted(value, first.unit)[0]:.6g} {unit}".rstrip())
    screen.print(section(f"What a step of a dimension makes of {first.name}"))
    heads = ["value", "slope", "bend"]
    rows = table("dimension", "value", "step", "slope", "bend", "", numbers=heads)
    for k, (name, own) in enumerate(found.values.items()):
        slope, bend = found.gradient[name] / abs(value), found.hessian[k, k] / abs(value)
        number, read = converted(own, found.units[name])
        size = f"1 {read}" if found.units[name] in BUILT else "1 %"
        cells = (f"{number:.5g} {read}".rstrip(), size, _percent(slope), _percent(bend))
        rows.add_row(name, *cells, _remark(found, name))
    screen.print(rows)
    note = f"slope: change of {first.name} for the step; bend: second derivative for it"
    screen.print(Text(note, style=FAINT))
    if not found.optimal:
        left = f"{100.0 * found.multipliers.left:.2g} % of the slope is left"
        screen.print(
            f"no prices: they hold at an optimum, and this is none ({left}); `pkm-gym polish` "
            "finds one",
            style=BAD,
        )
        return
    _show_prices(screen, found)


def _show_prices(screen: Console, found: Sensitivity) -> None:
    first = found.nominal.problem.objectives[0]
    screen.print(section(f"What 1 % more is worth: the change of the best {first.name}"))
    heads = ["value", "the best"]
    rows = table("limit or task", "value", "the best", "", numbers=heads)
    limits = found.multipliers.limits
    for name in limits:
        price = found.limits.get(name)
        if price is None:
            rows.add_row(name, "", "", "active; its bound has no 1 %")
        else:
            rows.add_row(name, *_priced(found, price), "bound of the active limit")
    units = {v.name: v.unit for v in found.nominal.problem.variables}
    named = found.nominal.problem.named(found.nominal.designs[0])
    for name in found.multipliers.edges:
        share = _edge_price(found, name)
        price = Price(named[name], units[name], share)
        rows.add_row(name, *_priced(found, price), "edge of the search box")
    for name, price in found.task.items():
        if abs(price.share) > SMALL:
            rows.add_row(f"task.{name}", *_priced(found, price), "")
    screen.print(rows)


def _edge_price(found: Sensitivity, name: str) -> float:
    """Return what 1 % more of a search bound is worth."""
    problem = found.nominal.problem
    (at,) = (k for k, v in enumerate(problem.variables) if v.name == name)
    value, variable = float(found.nominal.designs[0, at]), problem.variables[at]
    inwards = 1.0 if value - variable.low < variable.high - value else -1.0
    return found.multipliers.edges[name] * inwards * 0.01 * value


def _priced(found: Sensitivity, price: Price) -> tuple[str, str]:
    """Return a number of the task and the change of the objective, which goes with its sign."""
    number, unit = converted(price.value, price.unit)
    change = found.nominal.problem.objectives[0].sign * price.share
    return f"{number:.5g} {unit}".rstrip(), _percent(change)


def _percent(share: float) -> str:
    return "0 %" if abs(share) < SMALL else f"{100.0 * share:+.3g} %"


def _remark(found: Sensitivity, name: str) -> str:
    remarks = []
    if name in found.held:
        remarks.append("not searched")
    if name in found.kinks:
        remarks.append("a kink: other slopes to both sides")
    return "; ".join(remarks)
