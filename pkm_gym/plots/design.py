"""One design in one picture: the machine, the map of its index, its numbers, its limits."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.names import check_known
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.task import Task, TaskLike
from pkm_gym.core.types import FloatArray
from pkm_gym.plots.canvas import text_width
from pkm_gym.plots.machine import draw_machine
from pkm_gym.plots.maps import WorkspaceMaps, draw_map
from pkm_gym.plots.style import new_figure, panel, shown, words

RIGHT, EDGE = 0.545, 0.985  # where the column of numbers begins, and where it must end
APART = 0.022  # between two tables, where there is room for it
GAP = 0.01  # between a name and its number
WRAP = 72  # letters of a line of words
# Inches:
BOTTOM = 1.65  # where the column of numbers ends; below it stand the broken limits
LINE = 0.18  # height of a line of words
TALL = 6.0  # of the figure, where its numbers leave room for the map over them
OVER = 2.6  # of the map over the numbers with its labels, and the title, at least

Rows = Mapping[str, tuple[float, str]]


def design_figure(problem: DesignProblem, design: FloatArray, task: TaskLike = None) -> Figure:
    """Draw a design (d,): machine to scale, index map, numbers with units, broken limits in words.

    A design that is out of reach, or makes no machine, is drawn as far as it goes and says so.

    Raises:
        ValueError: for a design of the wrong shape or type, or an illegal task.
    """
    evaluation, machine, chosen = _asked(problem, design, task)
    tables = _numbers(evaluation, machine, chosen)
    top = BOTTOM + LINE * max(map(len, tables.values()))  # of the numbers, inches
    tall = max(TALL, top + OVER)
    figure = new_figure(10.0, tall)
    _write(figure, evaluation, top, tables)
    if machine is None:
        figure.text(0.29, 0.5, "no machine to draw", ha="center", **words("title", color="faint"))
        return figure
    maps = WorkspaceMaps.of(problem, machine, chosen, _broken(evaluation))
    index = maps.chosen(problem.objectives[0].name)
    axes = panel(figure, (0.062, 0.51 / tall, 0.465, 1.0 - 0.78 / tall))
    draw_map(axes, maps, index, detail=False)
    draw_machine(axes, machine)
    box = (RIGHT + 0.05, (top + 0.66) / tall, 0.29, 1.0 - (top + 1.41) / tall)
    axes = panel(figure, box)
    draw_map(axes, maps, index)
    return figure


def index_map_figure(
    problem: DesignProblem, design: FloatArray, task: TaskLike = None, index: str | None = None
) -> Figure:
    """Draw local indices over the workspace of a design (d,), all of them or the one named.

    Raises:
        ValueError: for an index without a map (with its closest match), or as ``design_figure``.
    """
    evaluation, machine, chosen = _asked(problem, design, task)
    if machine is None:
        figure = new_figure(6.0, 2.2)
        lines = "\n".join(textwrap.wrap(evaluation.explain(0), WRAP))
        figure.text(0.5, 0.5, lines, ha="center", va="center", **words(color="bad"))
        return figure
    maps = WorkspaceMaps.of(problem, machine, chosen, _broken(evaluation))
    if index is not None:
        check_known("index map", [index], maps.indices)
    names = [index] if index else list(maps.indices)
    rows, columns = -(-len(names) // 2), min(2, len(names))
    width, height = 5.0 * columns, 1.85 * rows
    figure = new_figure(width, height)
    for k, name in enumerate(names):
        row, column = divmod(k, columns)
        left, bottom = 5.0 * column + 0.62, height - 1.85 * (row + 1) + 0.47
        box = (left / width, bottom / height, 3.5 / width, 1.1 / height)
        doc = maps.indices[name].doc or maps.indices[name].name
        axes = panel(figure, box, title=doc[:1].upper() + doc[1:])
        draw_map(axes, maps, maps.indices[name])
    return figure


def _asked(
    problem: DesignProblem, design: FloatArray, task: TaskLike
) -> tuple[Evaluation, Mechanism | None, Task]:
    """Return a design's evaluation, its machine or None where it makes none, and the task."""
    chosen = problem.unpack(problem.pack(task))
    evaluation = problem.evaluate(np.asarray(design)[None], chosen)
    try:
        machine = problem.mechanism(design, chosen)
    except ValueError:
        machine = None
    return evaluation, machine, chosen


def _broken(evaluation: Evaluation) -> tuple[str, ...]:
    named = zip(evaluation.problem.constraint_names, evaluation.constraints[0], strict=True)
    return tuple(name for name, value in named if value > 0.0)


def _numbers(evaluation: Evaluation, machine: Mechanism | None, task: Task) -> dict[str, Rows]:
    """Return the tables of numbers by their titles."""
    problem, design = evaluation.problem, evaluation.designs[0]
    units = {v.name: v.unit for v in problem.all_variables}
    dimensions = {k: (value, units[k]) for k, value in problem.named(design).items()}
    if machine is not None:
        dimensions.update(problem.derived(design, task))
    return {"indices": _indices(evaluation), "design": dimensions, "task": _changing(task)}


def _write(figure: Figure, evaluation: Evaluation, top: float, tables: Mapping[str, Rows]) -> None:
    """Write title, verdict, numbers from ``top`` (inches) downwards, and broken limits."""
    problem, tall = evaluation.problem, figure.get_figheight()
    verdict, color = ("feasible", "good") if evaluation.feasible[0] else ("infeasible", "bad")
    first, second = 1.0 - 0.33 / tall, 1.0 - 0.51 / tall
    figure.text(RIGHT, first, problem.name, **words("title", weight="bold"))
    figure.text(RIGHT, second, problem.title, **words("small", color="faint"))
    figure.text(EDGE, first, verdict, ha="right", **words("title", color=color))
    _tables(figure, top / tall, tables, strong=problem.objectives[0].name)
    if not evaluation.feasible[0]:
        _sentences(figure, BOTTOM - 1.6 * LINE, evaluation.explain(0).split("\n"))


def _indices(evaluation: Evaluation) -> Rows:
    units = {index.name: index.unit for index in evaluation.problem.index_table}
    return {name: (float(v[0]), units[name]) for name, v in evaluation.indices.items()}


def _changing(task: Task) -> Rows:
    """Return the task's numbers that a Family draws or that differ from the paper's."""
    values = {v: getattr(task, v.name) for v in task.variables()}
    return {v.name: (x, v.unit) for v, x in values.items() if v.drawn or x != v.default}


def _tables(figure: Figure, y: float, tables: Mapping[str, Rows], strong: str) -> None:
    """Write tables side by side from y downwards, each as wide as its words."""
    widths = [_widths(figure, rows, strong) for rows in tables.values()]
    spare = (EDGE - RIGHT - sum(map(sum, widths))) / (len(tables) - 1)
    x = RIGHT
    for (title, rows), (width, units) in zip(tables.items(), widths, strict=True):
        _table(figure, x, y, width, title, rows, strong)
        x += width + units + min(spare, APART)


def _widths(figure: Figure, rows: Rows, strong: str) -> tuple[float, float]:
    """Return the widths of names with their numbers, and of the units."""
    inner, outer = 0.0, 0.0
    for name, (value, unit) in rows.items():
        number, written = _written(value, unit)
        names = text_width(figure, name, **words("text"))
        numbers = text_width(figure, number, **words("text", weight=_weight(name, strong)))
        inner = max(inner, names + GAP + numbers)
        if written:
            outer = max(outer, 0.5 * GAP + text_width(figure, written, **words("small")))
    return inner, outer


def _table(
    figure: Figure, x: float, y: float, width: float, title: str, rows: Rows, strong: str
) -> None:
    """Write names, numbers right-aligned at x + width, and units from y downwards."""
    figure.text(x, y, title, **words("small", color="faint"))
    for name, (value, unit) in rows.items():
        y -= LINE / figure.get_figheight()
        number, written = _written(value, unit)
        figure.text(x, y, name, **words("text"))
        figure.text(x + width, y, number, ha="right", **words("text", weight=_weight(name, strong)))
        if written:
            figure.text(x + width + 0.5 * GAP, y, written, **words("small", color="faint"))


def _written(value: float, unit: str) -> tuple[str, str]:
    number, written = shown(value, unit)
    return f"{number:.4g}".replace("-", "−") if np.isfinite(number) else "–", written


def _weight(name: str, strong: str) -> str:
    return "bold" if name == strong else "normal"


def _sentences(figure: Figure, y: float, sentences: list[str]) -> None:
    """Write sentences from y inches downwards, just the limits' names where room ends."""
    step, tall = 0.85 * LINE, figure.get_figheight()
    room = int((y - 0.12) / step)
    lines: list[str] = []
    for k, sentence in enumerate(sentences):
        wrapped = textwrap.wrap(sentence, WRAP, subsequent_indent="    ")
        if len(lines) + len(wrapped) > room - (k < len(sentences) - 1):
            lines.append("and " + ", ".join(rest.partition(":")[0] for rest in sentences[k:]))
            break
        lines += wrapped
    for k, line in enumerate(lines):
        figure.text(RIGHT, (y - k * step) / tall, line, **words("small", color="bad"))
