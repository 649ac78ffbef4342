"""Verbs on a full disk: one sentence that names the file and what is kept; then they go on."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from optuna_dashboard import get_note

from pkm_gym.studies.grid.grid import LOGGED
from pkm_gym.studies.storage.storages import default_storage, open_storage
from pkm_gym.studies.storage.studies import count_finished, load_study

TRAIN = ("train", "PKM/Diamond-v0", "--steps", 192, "--set", "envs=8", "checkpoints=2",
         "policy.net_arch=[64]", "algorithm.n_steps=12", "algorithm.batch_size=48")  # fmt: skip
BENCHMARK = ("benchmark", "diamond", "--split", "val", "--tasks", 3, "--evaluations", 14,
             "--jobs", 1, "--method", "random")  # fmt: skip


@pytest.fixture
def told(run, limited):
    """Run a verb where no file grows beyond a size; return the file it names and the rest."""

    def tell(size, *words):
        with limited(size):
            result = run(*words)
        assert result.exit_code == 2, result.output
        assert isinstance(result.exception, SystemExit)
        assert "Traceback" not in result.stderr
        sentence = result.stderr.splitlines()[-1]
        path, kept = re.fullmatch(r"pkm-gym: (.+): File too large; (.+)", sentence).groups()
        return path, kept

    return tell


@pytest.mark.parametrize("size", [1_000, 10_000, 100_000])
def test_a_grid_is_made_whole_by_the_same_command(run, told, size):
    path, kept = told(size, "grid", "diamond")
    assert Path(path).name == {1_000: "studies.journal"}.get(size, "grid.nc")
    assert kept == "what is whole is kept, and the same command makes the rest"
    assert not Path("runs/diamond/grid.nc").exists()
    assert run("grid", "diamond").exit_code == 0
    study = load_study(open_storage(default_storage("diamond")), "diamond-grid")
    assert count_finished(study) == LOGGED
    assert "best of our grid" in get_note(study)


@pytest.mark.parametrize("size", [300, 3_000, 20_000])
def test_training_keeps_its_last_checkpoint(told, size):
    path, kept = told(size, *TRAIN)
    folder = "runs/agents/Diamond-v0-ppo-0"
    assert path.startswith(folder)
    assert kept.startswith(f"{folder} keeps the last checkpoint, if there is one: --resume goes on")
    assert not list(Path(folder).glob(".*part*"))


@pytest.mark.parametrize("size", [1_000, 10_000])
def test_a_benchmark_keeps_what_is_done(run, told, size):
    path, kept = told(size, *BENCHMARK)
    folder = "runs/diamond/benchmark/val"
    assert path.startswith(folder)
    assert kept == f"{folder} keeps what is done; the same command goes on from there"
    assert run(*BENCHMARK).exit_code == 0
