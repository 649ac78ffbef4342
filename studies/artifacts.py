"""What the dashboard shows beside numbers: pictures of the best trials, a note, a history."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from optuna import Study, Trial
from optuna.artifacts import FileSystemArtifactStore, get_all_artifact_meta, upload_artifact
from optuna.trial import FrozenTrial
from optuna_dashboard import save_note, save_plotly_graph_object  # type: ignore[attr-defined]  # has no __all__

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.studies.report import markdown, rows_beside_paper, verdict
from pkm_gym.studies.storage import designs_of, finished

MECHANISM, INDEX_MAP = "mechanism.png", "index_map.png"
CARD = "Not drawn: a better design followed at once."
READING = {
    "objectives": "An infeasible trial has a value that no feasible design reaches, so the graph "
    "of feasible designs, below the others, is the one to read.",
    "merit": "The values are merits: about 1 at the task's optimum, smaller is better, infeasible "
    "designs penalised. The graph of feasible designs, below the others, shows the objective.",
}


class Pictures:
    """Draws designs into the artifact store of a storage.

    A finished trial takes no new artifact and a drawing takes longer than hundreds of evaluations.
    So a new best trial is promised its pictures before it finishes: cards that say why there is no
    picture, replaced when ``draw`` is called for it.
    """

    def __init__(self, problem: DesignProblem, study: Study, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._problem = problem
        self._study = study
        self._store = FileSystemArtifactStore(folder)

    def promise(self, trial: Trial | Study) -> None:
        """Give a running trial, or a study, its artifacts, to be drawn later."""
        with TemporaryDirectory() as folder:
            for name in (MECHANISM, INDEX_MAP):
                path = Path(folder) / name
                path.write_bytes(self._card)
                upload_artifact(
                    artifact_store=self._store,
                    file_path=str(path),
                    study_or_trial=trial,
                    storage=self._study._storage,
                )

    def draw(self, owner: FrozenTrial | Study, design: FloatArray) -> list[str]:
        """Draw a design into the artifacts of its trial or study; return their addresses."""
        from pkm_gym.plots import design_figure, index_map_figure, save

        makers: dict[str, Any] = {MECHANISM: design_figure, INDEX_MAP: index_map_figure}
        addresses = []
        with TemporaryDirectory() as folder:
            for meta in get_all_artifact_meta(owner, storage=self._study._storage):
                if meta.filename not in makers:
                    continue
                figure = makers[meta.filename](self._problem, design)
                with save(figure, Path(folder) / meta.filename).open("rb") as file:
                    self._store.write(meta.artifact_id, file)
                addresses.append(self._address(owner, meta.artifact_id))
        return addresses

    def _address(self, owner: FrozenTrial | Study, artifact: str) -> str:
        own = "" if isinstance(owner, Study) else f"{owner._trial_id}/"
        return f"/artifacts/{self._study._study_id}/{own}{artifact}"

    @cached_property
    def _card(self) -> bytes:
        from pkm_gym.plots import new_figure, save

        figure = new_figure(4.0, 1.0)
        figure.text(0.5, 0.5, CARD, ha="center", va="center")
        with TemporaryDirectory() as folder:
            return save(figure, Path(folder) / "card.png").read_bytes()


def write_note(study: Study, best: Evaluation, name: str, pictures: list[str]) -> None:
    """Save the study's note: the problem, the paper's optimum, the best design and its pictures.

    Args:
        study: whose note it is.
        best: the evaluation of one design.
        name: what to call that design.
        pictures: addresses of its artifacts.
    """
    problem = best.problem
    rows = rows_beside_paper(best, name)
    parts = [f"# {problem.name}: {problem.title}", *_sentences(problem), markdown(problem, rows)]
    parts += [text for text in (verdict(problem), best.explain(0)) if text]
    parts += [f"![{name}]({address})" for address in pictures]
    parts.append(READING[study.user_attrs["values"]])
    save_note(study, "\n\n".join(parts))


def _sentences(problem: DesignProblem) -> Iterator[str]:
    """Say in words what is searched."""
    first = problem.objectives[0]
    docs = {index.name: index.doc for index in problem.index_table}
    unit = f" ({first.unit})" if first.unit else ""
    yield f"{first.direction.capitalize()} **{first.name}**{unit}, the {docs[first.name]}."
    space = [
        f"{v.name} {v.low:g} to {v.high:g}{v.unit and f' {v.unit}'} ({v.doc})"
        for v in problem.variables
    ]
    space += [f"{name} = {value:g}" for name, value in problem.fixed.items()]
    yield f"Over {', '.join(space)}."
    paper = problem.task_type()
    changed = [
        f"{v.name} = {getattr(problem.task, v.name):g} {v.unit}".rstrip()
        for v in problem.task_variables
        if getattr(problem.task, v.name) != getattr(paper, v.name)
    ]
    yield f"The paper's task{', with ' + ', '.join(changed) if changed else ''}."


def write_graphs(study: Study, problem: DesignProblem) -> None:
    """Save graphs of the feasible trials only: their history, and two objectives if there are.

    The dashboard's own graphs also show the infeasible trials, whose values are far off.
    """
    from plotly.graph_objects import Scatter

    trials = finished(study)
    evaluation = problem.evaluate(designs_of(study, problem))
    number = np.array([trial.number for trial in trials])[evaluation.feasible]
    values = evaluation.objectives[evaluation.feasible].T
    best = np.minimum if problem.objectives[0].direction == "minimise" else np.maximum
    designs = {"mode": "markers", "name": "feasible designs", "opacity": 0.5}
    line = {"mode": "lines", "name": "best", "line": {"shape": "hv"}}
    axes = [f"{o.name} [{o.unit}]" if o.unit else o.name for o in problem.objectives]
    title = f"feasible designs: {len(number)} of {len(trials)} trials"
    history = [
        Scatter(x=number, y=values[0], **designs),
        Scatter(x=number, y=best.accumulate(values[0]), **line),
    ]
    _save_graph(study, "feasible_designs", history, title, "trial", axes[0])
    if len(axes) > 1:
        both = [Scatter(x=values[0], y=values[1], **designs)]
        _save_graph(study, "objectives", both, title, *axes[:2])


def _save_graph(study: Study, name: str, traces: list[Any], title: str, x: str, y: str) -> None:
    from plotly.graph_objects import Figure

    figure = Figure(traces)
    figure.update_layout(template=None, title=title, xaxis_title=x, yaxis_title=y)
    save_plotly_graph_object(study, figure, graph_object_id=name)
