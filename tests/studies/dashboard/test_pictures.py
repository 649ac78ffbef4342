"""What the dashboard shows beside numbers: pictures, the note, the graph of feasible designs."""

from __future__ import annotations

import json
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest
from optuna.artifacts import get_all_artifact_meta
from optuna.artifacts.exceptions import ArtifactNotFound
from optuna_dashboard import get_note, save_note
from optuna_dashboard._custom_plot_data import get_plotly_graph_objects

import pkm_gym
from pkm_gym.studies.cli.design_file import read_design, write_design
from pkm_gym.studies.dashboard.graphs import feasible_study
from pkm_gym.studies.dashboard.notes import write_note
from pkm_gym.studies.dashboard.promises import (
    DESIGN,
    INDEX_MAP,
    MARK,
    MECHANISM,
    MODEL,
    KeepingStore,
    keep,
    promise,
)
from pkm_gym.studies.search.search import search
from pkm_gym.studies.storage.storages import default_storage, open_storage
from pkm_gym.studies.storage.studies import designs_of, finished, load_study
from pkm_gym.studies.twins.model import model_text

PNG = b"\x89PNG"
ALL = {MECHANISM, INDEX_MAP, DESIGN, MODEL}


def artifacts(owner, storage):
    """Return name -> file of the artifacts of a trial or study."""
    metas = get_all_artifact_meta(owner, storage=storage)
    return {meta.filename: Path("runs/diamond/artifacts") / meta.artifact_id for meta in metas}


def graphs(study=0):
    """Return name -> graph of a study."""
    storage = open_storage(default_storage("diamond"))
    found = get_plotly_graph_objects(storage.get_study_system_attrs(study))
    return {name: json.loads(graph) for name, graph in found.items()}


def unpacked(array):
    """Return an array as plotly packs it."""
    if isinstance(array, list):
        return np.array(array)
    return np.frombuffer(b64decode(array["bdata"]), dtype=array["dtype"])


def records(trials):
    """Return the trials that were the best when they finished."""
    best, found = np.inf, []
    for trial in trials:
        log_merit = trial.user_attrs["log_merit"]
        key = trial.value if trial.user_attrs["feasible"] else 1000.0 + log_merit
        if key < best:
            best, found = key, [*found, trial]
    return found


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


def test_each_new_best_trial_has_artifacts_and_the_best_ones_are_made(counted, diamond):
    found = search(diamond, sampler="random", trials=40, seed=1)
    storage = open_storage(default_storage("diamond"))
    best = records(finished(found.study))
    assert best[-1].number == found.trial
    for trial in finished(found.study):
        names = artifacts(trial, storage)
        feasible = trial.user_attrs["feasible"]
        assert set(names) == (set() if trial not in best else ALL if feasible else ALL - {MODEL})
        made = [not file.read_bytes().startswith(MARK) for file in names.values()]
        assert all(made) if trial is best[-1] else not any(made)
    assert counted == [tuple(best[-1].params.values())] * 2


def test_what_is_promised_is_made_at_the_first_look_and_kept(counted, diamond):
    found = search(diamond, sampler="random", trials=60, seed=4)
    storage = open_storage(default_storage("diamond"))
    trial = next(t for t in records(finished(found.study)) if t.user_attrs["feasible"])
    assert trial.number != found.trial
    files = artifacts(trial, storage)
    store = KeepingStore(files[DESIGN].parent)
    counted.clear()

    def look(name):
        with store.open_reader(files[name].name) as file:
            return file.read()

    assert look(MECHANISM).startswith(PNG)
    assert look(MECHANISM) == files[MECHANISM].read_bytes()
    assert counted == [tuple(trial.params.values())]
    assert not look(DESIGN).startswith(MARK)
    read = read_design(files[DESIGN], type(diamond))
    assert {name: read.design[name] for name in trial.params} == trial.params
    assert read.values["tau_G"] == trial.value
    machine = diamond.mechanism(np.array(list(trial.params.values())))
    assert look(MODEL).decode() == model_text(machine)[0]


def test_a_promise_stands_for_just_its_problem(tmp_path):
    problem = pkm_gym.make_problem(
        "diamond", task={"payload": 1.5}, objective=("condition", "tau_G"), fixed={"gap": 0.5},
        bounds={"lam_l": (1.5, 3.0)}, cycle=True,
    )  # fmt: skip
    design = 0.5 * (problem.low + problem.high)
    path = tmp_path / "promised"
    path.write_bytes(promise(DESIGN, problem, design, "pkm-gym search diamond"))
    keep(path)
    whole = path.read_bytes()
    write_design(path, problem.evaluate(design[None]), "pkm-gym search diamond")
    assert whole == path.read_bytes()
    keep(path)
    assert whole == path.read_bytes()


def test_a_promise_that_cannot_be_kept_is_an_artifact_that_is_not_there(tmp_path, diamond):
    lost = promise(DESIGN, diamond, diamond.low, "").replace(b'"diamond"', b'"diamnd"')
    (tmp_path / "lost").write_bytes(lost)
    with pytest.raises(ArtifactNotFound, match="diamnd"):
        KeepingStore(tmp_path).open_reader("lost")
    with pytest.raises(ArtifactNotFound):
        KeepingStore(tmp_path).open_reader("never")
    assert (tmp_path / "lost").read_bytes() == lost


def test_a_resumed_search_draws_the_new_best_into_its_own_trial(counted, diamond):
    first = search(diamond, sampler="random", trials=5, seed=1)
    second = search(diamond, sampler="random", trials=60, seed=1)
    assert second.trial != first.trial
    assert counted[-1] == tuple(second.best.designs[0])
    storage = open_storage(default_storage("diamond"))
    assert set(artifacts(finished(second.study)[second.trial], storage)) == ALL


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
    for name, file in artifacts(trial, found.study._storage).items():
        address = f"/artifacts/0/{trial._trial_id}/{file.name}"
        assert (address in note) == (name in (MECHANISM, INDEX_MAP))


def test_the_note_names_every_objective(searched):
    problem = pkm_gym.make_problem("diamond", objective=("tau_G", "condition", "sigma_min"))
    note = get_note(searched(problem, trials=4).study)
    for words in ("Minimise **tau_G** (N m", "Minimise **condition**", "Maximise **sigma_min**"):
        assert words in note
    assert "`pkm-gym pareto diamond` shows the front" in note


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


def test_the_history_shows_the_feasible_designs_the_paper_and_the_optimum(searched, diamond):
    found = searched(trials=80, batch=40)
    evaluation = diamond.evaluate(designs_of(found.study, diamond))
    designs, best, paper, optimum = graphs()["feasible_designs"]["data"]
    assert designs["name"] == "feasible designs"
    np.testing.assert_array_equal(unpacked(designs["x"]), np.flatnonzero(evaluation.feasible))
    values = evaluation.objectives[evaluation.feasible, 0]
    np.testing.assert_array_equal(unpacked(designs["y"]), values)
    assert unpacked(best["y"])[-1] == found.best.objectives[0, 0]
    printed = diamond.evaluate(diamond.printed_design()[None]).objectives[0, 0]
    assert (paper["name"], optimum["name"]) == ("paper, our model", "verified optimum")
    assert list(paper["y"]) == [printed] * 2
    assert list(optimum["y"]) == [diamond.reference.optima["tau_G"].value] * 2


def test_slices_contour_and_importances_are_of_the_feasible_designs(searched, diamond):
    found = searched(trials=80, batch=40, sampler="cmaes")
    evaluation = diamond.evaluate(designs_of(found.study, diamond))
    known = graphs()
    assert set(known) == {"feasible_designs", "slices", "contour", "importances"}
    slices = known["slices"]["data"]
    names = [known["slices"]["layout"][f"xaxis{k}"]["title"]["text"] for k in ("", 2, 3)]
    for name, part in zip(names, slices, strict=True):
        column = diamond.variable_names.index(name)
        np.testing.assert_array_equal(
            unpacked(part["x"]), evaluation.designs[evaluation.feasible, column]
        )
        values = evaluation.objectives[evaluation.feasible, 0]
        np.testing.assert_array_equal(unpacked(part["y"]), values)
    assert sum(unpacked(known["importances"]["data"][0]["x"])) == pytest.approx(1.0)


def test_graphs_of_variables_have_the_units_that_people_read():
    problem = pkm_gym.make_problem("stroke_leg_gait")
    optimum = problem.design(next(iter(problem.reference.optima.values())).design)
    study = feasible_study(problem.evaluate(optimum[None]))
    params = study.trials[0].params
    assert params["l1 [mm]"] == pytest.approx(1e3 * optimum[0], rel=1e-12)
    assert params["phi [deg]"] == pytest.approx(np.degrees(optimum[3]), rel=1e-12)


def test_two_objectives_are_graphed_against_each_other(searched):
    problem = pkm_gym.make_problem("diamond", objective=("tau_G", "condition"))
    searched(problem, trials=80, batch=40)
    *designs, paper, first, second = graphs()["objectives"]["data"]
    study = load_study(open_storage(default_storage("diamond")), "a")
    evaluation = problem.evaluate(designs_of(study, problem))
    shown = np.concatenate(
        [np.transpose([unpacked(part[axis]) for axis in "xy"]) for part in designs]
    )
    expected = evaluation.objectives[evaluation.feasible]
    assert set(map(tuple, shown)) == set(map(tuple, expected))
    names = ["paper, our model", "optimum of tau_G", "optimum of condition"]
    assert [mark["name"] for mark in (paper, first, second)] == names
    optima = problem.reference.optima
    assert first["x"] == pytest.approx([optima["tau_G"].value], rel=1e-8)
    assert second["y"] == pytest.approx([optima["condition"].value], rel=1e-8)


def test_a_study_without_a_feasible_design_has_an_empty_graph(searched):
    problem = pkm_gym.make_problem("diamond", task={"sigma_low": 1.2, "sigma_high": 1.2})
    searched(problem, trials=4, sampler="cmaes")
    (graph,) = graphs().values()
    assert "0 of 4 trials" in json.dumps(graph)
    study = load_study(open_storage(default_storage("diamond")), "a")
    assert "its objective with a penalty on what it breaks" in get_note(study)
