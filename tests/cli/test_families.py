"""The verbs on a problem whose Family is made with other arguments than the fixed id."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator

import gymnasium as gym
import pytest

from pkm_gym import mechanisms
from pkm_gym.agents.designers.library import designer_for
from pkm_gym.benchmark.splits import load_split
from pkm_gym.core.pool import Pool
from pkm_gym.envs.design import DesignEnv
from pkm_gym.mechanisms import family_problem, make_problem

MODULE = "a_wide_diamond"
WHERE = f"{MODULE}:Wide"
SOURCE = """
from dataclasses import replace

from pkm_gym.mechanisms.diamond.problem import DiamondProblem


class Wide(DiamondProblem):
    declared = replace(
        DiamondProblem.declared, name="wide", problem=__name__ + ":Wide", environment="",
        family={"free": ("lam_e", "lam_l"), "bounds": {"lam_l": (2.0, 3.0)}},
        splits={"train": 6, "val": 4},
    )
"""


@pytest.fixture(autouse=True)
def wide(tmp_path, monkeypatch) -> Iterator[None]:
    """Write the problem into the folder that the verbs are called in; forget it after the test."""
    monkeypatch.setattr(mechanisms, "_registered", {})
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / f"{MODULE}.py").write_text(SOURCE, encoding="utf-8")
    before = set(gym.registry)
    yield
    sys.modules.pop(MODULE, None)
    for env_id in set(gym.registry) - before:
        del gym.registry[env_id]


def test_its_splits_and_benchmark_are_of_the_family_s_problem(run, tmp_path):
    assert run("splits", WHERE).exit_code == 0
    problem, split = load_split(WHERE, "val", tmp_path / "runs" / "wide" / "splits")
    assert problem.hash() == split.hash == family_problem(WHERE).hash()
    assert (split.designs.shape, problem.variable_names) == ((4, 2), ("lam_e", "lam_l"))
    file = tmp_path / "runs" / "wide" / "splits" / "wide_val.npz"
    assert DesignEnv(WHERE, family=True, pool=file).opening.solved is not None
    with pytest.raises(ValueError, match="belongs to another problem"):
        DesignEnv(WHERE, pool=file)
    done = run("benchmark", WHERE, "--split", "val", "--method", "random", "--jobs", "1")
    assert done.exit_code == 0, done.output
    log = next((tmp_path / "runs" / "wide" / "benchmark" / "val").glob("*.npz"))
    assert run("score", log).exit_code == 0
    assert "is as it should be" in run("restamp", WHERE, file).stdout


def test_its_pools_hold_what_is_given_over_what_is_declared(run, tmp_path):
    pool = tmp_path / "pool.npz"
    done = run("solve-tasks", WHERE, "-n", 2, "--fix", "lam_e=0.5", "-o", pool)
    assert done.exit_code == 0, done.output
    problem = family_problem(WHERE, fixed={"lam_e": 0.5})
    assert Pool.load(pool, problem).designs.shape == (2, 1)
    assert (problem.low[0], problem.high[0]) == (2.0, 3.0)


def test_its_calibration_is_of_the_family_s_problem(run, monkeypatch):
    seen = []
    monkeypatch.setattr(
        "pkm_gym.studies.verbs.calibrate.calibrate",
        lambda problem, *_, **__: seen.append(problem.hash()) or (_ for _ in ()).throw(ValueError),
    )
    assert run("calibrate", WHERE, "-n", 1).exit_code == 2
    assert seen == [family_problem(WHERE).hash()]


def test_list_and_page_say_what_its_family_frees(run):
    words = "free lam_e, lam_l; lam_l from 2 to 3"
    assert f"designs of its Family: {words}" in run("list", WHERE).stdout
    page = run("page", WHERE).stdout
    assert f"are drawn; designs: {words} |" in page
    assert (
        "| action of a Family's session | `Box(-1, 1, (2,), float32)` | `lam_e`, `lam_l` |" in page
    )
    assert "And of a Family's session:" in page
    assert "Family's session" not in run("page", "diamond").stdout


def test_a_designer_of_the_family_is_refused_on_the_fixed_problem(run, tmp_path, monkeypatch):
    small = [
        "envs=8", "checkpoints=1", "algorithm.n_steps=12", "algorithm.batch_size=48",
        "policy.net_arch=[16,16]",
    ]  # fmt: skip
    words = [word for item in small for word in ("--set", item)]
    assert run("splits", WHERE).exit_code == 0
    trained = run("train", WHERE, "--steps", 96, "-o", "trained", *words)
    assert trained.exit_code == 0, trained.output
    done = run("design", WHERE, "--model", "trained", "--json")
    assert done.exit_code == (0 if json.loads(done.stdout)["feasible"] else 1), done.output
    done = run("agent-eval", "trained")
    assert done.exit_code == 0, done.output
    file = tmp_path / "trained" / "best.json"
    monkeypatch.setattr("pkm_gym.agents.designers.library.shipped", lambda: {"Wide": file})
    assert designer_for(family_problem(WHERE)).problem.variable_names == ("lam_e", "lam_l")
    with pytest.raises(ValueError, match=r"take those of its Family \(free lam_e, lam_l; "):
        designer_for(make_problem(WHERE))
