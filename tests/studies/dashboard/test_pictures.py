"""What the dashboard shows beside numbers: pictures, the note, the graph of feasible designs."""

from __future__ import annotations

import json
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest
from optuna.artifacts import get_all_artifact_meta
from optuna_dashboard import get_note, save_note
from optuna_dashboard._custom_plot_data import get_plotly_graph_objects

import pkm_gym
from pkm_gym.studies.dashboard.notes import write_note
from pkm_gym.studies.dashboard.pictures import INDEX_MAP, MECHANISM
from pkm_gym.studies.search import runner
from pkm_gym.studies.search.search import search
from pkm_gym.studies.storage.storages import default_storage, open_storage
from pkm_gym.studies.storage.studies import designs_of, finished, load_study

PNG = b"\x89PNG"


def pictures(trial, storage):
    """Return name -> bytes of a trial's artifacts."""
    folder = Path("runs/diamond/artifacts")
    metas = get_all_artifact_meta(trial, storage=storage)
    return {meta.filename: (folder / meta.artifact_id).read_bytes() for meta in metas}


def unpacked(array):
    """Return an array as plotly packs it."""
    return np.frombuffer(b64decode(array["bdata"]), dtype=array["dtype"])


@pytest.fixture
def counted(monkeypatch, tmp_path):
    """Work in an empty folder; have figures say which design they show, and count them."""
    monkeypatch.chdir(tmp_path)
    shown = []

    def figure(_, design):
        from pkm_gym.plots import new_figure

        shown.append(tuple(design))
        return new_figure(1.0, 1.0 + len(shown) / 10)

    monkeypatch.setattr("pkm_gym.plots.design_figure", figure)
    monkeypatch.setattr("pkm_gym.plots.index_map_figure", figure)
    return shown


def test_each_new_best_trial_has_pictures_and_the_best_ones_are_drawn(counted, diamond):
    found = search(diamond, sampler="random", trials=40, seed=1)
    trials = finished(found.study)
    best, records = np.inf, []
    for trial in trials:
        log_merit = trial.user_attrs["log_merit"]
        key = trial.value if trial.user_attrs["feasible"] else 1000.0 + log_merit
        if key < best:
            best, records = key, [*records, trial]
    assert records[-1].number == found.trial
    cards, storage = set(), open_storage(default_storage("diamond"))
    for trial in trials:
        names = pictures(trial, storage)
        assert set(names) == ({MECHANISM, INDEX_MAP} if trial in records else set())
        assert all(content.startswith(PNG) for content in names.values())
        if trial in records[:-1]:
            cards |= set(names.values())
    assert len(cards) == 1
    assert not cards & set(pictures(records[-1], storage).values())
    assert counted == [tuple(records[-1].params.values())] * 2


def test_a_long_search_draws_while_it_runs(counted, diamond, monkeypatch):
    monkeypatch.setattr(runner, "DRAW_EVERY", 0.0)
    search(diamond, sampler="random", trials=12, seed=1)
    assert len(counted) > 2


def test_a_resumed_search_draws_the_new_best_into_its_own_trial(counted, diamond):
    first = search(diamond, sampler="random", trials=5, seed=1)
    second = search(diamond, sampler="random", trials=60, seed=1)
    assert second.trial != first.trial
    assert counted[-1] == tuple(second.best.designs[0])
    storage = open_storage(default_storage("diamond"))
    assert len(pictures(finished(second.study)[second.trial], storage)) == 2


@pytest.mark.usefixtures("counted")
def test_the_note_tells_the_problem_the_papers_optimum_and_the_best_design(diamond):
    found = search(diamond, sampler="random", trials=60, seed=1)
    note = get_note(found.study)
    printed = diamond.reference["tau_G"]
    assert f"{printed.printed:g}" in note
    assert printed.verdict in note
    assert f"best, trial {found.trial}" in note
    assert f"{found.best.objectives[0, 0]:.5g}" in note
    assert "verified optimum" in note
    assert "The paper's task." in note
    trial = finished(found.study)[found.trial]
    for meta in get_all_artifact_meta(trial, storage=found.study._storage):
        assert f"/artifacts/0/{trial._trial_id}/{meta.artifact_id}" in note


def test_the_note_of_another_task_leaves_out_what_the_paper_says_of_its_own(searched):
    heavier = pkm_gym.make_problem("diamond", task={"payload": 1.5}, fixed={"lam_e": 0.6})
    study = searched(heavier, trials=8).study
    note = get_note(study)
    assert "payload = 1.5 kg" in note
    assert "lam_e = 0.6" in note
    assert "paper, printed" not in note
    assert "verified optimum" not in note


def test_the_user_s_words_in_a_note_stay(searched):
    study = searched(trials=4).study
    first = get_note(study)
    save_note(study, f"Ask Mei about this.\n\n{first}\n\nShe says 1.5 kg.")
    again = get_note(searched(trials=60).study)
    assert again.startswith("Ask Mei about this.\n\n# diamond: ")
    assert again.endswith("\n\nShe says 1.5 kg.")
    assert again.count("# diamond: ") == 1
    assert first not in again
    save_note(study, again.replace("Minimise", "Lower"))
    whole = get_note(searched(trials=90).study)
    assert whole.count("She says 1.5 kg.") == 1
    assert whole.count("Lower **tau_G**") == whole.count("Minimise **tau_G**") == 1


def test_the_note_says_which_limits_the_best_design_breaks(searched, diamond):
    study = searched(trials=2).study
    broken = diamond.evaluate(np.array([[0.2, 1.2, 0.7]]))
    write_note(study, broken, "best", [])
    assert broken.explain(0) in get_note(study)


def test_the_graph_shows_the_feasible_designs_only(searched, diamond):
    found = searched(trials=80, batch=40)
    evaluation = diamond.evaluate(designs_of(found.study, diamond))
    storage = open_storage(default_storage("diamond"))
    (graph,) = get_plotly_graph_objects(storage.get_study_system_attrs(0)).values()
    designs, best = json.loads(graph)["data"]
    assert designs["name"] == "feasible designs"
    np.testing.assert_array_equal(unpacked(designs["x"]), np.flatnonzero(evaluation.feasible))
    values = evaluation.objectives[evaluation.feasible, 0]
    np.testing.assert_array_equal(unpacked(designs["y"]), values)
    assert unpacked(best["y"])[-1] == found.best.objectives[0, 0]


def test_two_objectives_are_graphed_against_each_other(searched):
    problem = pkm_gym.make_problem("diamond", objective=("tau_G", "condition"))
    searched(problem, trials=80, batch=40)
    storage = open_storage(default_storage("diamond"))
    graphs = get_plotly_graph_objects(storage.get_study_system_attrs(0))
    designs = json.loads(graphs["objectives"])["data"][0]
    evaluation = problem.evaluate(designs_of(load_study(storage, "a"), problem))
    np.testing.assert_array_equal(
        np.transpose([unpacked(designs[axis]) for axis in "xy"]),
        evaluation.objectives[evaluation.feasible],
    )


def test_a_study_without_a_feasible_design_has_an_empty_graph(searched):
    problem = pkm_gym.make_problem("diamond", task={"sigma_low": 1.2, "sigma_high": 1.2})
    searched(problem, trials=4, sampler="cmaes")
    storage = open_storage(default_storage("diamond"))
    (graph,) = get_plotly_graph_objects(storage.get_study_system_attrs(0)).values()
    assert "0 of 4 trials" in graph
    assert "The values are merits" in get_note(load_study(storage, "a"))
