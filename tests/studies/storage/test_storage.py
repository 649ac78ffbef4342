"""Storages: what a study keeps, whom it refuses, and what a killed process leaves behind."""

from __future__ import annotations

import dataclasses
import signal
import subprocess
import sys
import time
from datetime import timedelta
from pathlib import Path

import optuna
import pytest
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend
from optuna.trial import TrialState

import pkm_gym
from pkm_gym.studies.cli.runs import redacted
from pkm_gym.studies.search.search import search
from pkm_gym.studies.storage import studies
from pkm_gym.studies.storage.storages import default_storage, open_storage, study_names
from pkm_gym.studies.storage.studies import finished, load_study, stands_for

JOURNAL = default_storage("diamond")


def start(*words):
    """Start a search of many trials in this folder; return it once it has finished some."""
    command = [sys.executable, "-m", "pkm_gym", "search", "diamond", "--trials", "100000", *words]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while process.poll() is None and not count():
        time.sleep(0.1)
    return process


def count():
    """Return how many trials have been told to the journal."""
    path = Path(JOURNAL)
    return path.read_text().count('"values":[') if path.exists() else 0


def content(study):
    return {t.number: (t.params, t.values, t.constraints, t.user_attrs) for t in finished(study)}


@pytest.mark.usefixtures("undrawn")
def test_a_killed_search_loses_no_finished_trial_and_its_resumption_repeats_none(diamond):
    process = start("--sampler", "tpe", "--batch", "4", "--seed", "3")
    while process.poll() is None and count() < 40:
        time.sleep(0.05)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    told = count()
    study = load_study(open_storage(JOURNAL), "diamond-tpe")
    before = content(study)
    assert len(before) == told >= 40
    found = search(diamond, trials=told + 20, seed=3)
    after = content(found.study)
    assert found.finished == told + 20
    assert {number: after[number] for number in before} == before
    assert len({tuple(params.values()) for params, *_ in after.values()}) == told + 20


@pytest.mark.usefixtures("undrawn")
def test_ctrl_c_keeps_the_finished_trials_and_says_how_to_go_on():
    process = start("--sampler", "random", "--batch", "8")
    process.send_signal(signal.SIGINT)
    out, err = process.communicate()
    assert process.returncode == 130
    study = load_study(open_storage(JOURNAL), "diamond-random")
    states = {t.state for t in study.trials}
    assert states == {TrialState.COMPLETE}
    assert f"stopped: {len(study.trials)} of 100000 trials are finished and kept" in out
    assert "Traceback" not in err


@pytest.mark.usefixtures("undrawn")
def test_two_processes_share_a_study_and_repeat_nothing(diamond):
    words = ["--sampler", "random", "--trials", "120", "--seed", "1", "--worker"]
    command = [sys.executable, "-m", "pkm_gym", "search", "diamond", *words]
    workers = [subprocess.Popen([*command, str(k)], stdout=subprocess.DEVNULL) for k in (0, 1)]
    assert [worker.wait() for worker in workers] == [0, 0]
    study = load_study(open_storage(JOURNAL), "diamond-random")
    trials = finished(study)
    assert len(trials) in (120, 121)
    assert len({tuple(t.params.values()) for t in trials}) == len(trials)
    assert study.best_value == min(t.value for t in trials)
    assert stands_for(study, diamond)


def test_plain_optuna_goes_on_with_a_journal(searched, diamond):
    found = searched(trials=3)
    plain = JournalStorage(JournalFileBackend(str(Path(JOURNAL).absolute())))
    study = optuna.load_study(study_name="a", storage=plain)
    study.optimize(diamond.objective_for(diamond.task), n_trials=2)
    assert len(finished(found.study)) == 5
    assert not Path(JOURNAL + ".lock").exists()  # the name of Optuna's own lock
    assert searched(trials=6).finished == 6


def test_a_half_written_entry_is_cut_off(searched):
    kept = content(searched(trials=5).study)
    with Path(JOURNAL).open("ab") as file:
        file.write(b'{"op_code":8,"worker_id":"x","tri')
    assert content(load_study(open_storage(JOURNAL), "a")) == kept
    assert searched(trials=8).finished == 8


@pytest.mark.parametrize("text", [b"no journal", b"no\njournal", b'{"a": 1}', b"SQLite\0format"])
def test_another_file_is_refused_and_left_as_it_is(searched, tmp_path, text):
    path = tmp_path / "precious"
    path.write_bytes(text)
    with pytest.raises(ValueError, match="is no journal of Optuna"):
        searched(storage=str(path))
    assert path.read_bytes() == text


def test_a_place_that_cannot_hold_a_journal_is_refused(searched, tmp_path):
    with pytest.raises(ValueError, match="can't open the storage"):
        searched(storage=str(tmp_path))


def test_a_database_holds_studies_too(searched):
    url = "sqlite:///studies.db"
    assert searched(trials=3, storage=url).finished == 3
    assert searched(trials=5, storage=url).finished == 5
    assert study_names(open_storage(url)) == ["a"]


def test_a_database_that_cannot_be_opened_is_refused_without_its_password(searched):
    url = "postgresql://me:secret@nowhere/x"
    with pytest.raises(
        ValueError, match=r"can't open the storage 'postgresql://me:\*\*\*@nowhere/x'"
    ):
        searched(storage=url)


@pytest.mark.parametrize(
    ("text", "kept"),
    [
        ("--storage mysql://u:p@w:x@h/d -n 2", "--storage mysql://u:***@h/d -n 2"),
        ("sqlite:///studies.db", "sqlite:///studies.db"),
        ("redis://host:6379/a@b", "redis://host:6379/a@b"),
    ],
)
def test_passwords_are_kept_out_of_what_is_recorded(text, kept):
    assert redacted(text) == kept


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"task": {"payload": 1.0}}, r"task: payload = 0 kg there, 1 kg here"),
        ({"objective": "condition"}, "objectives: .*tau_G.* there, .*condition.* here"),
        ({"objective": ("tau_G", "condition")}, "objectives: "),
        ({"fixed": {"lam_e": 0.6}}, "variables: lam_e = 0.2 to 0.75 there, none here"),
        ({"bounds": {"gap": (0.2, 0.6)}}, "variables: gap = 0.1 to 0.7 there, 0.2 to 0.6 here"),
        ({"inertia": "uniform-arm"}, "options: inertia = printed there, uniform-arm here"),
    ],
)
def test_a_study_of_another_problem_or_task_is_refused_untouched(searched, changes, said):
    kept = content(searched(trials=3).study)
    other = pkm_gym.make_problem("diamond", **changes)
    with pytest.raises(ValueError, match=f"^the study 'a' stands for another problem .{said}"):
        searched(other)
    assert content(load_study(open_storage(JOURNAL), "a")) == kept


def test_a_study_from_before_an_option_was_there_goes_on(searched, diamond):
    study = searched(trials=3).study
    unset = [name for name, value in dataclasses.asdict(diamond.options).items() if value is None]
    assert unset
    assert not set(unset) & set(study.user_attrs["options"])
    assert len(searched(trials=4).study.trials) == 4


def test_a_study_of_penalised_values_is_not_continued_with_objectives(searched):
    searched(trials=3, sampler="cmaes")
    with pytest.raises(ValueError, match="values: penalised there, objectives here"):
        searched(sampler="tpe")


def test_another_version_of_a_problem_is_refused(searched, diamond, monkeypatch):
    searched(trials=3)
    newer = dataclasses.replace(diamond.declared, version=diamond.declared.version + 1)
    monkeypatch.setattr(type(diamond), "declared", newer)
    with pytest.raises(ValueError, match="hash: its version"):
        searched()


def test_a_study_made_elsewhere_is_refused(searched):
    Path(JOURNAL).parent.mkdir(parents=True)
    study = optuna.create_study(study_name="a", storage=open_storage(JOURNAL))
    study.optimize(lambda trial: trial.suggest_float("x", 0.0, 1.0), n_trials=1)
    with pytest.raises(ValueError, match="the study 'a' was not made by pkm_gym"):
        searched()


def test_a_study_says_what_it_stands_for(searched, diamond):
    study = searched(trials=2, command="pkm-gym search diamond").study
    kept = study.user_attrs
    assert kept["hash"] == diamond.hash()
    assert diamond.task_type(**kept["task"]) == diamond.task
    assert kept["objectives"] == ["tau_G [N m/(m/s^2)]"]
    assert kept["command"] == "pkm-gym search diamond"
    assert kept["versions"]["optuna"] == optuna.__version__
    assert study.metric_names == ["tau_G"]
    assert stands_for(study, diamond)
    assert not stands_for(study, pkm_gym.make_problem("diamond", task={"b": 0.9}))


def test_other_versions_of_libraries_are_only_mentioned(searched, monkeypatch):
    assert searched(trials=2).note == ""
    monkeypatch.setattr(studies, "version", lambda name: "9.9" if name == "numpy" else "1.0")
    found = searched(trials=4)
    assert found.finished == 4
    assert "numpy" in found.note
    assert "9.9 now" in found.note


@pytest.mark.parametrize("begun", [False, True])
def test_trials_that_a_dead_process_left_running_are_told_as_failed(
    searched, diamond, monkeypatch, begun
):
    """Without a sign of life, as other tools or an earlier version leave them."""
    study = searched(trials=3).study
    trial = study.ask()
    if begun:
        diamond.objective_for(diamond.task).suggest(trial)
    studies.fail_stale(study)
    assert [t.state for t in study.trials][3:] == [TrialState.RUNNING]
    patience = ("STALE", timedelta(0)) if begun else ("SILENCE", 0.0)
    monkeypatch.setattr(studies, *patience)
    assert searched(trials=4).finished == 4
    assert [t.state for t in study.trials][3:] == [TrialState.FAIL, TrialState.COMPLETE]
