"""``train`` on motion environments and ``motion-eval``."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from pkm_gym.agents.runs import tuning

TRAIN = ("train", "PKM/DiamondMotion-v0", "--steps", 256, "--set", "envs=2", "checkpoints=2",
         "policy.net_arch=[8]", "algorithm.n_steps=64", "algorithm.batch_size=64")  # fmt: skip
FOLDER = "runs/agents/DiamondMotion-v0-ppo-0"


@pytest.fixture
def trained(run) -> str:
    result = run(*TRAIN)
    assert result.exit_code == 0, result.stderr
    assert "best score" in result.stdout
    assert "on the path, from its beginning" in result.stdout
    return FOLDER


def test_a_trained_agent_is_scored_beside_the_baselines(trained, run, tmp_path):
    result = run("motion-eval", "PKM/DiamondMotion-v0", trained, "--json")
    assert result.exit_code == 0, result.stderr
    scores = {row["driver"]: row for row in json.loads(result.stdout)["rows"]}
    assert list(scores) == ["computed-torque", "servo", "idle", "random", "DiamondMotion-v0-ppo-0"]
    best = scores["computed-torque"]
    assert (best["finished"], best["runs"], best["reasons"]) == (1, 1, ["finished"])
    assert best["rms_error"] < best["peak_error"] < 1e-3
    assert scores["idle"]["reasons"] == ["off the path"]
    recorded = (tmp_path / FOLDER / "scores.jsonl").read_text().splitlines()
    reached = max(json.loads(line)["score"] for line in recorded)
    assert scores["DiamondMotion-v0-ppo-0"]["mean_reward"] == pytest.approx(reached, abs=1e-12)


def test_other_designs_and_a_picture(run, tmp_path):
    result = run("motion-eval", "PKM/SPR3Motion-v0", "--designs", 1, "--out", "made/spr3.png")
    assert result.exit_code == 0, result.stderr
    assert "servo" in result.stdout
    assert "2/2" in result.stdout
    assert "computed-torque" not in result.stdout
    assert (tmp_path / "made" / "spr3.png").stat().st_size > 10_000


def test_mistakes_are_refused_in_one_sentence(refused):
    assert "did you mean 'PKM/DiamondMotion-v0'" in refused("motion-eval", "PKM/DiamondMotio-v0")
    assert "PKM/Diamond-v0 is no motion environment" in refused("motion-eval", "PKM/Diamond-v0")
    assert "can't read the driver" in refused("motion-eval", "PKM/DiamondMotion-v0", "nothing")
    assert "has no use for --pool" in refused("train", "PKM/DiamondMotion-v0", "--pool", "p.npz")
    for verb in ("train", "tune"):
        assert "is trained by one of ppo, sac, td3, tqc, not by model" in refused(
            verb, "PKM/DiamondMotion-v0", "--algo", "model"
        )
    assert "is none of the environment's" in refused(
        "motion-eval", "PKM/DiamondMotion-v0", "--set", "algorithm.gamma=0.9"
    )


def test_the_environment_is_set_as_in_training(run):
    limits = [
        json.loads(run("motion-eval", "PKM/DiamondMotion-v0", "--json", "--set", word).stdout)
        for word in ("environment.force_limit=60.0", "environment.force_limit=120.0")
    ]
    shares = [one["rows"][0]["peak_share"] for one in limits]  # of computed torque
    assert shares[0] == pytest.approx(2.0 * shares[1], rel=0.2)


def test_a_driver_is_tuned(run, monkeypatch):
    monkeypatch.setattr(tuning, "SEEDS", (0,))
    monkeypatch.setattr(tuning, "FRESH", range(100, 101))
    monkeypatch.setattr("pkm_gym.agents.verbs.tune.FRESH", range(100, 101))
    result = run("tune", *TRAIN[1:], "--trials", 1, "--csv", "tuned.csv")
    assert result.exit_code == 0, result.stderr
    assert "The best of 1 trials" in result.stdout
    assert "one fresh seed" in result.stdout
    assert Path("tuned.csv").read_text().startswith("hyperparameter,value\n")


def test_a_model_is_no_driver(refused, tmp_path):
    sentence = refused("train", "PKM/DiamondMotion-v0", "--algo", "model", "-o", "a")
    assert "is trained by one of ppo, sac, td3, tqc, not by model" in sentence
    assert not (tmp_path / "a").exists()
