"""The agents' verbs: train, resume, design, zoo, agent-eval, the sampler."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from pkm_gym.agents.designers import library, shipping
from pkm_gym.agents.designers.library import shipped
from pkm_gym.agents.runs import course
from pkm_gym.benchmark import EvaluationLog
from pkm_gym.benchmark.splits import split_path

TRAIN = ("train", "PKM/Diamond-v0", "--steps", 192, "--set", "envs=8", "checkpoints=2",
         "policy.net_arch=[8]", "algorithm.n_steps=12", "algorithm.batch_size=48")  # fmt: skip
DESIGN = "design.toml"
SHIPPED_ONE = ((), ("--model", "DiamondFamily"))
FOLDER = "runs/agents/Diamond-v0-ppo-0"

SHIPPED = pytest.mark.skipif("DiamondFamily" not in shipped(), reason="no designer is shipped")
SPLIT = pytest.mark.skipif(not split_path("diamond", "val").exists(), reason="no split is shipped")


@pytest.fixture
def trained(run) -> str:
    result = run(*TRAIN)
    assert result.exit_code == 0, result.stderr
    assert "best score" in result.stdout
    return FOLDER


@pytest.mark.usefixtures("trained")
def test_a_finished_run_is_not_overwritten(refused):
    assert "holds a run: go on with --resume" in refused(*TRAIN)


def test_a_run_that_is_refused_leaves_no_folder_and_one_that_was_there(run, refused):
    family = ("train", "PKM/DiamondFamily-v0", "--algo", "model", "-o", FOLDER)
    assert "solved tasks need at least" in refused(*family, "--steps", 9)
    assert not Path(FOLDER).exists()
    Path(FOLDER).mkdir(parents=True)
    assert "solved tasks need at least" in refused(*family, "--steps", 9)
    assert list(Path(FOLDER).iterdir()) == []
    assert run(*TRAIN).exit_code == 0


def test_an_illegal_setting_is_refused_before_there_is_a_folder(refused):
    family = ("train", "PKM/DiamondFamily-v0", "--algo", "model", "--set", "algorithm.pieces=0")
    assert "pieces is 0: it must be a whole number from 1 on" in refused(*family, "-o", FOLDER)
    assert not Path(FOLDER).exists()


def test_a_finished_run_resumes_at_its_end_by_its_folder_alone(trained, run):
    before = Path(trained, "run.json").read_text()
    for words in (
        (*TRAIN, "--resume"),
        ("train", trained, "--resume"),
        ("train", "--resume", trained),
    ):
        result = run(*words)
        assert result.exit_code == 0, result.stderr
        assert "best score" in result.stdout
    assert Path(trained, "run.json").read_text() == before


def test_a_run_is_lengthened_and_states_it(trained, run):
    result = run("train", "--resume", trained, "--steps", 288)
    assert result.exit_code == 0, result.stderr
    assert json.loads(Path(trained, "run.json").read_text())["recipe"]["steps"] == 288
    scores = [json.loads(line) for line in Path(trained, "scores.jsonl").read_text().splitlines()]
    assert scores[-1]["steps"] == 288


def test_a_model_is_lengthened_by_its_updates(run, refused, tmp_path):
    pool, few = tmp_path / "pool.npz", tmp_path / "few.npz"
    for number, file in ((32, pool), (4, few)):
        assert run("solve-tasks", "diamond", "-n", number, "-o", file).exit_code == 0
    words = ("train", "PKM/DiamondFamily-v0", "--algo", "model", "--pool", pool, "--validation",
             pool, "--steps", 64, "-o", "m", "--set", "algorithm.batch_size=8",
             "algorithm.width=4")  # fmt: skip
    sentence = refused(*(few if word == pool else word for word in words), "algorithm.updates=20")
    assert "the pool has 4 solvable tasks: interpolation needs" in sentence
    sentence = refused(*(63 if word == 64 else word for word in words), "algorithm.updates=20")
    assert "steps is 63: 32 solved tasks need at least 64" in sentence
    assert not Path("m").exists()
    result = run(*words, "algorithm.updates=20")
    assert result.exit_code == 0, result.stderr
    assert run("train", "m", "--resume", "--set", "algorithm.updates=30").exit_code == 0
    assert json.loads(Path("m/run.json").read_text())["recipe"]["algorithm"]["updates"] == 30
    assert "it can be lengthened, not cut to 10" in refused(
        "train", "m", "--resume", "--set", "algorithm.updates=10"
    )
    assert "a run of another recipe.steps: 64 there, 80 here" in refused(
        "train", "m", "--resume", "--steps", 80
    )


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--seed", 1), "holds a run of another seed: 0 there, 1 here"),
        (("--algo", "sac"), "holds a run of another algorithm: ppo there, sac here"),
        (("--pool", "p.npz"), "holds a run of another pool: None there, p.npz here"),
        (("--steps", 96), "holds a run of recipe.steps 192: it can be lengthened, not cut to 96"),
        (("--set", "envs=4"), "holds a run of another recipe.envs: 8 there, 4 here"),
        (
            ("--set", "algorithm.n_steps=6"),
            "holds a run of another recipe.algorithm.n_steps: 12 there, 6 here",
        ),
        (("-o", "elsewhere"), "are two folders: leave one out"),
    ],
)
def test_a_run_of_other_settings_is_not_resumed(trained, refused, words, sentence):
    assert sentence in refused("train", trained, "--resume", *words)


def test_what_is_no_run_is_not_resumed(refused):
    assert "holds no run to resume" in refused(*TRAIN, "-o", "elsewhere", "--resume")
    Path("damaged").mkdir()
    Path("damaged", "run.json").write_text('{"seed": 1')
    assert "'damaged/run.json' is damaged" in refused("train", "damaged", "--resume")


def test_what_a_score_is_measured_on_is_told_before_it_is_solved(run, refused, monkeypatch):
    monkeypatch.setattr(course, "VALIDATION_TASKS", 2)
    words = ("train", "PKM/DiamondFamily-v0", "--steps", 96, "-o", "c")
    recipe = ("envs=2", "starts=centre", "environment.objective=condition",
              "environment.reward=improvement", "algorithm.batch_size=24")  # fmt: skip
    result = run(*words, "--set", *recipe)
    assert result.exit_code == 0, result.stderr
    assert "solving 2 tasks to score the agent on, once: c/validation.npz keeps them" in (
        result.stdout.replace("\n", " ")
    )
    assert not list(Path("c").glob("*.part"))
    assert "its objective is condition): score it on solved tasks of its own" in refused(
        "agent-eval", "c"
    )
    scored = run("agent-eval", "c", "--tasks", "c/validation.npz")
    assert scored.exit_code == 0, scored.stderr
    best = json.loads(Path("c/best.json").read_text())["origin"]["score"]
    assert re.search(rf"^c +2 +{best:.4f} ", scored.stdout, re.MULTILINE)
    assert "objective condition" in scored.stdout
    designed = run("design", "diamond", "--model", "c", "--objective", "condition", "--json")
    assert json.loads(designed.stdout)["objective"] == ["condition"]


def test_an_unknown_environment_is_refused(refused):
    assert "did you mean 'PKM/Diamond-v0'?" in refused("train", "PKM/Daimond-v0")
    assert "CartPole-v1 is no design environment" in refused("train", "CartPole-v1")


def test_a_trained_agent_designs(trained, run):
    result = run("design", "diamond", "--model", trained, "--json", "--set", "task.b=1.0")
    content = json.loads(result.stdout)
    assert result.exit_code == (0 if content["feasible"] else 1), result.stderr
    assert content["task"]["b"] == 1.0
    assert np.shape(content["session"]["designs"]) == (12, 3)
    assert content["polish"]["log_merit_gain"] >= 0.0


def test_a_trained_agent_shows_its_session(trained, run, tmp_path):
    result = run("design", "diamond", "--model", trained, "--budget", 3)
    assert "a local polish moved the answer by" in result.stdout
    folder = tmp_path / "runs/diamond"
    assert (folder / "design.png").stat().st_size > 10_000
    assert f"design: runs/diamond/{DESIGN}" in result.stdout
    feasible = tomllib.loads((folder / DESIGN).read_text())["feasible"]
    title = "the answer of a trained designer after 3 evaluations"
    none = "none of the 3 designs that a trained designer tried is feasible"
    assert (title if feasible else none) in result.stdout
    assert result.exit_code == (0 if feasible else 1)


@SHIPPED
def test_a_shipped_designer_s_answer_is_an_answer(run):
    result = run("design", "diamond", "--set", "task.b=1.0")
    assert result.exit_code == 0, result.output
    assert "the answer of a trained designer after" in result.stdout
    file = re.search(r"design: (\S+)", result.stdout)[1]
    read = json.loads(run("evaluate", "diamond", "--design", file, "--json").stdout)
    assert read["feasible"]
    assert read["task"]["b"] == 1.0


def test_a_task_beyond_the_training_range_is_remarked(trained, run):
    result = run("design", "diamond", "--model", trained, "--set", "task.b=1.5")
    assert "it was not trained on such b" in result.stdout


def test_a_designer_of_another_problem_is_refused(trained, refused):
    assert "is a designer of another problem than spr3" in refused(
        "design", "spr3", "--model", trained
    )
    assert "unknown designer 'nothing'" in refused("design", "diamond", "--model", "nothing")


def test_several_designs_at_a_time_are_refused(refused):
    sentence = refused("search", "diamond", "--sampler", "designer", "--batch", 4)
    assert "proposes one design at a time" in sentence


def test_a_zip_is_not_unpickled_without_trust(refused):
    assert "--trust" in refused("agent-eval", "model.zip")


@SPLIT
def test_a_trained_agent_is_scored(trained, run, tmp_path):
    result = run("agent-eval", trained, "-o", "logs")
    assert result.exit_code == 0, result.stderr
    assert "diamond, val" in result.stdout
    log = EvaluationLog.load(tmp_path / "logs" / "designer-0.npz")
    assert (log.setting.pool, log.setting.knowledge) == (0, "transfer")  # it knew no solved tasks
    assert 0 < log.training.evaluations <= 192
    assert not log.outside.any()


@SHIPPED
def test_the_shipped_designers_are_listed(run):
    result = run("zoo")
    assert result.exit_code == 0, result.stderr
    assert all(name in result.stdout for name in shipped())


@SHIPPED
def test_a_designer_is_taken_in_among_the_user_s_own_and_overwrites_none(
    trained, run, refused, tmp_path, monkeypatch
):
    monkeypatch.setattr(library, "own_folder", lambda: tmp_path / "own")
    monkeypatch.setattr(shipping, "own_folder", library.own_folder)
    names, add = set(shipped()), ("zoo", "--add", trained, "--name")
    assert "a designer 'DiamondFamily' already" in refused(*add, "DiamondFamily")
    assert "letters, digits, - and _ only: '../x'" in refused(*add, "../x")
    assert refused("zoo", "--name", "mine").startswith("--name and -o are those of a designer")
    taken = run(*add, "mine")
    assert taken.exit_code == 0, taken.output
    assert set(shipped()) == names
    assert (tmp_path / "own" / "mine.json").is_file()
    assert "mine " in run("zoo").stdout
    assert json.loads(run("design", "diamond", "--model", "mine", "--json").stdout)["session"]
    assert "a designer 'mine' already" in refused(*add, "mine")
    said = (run("design", "diamond", "--json", *words).stdout for words in SHIPPED_ONE)
    assert len({json.dumps(json.loads(text)["session"]) for text in said}) == 1


@SHIPPED
def test_a_shipped_designer_designs_and_searches(run):
    result = run("design", "diamond", "--json")
    assert json.loads(result.stdout)["feasible"]
    result = run("search", "diamond", "--sampler", "designer", "--trials", 13, "--warm-start",
                 "designer:2")  # fmt: skip
    assert result.exit_code == 0, result.stderr
