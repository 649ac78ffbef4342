"""Artifacts that are made when somebody looks at them.

A finished trial takes no new artifact, and a picture takes longer than hundreds of evaluations. So
a new best trial gets its artifacts before it finishes, each a *promise*: a small file that says
what is to be made of which design. The dashboard's store makes it at the first look and keeps it.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO

import numpy as np
from optuna.artifacts import FileSystemArtifactStore
from optuna.artifacts.exceptions import ArtifactNotFound

from pkm_gym.core.files import whole_file
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms import lasting, make_problem

MECHANISM, INDEX_MAP, DESIGN, MODEL = "mechanism.png", "index_map.png", "design.toml", "model.xml"
PICTURES = (MECHANISM, INDEX_MAP)
MARK = b"pkm_gym promises\n"  # what a promise begins with

Maker = Callable[[DesignProblem, FloatArray, str, Path], object]

_making = threading.Lock()


def promise(name: str, problem: DesignProblem, design: FloatArray, found_by: str) -> bytes:
    """Return the promise of an artifact, one of ``makers()``, of a design (d,) a command found."""
    said = {
        "artifact": name,
        "found_by": found_by,
        "problem": lasting(problem),
        "design": design.tolist(),
        "arguments": {
            "task": asdict(problem.task),
            "objective": [objective.name for objective in problem.objectives],
            "free": list(problem.variable_names),
            "fixed": problem.fixed,
            "bounds": {v.name: (v.low, v.high) for v in problem.variables},
            **asdict(problem.options),
        },
    }
    return MARK + json.dumps(said).encode()


def makers() -> dict[str, Maker]:
    """Return by name how each artifact is made of a design: into a file of just that name."""
    return {MECHANISM: _draw, INDEX_MAP: _draw_maps, DESIGN: _write, MODEL: _model}


def make(name: str, problem: DesignProblem, design: FloatArray, found_by: str, path: Path) -> None:
    """Make an artifact of a design (d,) into a file, whole or not at all."""
    with TemporaryDirectory() as folder:
        made = Path(folder) / name
        makers()[name](problem, design, found_by, made)
        with whole_file(path) as part:
            part.write_bytes(made.read_bytes())


def keep(path: Path) -> None:
    """Make what a file promises, in its place; leave any other file alone.

    Raises:
        ValueError: in one sentence, for a promise that can't be kept any more.
    """
    with _making:
        content = path.read_bytes()
        if not content.startswith(MARK):
            return
        said: dict[str, Any] = json.loads(content.removeprefix(MARK))
        arguments = said["arguments"]
        arguments["bounds"] = {name: tuple(ends) for name, ends in arguments["bounds"].items()}
        problem = make_problem(said["problem"], **arguments)
        make(said["artifact"], problem, np.array(said["design"]), said["found_by"], path)


class KeepingStore:
    """A folder of artifacts, as Optuna's store, that keeps promises when they are read."""

    def __init__(self, folder: Path) -> None:
        self._store = FileSystemArtifactStore(folder)
        self._folder = folder

    def open_reader(self, artifact_id: str) -> BinaryIO:
        """Open an artifact; make it first where it is a promise."""
        file = self._store.open_reader(artifact_id)
        with file:
            promised = file.read(len(MARK)) == MARK
        if promised:
            try:
                keep(self._folder / artifact_id)
            except ValueError as error:
                raise ArtifactNotFound(str(error)) from None
        return self._store.open_reader(artifact_id)

    def write(self, artifact_id: str, content_body: BinaryIO) -> None:
        """Write an artifact."""
        self._store.write(artifact_id, content_body)

    def remove(self, artifact_id: str) -> None:
        """Remove an artifact."""
        self._store.remove(artifact_id)


def _draw(problem: DesignProblem, design: FloatArray, _: str, path: Path) -> None:
    from pkm_gym.plots import design_figure, save

    save(design_figure(problem, design), path)


def _draw_maps(problem: DesignProblem, design: FloatArray, _: str, path: Path) -> None:
    from pkm_gym.plots import index_map_figure, save

    save(index_map_figure(problem, design), path)


def _write(problem: DesignProblem, design: FloatArray, found_by: str, path: Path) -> None:
    from pkm_gym.studies.cli.design_file import write_design

    write_design(path, problem.evaluate(design[None]), found_by)


def _model(problem: DesignProblem, design: FloatArray, _: str, path: Path) -> None:
    from pkm_gym.studies.twins.model import model_text

    path.write_text(model_text(problem.mechanism(design))[0], encoding="utf-8")
