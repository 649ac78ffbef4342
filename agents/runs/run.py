"""The folder of a training run: what was asked for, and what came of it."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pkm_gym.agents.runs.recipe import Recipe
from pkm_gym.core.files import whole_file
from pkm_gym.core.reading import about, read_json, shaped

RUN = "run.json"
CHECKPOINT = "checkpoint.pt"
BEST = "best.json"
SCORES = "scores.jsonl"
VALIDATION = "validation.npz"  # made for the run
LIBRARIES = ("pkm_gym", "stable_baselines3", "sb3_contrib", "torch", "gymnasium", "numpy", "numba")


@dataclass(frozen=True)
class Run:
    """A training run.

    Attributes:
        env_id: of the environment.
        algorithm: "ppo", "sac", "td3", "tqc" or "model".
        seed: of the agent and the environments.
        recipe: the hyperparameters.
        pool: file of solved tasks to train on.
        validation: file of solved tasks to be scored on.
        folder: where it is kept.
        command: that started it.
    """

    env_id: str
    algorithm: str
    seed: int
    recipe: Recipe
    pool: Path | None
    validation: Path | None
    folder: Path
    command: str = ""

    def write(self) -> None:
        """Write run.json in a new folder, or in that of a run that ended before it kept anything.

        Raises:
            ValueError: if there is a run already.
        """
        file = self.folder / RUN
        if any((self.folder / name).exists() for name in (CHECKPOINT, SCORES, BEST)):
            raise ValueError(
                f"{str(self.folder)!r} holds a run: go on with --resume, or choose another folder "
                "with -o"
            )
        if file.exists():
            (self.folder / VALIDATION).unlink(missing_ok=True)
        content = {**self.settings(), "command": self.command, "versions": versions()}
        with whole_file(file) as part:
            part.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")

    def check(self) -> None:
        """Refuse to resume a run of other settings.

        Raises:
            ValueError: naming the first setting that differs, or if there is no run.
        """
        file = self.folder / RUN
        if not file.exists():
            raise ValueError(f"{str(self.folder)!r} holds no run to resume")
        content = read_json(file, "run")
        with about(file, "run"):
            kept = shaped(dict[str, Any], content)
        for name, value in self.settings().items():
            if kept.get(name) != value:
                raise ValueError(
                    f"{str(self.folder)!r} holds a run of another {name}: {kept.get(name)} there, "
                    f"{value} here"
                )

    def settings(self) -> dict[str, Any]:
        """Return what the result depends on, as JSON holds it."""
        settings: dict[str, Any] = json.loads(
            json.dumps(
                {
                    "environment": self.env_id,
                    "algorithm": self.algorithm,
                    "seed": self.seed,
                    "recipe": asdict(self.recipe),
                    "pool": self.pool and str(self.pool),
                    "validation": self.validation and str(self.validation),
                }
            )
        )
        return settings


def versions() -> dict[str, str]:
    """Return the versions of the libraries that a result may depend on."""
    return {library: version(library) for library in LIBRARIES}


@contextmanager
def threads_that_tell() -> Iterator[None]:
    """Print nothing of what TensorBoard's thread can't write: its writer raises that, too."""
    before = threading.excepthook

    def hook(failure: threading.ExceptHookArgs) -> None:
        if not isinstance(failure.exc_value, OSError):
            before(failure)

    threading.excepthook = hook
    try:
        yield
    finally:
        threading.excepthook = before
