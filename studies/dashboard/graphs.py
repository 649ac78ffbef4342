"""Graphs of a study's feasible designs for the dashboard, in the units that people read.

The dashboard's own graphs show the infeasible trials too, and parameters in SI. These are Optuna's,
of a study that holds the feasible trials only; the history is drawn here, with the paper's value
and the verified optimum as lines.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
from optuna import Study, create_trial
from optuna import visualization as draw
from optuna.distributions import FloatDistribution
from optuna.exceptions import ExperimentalWarning
from optuna.importance import get_param_importances
from optuna_dashboard import save_plotly_graph_object  # type: ignore[attr-defined]  # has no __all__

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.trial import attribute_name
from pkm_gym.core.types import FloatArray
from pkm_gym.core.units import converted
from pkm_gym.studies import create_study
from pkm_gym.studies.report.rows import ORIGINS, Row, single_optima
from pkm_gym.studies.storage.studies import designs_of, finished

FEW = 10  # feasible designs, below which nothing is said of variables
MOST = 1000  # of the best feasible designs, in graphs of variables
PAIR = 2  # variables of a contour plot: the most important ones
HISTORY, FRONT = "feasible_designs", "objectives"
SLICES, CONTOUR, IMPORTANCES = "slices", "contour", "importances"


def write_graphs(study: Study, problem: DesignProblem, known: list[Row]) -> None:
    """Save the graphs of a study's feasible trials.

    Args:
        study: whose graphs they are.
        problem: what it searches.
        known: designs to compare with, such as the paper's and the verified optimum.
    """
    evaluation = problem.evaluate(designs_of(study, problem))
    numbers = np.array([trial.number for trial in finished(study)])
    graphs = [(HISTORY, history(evaluation, numbers, known))]
    feasible = evaluation.feasible & np.isfinite(evaluation.objectives).all(axis=1)
    order = evaluation.ranking()
    kept = np.sort(order[feasible[order]][:MOST])
    if len(problem.objectives) > 1 and len(kept):
        beside = [row for row in known if row.name not in ORIGINS] + single_optima(problem)
        graphs.append((FRONT, front(problem.evaluate(evaluation.designs[kept]), beside)))
    if len(kept) >= FEW:
        graphs += of_variables(problem.evaluate(evaluation.designs[kept]))
    for name, figure in graphs:
        figure.update_layout(template=None)
        save_plotly_graph_object(study, figure, graph_object_id=name)


def history(evaluation: Evaluation, numbers: FloatArray, known: list[Row]) -> Any:
    """Return the feasible designs' first objective by trial, the best so far, what is known."""
    from plotly.graph_objects import Figure, Scatter

    problem, feasible = evaluation.problem, evaluation.feasible
    first = problem.objectives[0]
    values = _read(evaluation.objectives[feasible, 0], first.unit)
    best = first.sign * np.minimum.accumulate(first.sign * values)
    designs = {"mode": "markers", "name": "feasible designs", "opacity": 0.5}
    line = {"mode": "lines", "name": "best", "line": {"shape": "hv"}}
    figure = Figure(
        [
            Scatter(x=numbers[feasible], y=values, **designs),
            Scatter(x=numbers[feasible], y=best, **line),
        ]
    )
    for row, dash in zip(_of_value(known), ("dash", "dot", "dashdot"), strict=False):
        value = converted(float(row.value or 0.0), first.unit)[0]
        ends = [0, max(int(numbers.max(initial=0)), 1)]
        style = {"mode": "lines", "name": row.name, "line": {"dash": dash, "width": 1.5}}
        figure.add_trace(Scatter(x=ends, y=[value, value], **style))
    title = f"feasible designs: {feasible.sum()} of {len(numbers)} trials"
    axis = attribute_name(first.name, first.unit)
    figure.update_layout(title=title, xaxis_title="trial", yaxis_title=axis)
    return figure


def front(evaluation: Evaluation, known: list[Row]) -> Any:
    """Return Optuna's graph of the front of two or three objectives, and what is known beside it.

    Of more objectives the first three are shown.
    """
    from plotly.graph_objects import Scatter, Scatter3d

    problem = evaluation.problem
    shown = problem.objectives[:3]
    study = feasible_study(evaluation)
    names = [attribute_name(o.name, o.unit) for o in shown]
    targets = None if len(shown) == len(problem.objectives) else (lambda t: t.values[:3])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExperimentalWarning)
        figure = draw.plot_pareto_front(study, target_names=names, targets=targets)
    kind = Scatter if len(shown) == 2 else Scatter3d
    for row in known:
        if row.design:
            values = problem.evaluate(problem.design(row.design)[None]).objectives[0]
            at = [[_read(values[k], o.unit)] for k, o in enumerate(shown)]
            place = dict(zip("xyz", at, strict=False))
            mark = {"symbol": "diamond", "size": 11 if len(shown) == 2 else 6}
            figure.add_trace(kind(**place, mode="markers", name=row.name, marker=mark))
    title = f"front of {', '.join(o.name for o in shown)}, feasible designs"
    figure.update_layout(title=title, legend={"orientation": "h", "y": -0.25})
    return figure


def of_variables(evaluation: Evaluation) -> Iterator[tuple[str, Any]]:
    """Yield Optuna's slices, contour and importances of the first objective's feasible designs."""
    first = evaluation.problem.objectives[0]
    alone = evaluation.problem.with_objectives(first.name)
    study = feasible_study(alone.evaluate(evaluation.designs))
    name = attribute_name(first.name, first.unit)
    figure = draw.plot_slice(study, target_name=name)
    figure.update_layout(title=f"{first.name} over each variable, feasible designs")
    yield SLICES, figure
    important = list(get_param_importances(study))
    if len(important) >= PAIR:
        figure = draw.plot_contour(study, important[:PAIR], target_name=name)
        figure.update_layout(title=f"{first.name} over the two that matter most, feasible designs")
        yield CONTOUR, figure
    figure = draw.plot_param_importances(study, target_name=name)
    figure.update_layout(title=f"what {first.name} depends on, among the feasible designs")
    yield IMPORTANCES, figure


def feasible_study(evaluation: Evaluation) -> Study:
    """Return a study in memory of the feasible designs, lengths in mm and angles in degrees."""
    problem = evaluation.problem
    names = [attribute_name(v.name, v.unit) for v in problem.variables]
    space = {
        name: FloatDistribution(_read(v.low, v.unit), _read(v.high, v.unit))
        for name, v in zip(names, problem.variables, strict=True)
    }
    study = create_study(problem)
    units = [objective.unit for objective in problem.objectives]
    for i in np.flatnonzero(evaluation.feasible):
        values = evaluation.objectives[i].tolist()
        design = evaluation.designs[i].tolist()
        params = {
            name: _read(x, v.unit)
            for name, x, v in zip(names, design, problem.variables, strict=True)
        }
        study.add_trial(
            create_trial(
                values=[_read(x, unit) for x, unit in zip(values, units, strict=True)],
                params={k: min(max(x, space[k].low), space[k].high) for k, x in params.items()},
                distributions=dict(space),
            )
        )
    return study


def _read(value: Any, unit: str) -> Any:
    """Return a value in SI, or an array of them, in the unit that people read."""
    return value * converted(1.0, unit)[0]


def _of_value(known: list[Row]) -> list[Row]:
    return [row for row in known if row.value is not None]
