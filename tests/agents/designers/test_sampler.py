"""DesignerSampler: the environment's proposals, in a study that may stop at any time."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import numpy as np
import optuna
import pytest

import pkm_gym
from pkm_gym.agents.designers.files import write_designer
from pkm_gym.agents.designers.sampler import DesignerSampler
from pkm_gym.agents.runs.files import Origin
from pkm_gym.studies.search.search import search
from pkm_gym.studies.storage.storages import open_storage

TASK = {"b": 1.0, "payload": 1.5}


@pytest.fixture(autouse=True)
def _quiet() -> None:
    optuna.logging.set_verbosity(optuna.logging.ERROR)


def designs_of(study: optuna.Study) -> np.ndarray:
    return np.array([list(trial.params.values()) for trial in study.trials])


def test_its_proposals_are_the_sessions(designer):
    study = optuna.create_study(sampler=DesignerSampler(designer, TASK))
    study.optimize(designer.problem.objective_for(TASK), n_trials=12)
    np.testing.assert_allclose(designs_of(study), designer.design(TASK).designs[0], atol=1e-6)


def test_it_goes_on_in_mid_session_and_then_hands_over(designer, tmp_path):
    objective = designer.problem.objective_for(TASK)
    for part in (5, 5, 5):
        study = optuna.create_study(
            study_name="a", storage=open_storage(str(tmp_path / "a.journal")), load_if_exists=True,
            sampler=DesignerSampler(designer, TASK, seed=0),
        )  # fmt: skip
        study.optimize(objective, n_trials=part)
    expected = designer.design(TASK).designs[0]
    np.testing.assert_allclose(designs_of(study)[:12], expected, atol=1e-6)
    assert len(study.trials) == 15


def test_enqueued_trials_do_not_belong_to_the_session(designer):
    study = optuna.create_study(sampler=DesignerSampler(designer, TASK))
    middle = 0.5 * (designer.problem.low + designer.problem.high) * 1.01
    study.enqueue_trial(dict(zip(designer.problem.variable_names, middle, strict=True)))
    study.optimize(designer.problem.objective_for(TASK), n_trials=13)
    np.testing.assert_allclose(designs_of(study)[1:], designer.design(TASK).designs[0], atol=1e-6)


def test_a_study_without_our_attributes_is_evaluated_anew(designer):
    objective = designer.problem.objective_for(TASK)
    study = optuna.create_study(sampler=DesignerSampler(designer, TASK))

    def bare(trial: optuna.Trial) -> float:
        return float(designer.problem.evaluate(objective.suggest(trial)[None], objective.task)
                     .log_merit[0])  # fmt: skip

    study.optimize(bare, n_trials=12)
    np.testing.assert_allclose(designs_of(study), designer.design(TASK).designs[0], atol=1e-6)


def test_a_study_of_another_problem_or_task_is_refused(random_network, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    search(pkm_gym.make_problem("diamond"), sampler="random", trials=2, name="a", storage="s")
    study = optuna.load_study(study_name="a", storage=open_storage("s"))
    study.sampler = DesignerSampler(random_network(), TASK)
    with pytest.raises(ValueError, match="of another task than the sampler"):
        study.sampler.infer_relative_search_space(study, study.trials[0])
    study.sampler = DesignerSampler(random_network("spr3"))
    with pytest.raises(ValueError, match="is not of the spr3"):
        study.sampler.infer_relative_search_space(study, study.trials[0])


def test_a_plain_study_of_other_variables_is_refused(random_network):
    study = optuna.create_study(sampler=optuna.samplers.RandomSampler(seed=0))
    study.optimize(lambda trial: trial.suggest_float("x", 0, 1), n_trials=1)
    sampler = DesignerSampler(random_network())
    with pytest.raises(ValueError, match="searches x, not"):
        sampler.infer_relative_search_space(study, study.trials[0])


SCRIPT = """
import optuna, time
from pkm_gym.agents.designers.sampler import DesignerSampler
from pkm_gym.studies.storage.storages import open_storage
sampler = DesignerSampler("mine.json", {task!r})
study = optuna.create_study(study_name="a", storage=open_storage("a.journal"), sampler=sampler,
                            load_if_exists=True)
objective = sampler.problem.objective_for({task!r})
def slow(trial):
    value = objective(trial)
    time.sleep({delay})
    return value
study.optimize(slow, n_trials={trials})
"""


def test_killed_in_mid_session_it_goes_on(designer, tmp_path):
    write_designer(designer, tmp_path / "mine.json", Origin("", "", 0, 0.0, {}), {})
    command = [sys.executable, "-c", SCRIPT.format(task=TASK, delay=0.3, trials=12)]
    process = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.DEVNULL)

    def finished() -> list[optuna.trial.FrozenTrial]:
        if "a" not in optuna.get_all_study_names(open_storage(str(tmp_path / "a.journal"))):
            return []
        study = optuna.load_study(study_name="a", storage=open_storage(str(tmp_path / "a.journal")))
        return [t for t in study.trials if t.state == optuna.trial.TrialState.COMPLETE]

    for _ in range(600):
        if len(finished()) >= 3:
            break
        time.sleep(0.2)
    process.send_signal(signal.SIGKILL)
    process.wait()
    before = len(finished())
    assert 3 <= before < 12
    command[2] = SCRIPT.format(task=TASK, delay=0.0, trials=12 - before)
    subprocess.run(command, cwd=tmp_path, check=True, stderr=subprocess.DEVNULL)
    designs = np.array([list(trial.params.values()) for trial in finished()])
    np.testing.assert_allclose(designs, designer.design(TASK).designs[0], atol=1e-6)
