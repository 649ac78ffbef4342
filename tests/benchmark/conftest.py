"""Problems with splits, and methods of a test's own in a module that any process can import."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable
from pathlib import Path

import pytest

from pkm_gym.benchmark.splits import FOLDER, load_split, manifest, split_path
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem

SHIPPED = sorted({name.rpartition("_")[0] for name in manifest(FOLDER)})

HEAD = """
import numpy as np
import pkm_gym
from pkm_gym.benchmark import load_split, method, proposing
from pkm_gym.core.pool import Pool
from pkm_gym.mechanisms import family_problem
"""


@pytest.fixture(scope="session", params=SHIPPED)
def shipped(request: pytest.FixtureRequest) -> tuple[DesignProblem, Pool]:
    """Each problem that has splits, with its val split."""
    return load_split(request.param, "val")


@pytest.fixture
def own_methods(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request) -> Callable[[str], str]:
    """Write a module of methods; return its name."""

    def write(source: str) -> str:
        name = re.sub(r"\W", "_", f"methods_of_{request.node.name}")
        (tmp_path / f"{name}.py").write_text(HEAD + textwrap.dedent(source))
        monkeypatch.syspath_prepend(str(tmp_path))
        return name

    return write


@pytest.fixture
def peeking(shipped) -> str:
    """Source of a function that looks a task's optimum up in the file: nothing prevents that."""
    path = str(split_path(shipped[0].name, "val"))
    return f"""
def optimum(session):
    with np.load({path!r}) as split:
        return split["designs"][(split["tasks"] == session.task).all(axis=1)][0]
"""
