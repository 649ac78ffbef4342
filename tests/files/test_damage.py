"""Every kind of file that is read, damaged in many ways: read, or refused in one sentence.

A sentence names the file (or the folder that it belongs to) and is no traceback.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pkm_gym
from pkm_gym.agents.designers.files import read_designer
from pkm_gym.agents.designers.library import shipped
from pkm_gym.agents.runs.course import design_course
from pkm_gym.agents.runs.recipe import read_recipe
from pkm_gym.agents.runs.run import CHECKPOINT, Run
from pkm_gym.agents.sb3.checkpoint import load_checkpoint, save_checkpoint
from pkm_gym.agents.sb3.models import load_model
from pkm_gym.agents.sb3.trainer import make_model
from pkm_gym.benchmark.run import run, setting
from pkm_gym.benchmark.splits import FOLDER, MANIFEST, manifest
from pkm_gym.benchmark.standings import standings
from pkm_gym.core.calibration import calibration
from pkm_gym.core.pool import Pool, renewed
from pkm_gym.core.reference import Reference
from pkm_gym.core.solve import solve_tasks
from pkm_gym.studies.benchmark.leaderboard import enter
from pkm_gym.studies.cli.arguments import design_from
from pkm_gym.studies.cli.design_file import write_design
from pkm_gym.studies.search.search import search
from pkm_gym.studies.search.solving import Job
from pkm_gym.studies.storage.storages import open_storage, study_names
from pkm_gym.studies.verbs.calibrate import kept
from pkm_gym.studies.verbs.score import read_log

from .damage import replace, some

MOST = 90  # damaged contents of a file


@dataclass
class Kind:
    """A good file, and what reads it."""

    path: Path
    read: Callable[[], Any]


def _folder(tmp_path: Path, *files: Path) -> Path:
    folder = tmp_path / "folder"
    folder.mkdir()
    for file in files:
        shutil.copy(file, folder)
    return folder


def _design(tmp: Path) -> Kind:
    problem = pkm_gym.make_problem("diamond")
    path = write_design(tmp / "a.toml", problem.evaluate(problem.printed_design()[None]), "a test")
    return Kind(path, lambda: design_from("diamond", file=path))


def _package(tmp: Path, name: str, file: Path) -> Path:
    folder = tmp / f"{name}_{tmp.name}"
    folder.mkdir()
    (folder / "__init__.py").touch()
    return Path(shutil.copy(file, folder))


def _reference(tmp: Path) -> Kind:
    own = Path(pkm_gym.__file__).parent / "mechanisms/diamond/paper.toml"
    path = _package(tmp, "damaged_paper", own)

    def read() -> str:
        Reference._read.__func__.cache_clear()
        kept = Reference.load(path.parent.name)
        return kept.citation

    return Kind(path, read)


def _calibration(tmp: Path) -> Kind:
    own = Path(pkm_gym.__file__).parent / "mechanisms/stroke_leg/calibration.toml"
    path = _package(tmp, "damaged_calibration", own)
    return Kind(path, lambda: calibration(path.parent.name, "stroke_leg_gait") and kept(path))


def _manifest(tmp: Path) -> Kind:
    folder = _folder(tmp, FOLDER / MANIFEST)
    return Kind(folder / MANIFEST, lambda: manifest(folder))


def _pool(tmp: Path) -> Kind:
    problem = pkm_gym.make_problem("diamond")
    solved = solve_tasks(problem, problem.draw_tasks(6, np.random.default_rng(0)))
    path = tmp / "pool.npz"
    Pool.from_solutions(solved, solved.designs, problem, "a test").save(path)
    return Kind(path, lambda: Pool.load(path, problem))


def _older_pool(tmp: Path) -> Kind:
    kind = _pool(tmp)
    problem = pkm_gym.make_problem("diamond")
    return Kind(kind.path, lambda: renewed(kind.path, problem, certified=True))


def _part(tmp: Path) -> Kind:
    problem = pkm_gym.make_problem("diamond")
    tasks = problem.draw_tasks(4, np.random.default_rng(0))
    job = Job(problem, tasks, tasks, 0, "a test", tmp / "pool.npz.part")
    job.keep(solve_tasks(problem, tasks))
    return Kind(job.part, job.kept)


def _log(tmp: Path) -> Kind:
    log = run(setting("diamond", "val", "random", evaluations=5), np.arange(3), jobs=1)
    path = tmp / "log.npz"
    log.save(path)
    return Kind(path, lambda: standings([read_log(path)]))


def _leaderboard(tmp: Path) -> Kind:
    log = run(setting("diamond", "val", "random", evaluations=5), np.arange(3), jobs=1)
    entries, path = standings([log]), tmp / "board.csv"
    enter(entries, path)
    return Kind(path, lambda: enter(entries, path))


def _recipe(tmp: Path) -> Kind:
    own = Path(pkm_gym.__file__).parents[1] / "agents/params/ppo.toml"
    path = Path(shutil.copy(own, tmp))
    return Kind(path, lambda: read_recipe("ppo", "PKM/DiamondFamily-v0", file=path))


def _run(tmp: Path) -> Kind:
    recipe = read_recipe("ppo", "PKM/Diamond-v0")
    made = Run("PKM/Diamond-v0", "ppo", 0, recipe, None, None, tmp / "run")
    made.write()
    return Kind(tmp / "run" / "run.json", lambda: Run.read(tmp / "run"))


def _designer(tmp: Path) -> Kind:
    own = shipped()["SPR3Family"]
    folder = _folder(tmp, own, own.with_suffix(".safetensors"))
    return Kind(folder / own.name, lambda: read_designer(folder / own.name))


def _weights(tmp: Path) -> Kind:
    kind = _designer(tmp)
    return Kind(kind.path.with_suffix(".safetensors"), kind.read)


def _journal(tmp: Path) -> Kind:
    path = tmp / "a.journal"
    search(pkm_gym.make_problem("spr3"), sampler="random", trials=2, storage=str(path))
    return Kind(path, lambda: study_names(open_storage(str(path), create=False)))


def _database(tmp: Path) -> Kind:
    path = tmp / "a.db"
    search(pkm_gym.make_problem("spr3"), sampler="random", trials=2, storage=f"sqlite:///{path}")
    return Kind(path, lambda: study_names(open_storage(f"sqlite:///{path}", create=False)))


def _untrained(tmp: Path) -> Any:
    """Return a small model of SB3's, with the environment that it plans in."""
    few = ("envs=2", "policy.net_arch=[4]", "algorithm.n_steps=12", "algorithm.batch_size=24")
    recipe = read_recipe("ppo", "PKM/Diamond-v0", settings=few, steps=48)
    made = Run("PKM/Diamond-v0", "ppo", 0, recipe, None, None, tmp / "run")
    course = design_course(made.env_id, recipe, made.folder, pool=None, validation=None)
    model = make_model(made, course)
    model._setup_learn(48)
    return model


def _checkpoint(tmp: Path) -> Kind:
    model, path = _untrained(tmp), tmp / CHECKPOINT
    save_checkpoint(model, path, best=0.5)
    return Kind(path, lambda: load_checkpoint(model, path))


def _model(tmp: Path) -> Kind:
    path = tmp / "model.zip"
    _untrained(tmp).save(path)
    return Kind(path, lambda: load_model(str(path), trust=True, env_id="PKM/Diamond-v0"))


KINDS = (
    _design, _reference, _calibration, _manifest, _pool, _older_pool, _part, _log, _leaderboard,
    _recipe, _run, _designer, _weights, _journal, _database, _checkpoint, _model,
)  # fmt: skip


@pytest.fixture(params=KINDS, ids=lambda kind: kind.__name__.strip("_"))
def kind(request, tmp_path, monkeypatch) -> Kind:
    """A good file of each kind."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)
    made = request.param(tmp_path)
    made.read()
    return made


def refused(kind: Kind, way: str) -> bool:
    """Read; check that a refusal is one sentence that names the file."""
    try:
        kind.read()
    except (ValueError, OSError) as error:
        sentence = str(error)
        named = kind.path.name in sentence or str(kind.path.parent) in sentence
        assert named or kind.path.with_suffix(".json").name in sentence, (way, sentence)
        assert "\n" not in sentence, (way, sentence)
        return True
    except Exception as error:
        raise AssertionError(f"{kind.path.name}, {way}: {error!r}") from error
    return False


def test_a_damaged_file_is_read_or_refused_by_its_name(kind):
    good = kind.path.read_bytes()
    count = 0
    for way, content in some(kind.path, MOST):
        kind.path.write_bytes(content)
        count += refused(kind, way)
    kind.path.write_bytes(good)
    assert not refused(kind, "nothing")
    assert count


@pytest.mark.parametrize("instead", ["folder", "pipe", "device"])
def test_what_is_no_file_is_refused_by_its_name(kind, instead):
    replace(kind.path, instead)
    assert refused(kind, instead)
