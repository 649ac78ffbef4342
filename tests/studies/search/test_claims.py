"""Searches that share a study: the total is exact, nothing is done twice, nobody is waited for."""

from __future__ import annotations

import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest
from optuna.trial import TrialState

from pkm_gym.studies.search import runner
from pkm_gym.studies.search.claims import Claims
from pkm_gym.studies.storage import studies
from pkm_gym.studies.storage.storages import default_storage, open_storage
from pkm_gym.studies.storage.studies import (
    enqueued,
    fail_stale,
    finished,
    load_study,
    show_alive,
)

COMPLETE, FAIL, RUNNING = TrialState.COMPLETE, TrialState.FAIL, TrialState.RUNNING

# One of several processes that search the same study; it draws no picture.
WORKER = """
import sys
import pkm_gym
from pkm_gym.studies.dashboard.pictures import Pictures
from pkm_gym.studies.search.search import search
Pictures.draw, Pictures.promise = (lambda *_: []), (lambda *_: None)
where, worker = sys.argv[1:]
found = search(pkm_gym.make_problem("diamond"), sampler="random", trials=40, storage=where,
               name="a", worker=int(worker), warm_start=["grid"], batch=1 + int(worker))
print(found.finished)
"""


def study_of(where=None):
    """Open the study as one more process would."""
    return load_study(open_storage(where or default_storage("diamond")), "a")


def states(study):
    return Counter(trial.state for trial in study.get_trials())


def designs(study):
    return [tuple(trial.params.values()) for trial in finished(study)]


@pytest.mark.parametrize("kind", ["journal", "sqlite", "postgresql"])
@pytest.mark.usefixtures("undrawn")
def test_workers_that_start_at_once_share_the_total_and_the_designs(kind, request):
    where = {"journal": "a.journal", "sqlite": "sqlite:///a.db"}.get(kind)
    where = where or request.getfixturevalue("server").new_database()
    workers = [
        subprocess.Popen([sys.executable, "-c", WORKER, where, str(k)], stdout=subprocess.PIPE)
        for k in range(3)
    ]
    assert [worker.communicate()[0].strip() for worker in workers] == 3 * [b"40"]
    study = study_of(where)
    assert states(study)[COMPLETE] == len(set(designs(study))) == 40
    assert states(study)[RUNNING] == 0
    chosen = {tuple(design.values()) for t in study.trials if (design := enqueued(t))}
    assert len(chosen) == 10
    assert chosen <= set(designs(study))


def test_the_total_holds_when_all_open_a_trial_at_the_same_moment(searched, monkeypatch):
    monkeypatch.setattr(Claims, "free", lambda _: 4)  # what each of them would see
    found = searched(trials=10, batch=4)
    assert found.finished == 10
    assert states(found.study)[RUNNING] == 0


def test_a_trial_of_a_process_that_died_is_given_up_and_replaced(searched, monkeypatch):
    monkeypatch.setattr(studies, "SILENCE", 1.0)
    study = searched(trials=3).study
    show_alive(study, study.ask()._trial_id, worker=7)
    began = time.monotonic()
    assert searched(trials=4).finished == 4
    assert 0.5 < time.monotonic() - began < 20.0
    assert states(study) == {COMPLETE: 4, FAIL: 1}


def test_a_process_of_the_same_number_waits_for_nothing(searched, monkeypatch):
    monkeypatch.setattr(runner, "fail_stale", lambda _: pytest.fail("it waited"))
    study = searched(trials=3, worker=7).study
    show_alive(study, study.ask()._trial_id, worker=7)
    assert searched(trials=4, worker=7).finished == 4
    assert states(study) == {COMPLETE: 4, FAIL: 1}


def test_signs_of_life_keep_a_long_trial(searched, monkeypatch):
    study = searched(trials=1).study
    trial = study.ask()
    monkeypatch.setattr("pkm_gym.studies.search.claims.HEARTBEAT", 0.05)
    claims = Claims(study, 2, worker=7)
    claims._open[trial._trial_id] = trial
    with claims:
        show_alive(study, trial._trial_id, worker=7)
        first = study.trials[1].system_attrs[studies.SIGN]
        while study_of().trials[1].system_attrs[studies.SIGN] == first:
            time.sleep(0.01)
        fail_stale(study)
        assert study.trials[1].state == RUNNING
    assert study.trials[1].state == FAIL  # what is still open at the end


def test_an_enqueued_design_of_a_process_that_died_waits_again(searched):
    study = searched(trials=1).study
    design = {"lam_e": 0.6, "lam_l": 2.5, "gap": 0.4}
    study.enqueue_trial(design)
    show_alive(study, study.ask()._trial_id, worker=0)
    assert searched(trials=2).finished == 2
    assert finished(study)[-1].params == design


def test_a_process_that_was_taken_for_dead_goes_on(searched, diamond, monkeypatch):
    """As one does that was paused: meanwhile others have given up its trials."""
    searched(trials=3)
    evaluate, slept = type(diamond).evaluate, []

    def sleepy(problem, designs, tasks=None):
        if len(designs) == 4 and not slept:  # the first batch
            slept.append(study_of())
            fail_stale(slept[0], beginner=0)
        return evaluate(problem, designs, tasks)

    monkeypatch.setattr(type(diamond), "evaluate", sleepy)
    found = searched(trials=15, batch=4)
    assert slept
    assert found.finished == 15
    assert states(found.study) == {COMPLETE: 15, FAIL: 4}
    assert found.best.objectives[0, 0] == found.study.best_value


def test_a_design_that_two_workers_enqueued_is_evaluated_once(searched):
    study = searched(trials=1).study
    design = {"lam_e": 0.6, "lam_l": 2.5, "gap": 0.4}
    for _ in range(3):
        study.enqueue_trial(design)
    found = searched(trials=6)
    assert designs(study).count(tuple(design.values())) == 1
    assert len(set(designs(study))) == found.finished == 6
    assert states(study) == {COMPLETE: 6}


def test_what_a_search_can_t_finish_is_told_as_failed(searched, diamond, monkeypatch):
    study = searched(trials=2).study
    evaluate = type(diamond).evaluate

    def broken(problem, designs, tasks=None):
        if len(designs) == 3:
            raise RuntimeError("a bug")
        return evaluate(problem, designs, tasks)

    monkeypatch.setattr(type(diamond), "evaluate", broken)
    with pytest.raises(RuntimeError, match="a bug"):
        searched(trials=9, batch=3)
    assert states(study) == {COMPLETE: 2, FAIL: 3}


def test_a_full_disk_ends_a_search_in_one_sentence(searched, limited):
    study = searched(trials=5).study
    path = Path(default_storage("diamond")).absolute()
    with (
        limited(path.stat().st_size + 3000),
        pytest.raises(OSError, match="every finished trial is kept, and the same comm") as caught,
    ):
        searched(trials=50)
    assert caught.value.filename == str(path)
    kept = designs(study)
    assert 5 <= len(kept) < 50
    found = searched(trials=50)
    assert found.finished == 50
    assert designs(found.study)[: len(kept)] == kept
    assert states(found.study)[RUNNING] == 0
