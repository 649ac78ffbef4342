"""The folder of a training run: what was asked for, and what came of it."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, Self

from pkm_gym.agents.runs.recipe import GROUPS, LEARNERS, Recipe
from pkm_gym.core.files import whole_file
from pkm_gym.core.reading import about, read_json, shaped

RUN = "run.json"
CHECKPOINT = "checkpoint.pt"
BEST = "best.json"
SCORES = "scores.jsonl"
VALIDATION = "validation.npz"  # made for the run
LIBRARIES = ("pkm_gym", "stable_baselines3", "sb3_contrib", "torch", "gymnasium", "numpy", "numba")


@dataclass(frozen=True)
class Kept:
    """What run.json says of a run."""

    environment: str
    algorithm: str
    seed: int
    recipe: dict[str, Any]
    pool: str | None
    validation: str | None
    command: str


KEPT = tuple(item.name for item in fields(Kept))


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
        self.state()

    @contextmanager
    def begun(self) -> Iterator[None]:
        """Write run.json; if the run is refused before it keeps anything else, take it away again.

        Raises:
            ValueError: as ``write``, and what the run is refused for.
        """
        new = not self.folder.exists()
        self.write()
        try:
            yield
        except ValueError:
            if [file.name for file in self.folder.iterdir()] == [RUN]:
                (self.folder / RUN).unlink()
                if new:
                    self.folder.rmdir()
            raise

    @classmethod
    def read(cls, folder: Path) -> Self:
        """Return the run of a folder, as its run.json states it.

        Raises:
            ValueError: in one sentence, for a folder without a run, or a damaged run.json.
        """
        file = folder / RUN
        if not file.exists():
            raise ValueError(f"{str(folder)!r} holds no run to resume")
        content = read_json(file, "run")
        with about(file, "run"):
            kept = shaped(
                Kept, {k: x for k, x in shaped(dict[str, Any], content).items() if k in KEPT}
            )
            recipe = shaped(Recipe, kept.recipe, "recipe")
        pool, validation = (Path(f) if f else None for f in (kept.pool, kept.validation))
        return cls(
            kept.environment, kept.algorithm, kept.seed, recipe, pool, validation, folder,
            kept.command,
        )  # fmt: skip

    def lengthened(self, **asked: Any) -> Self:
        """Return this run with what is asked of it now, which may only be that it be longer.

        Args:
            asked: fields of a Run; what is None isn't asked. A recipe may be longer.

        Raises:
            ValueError: naming the first setting that differs.
        """
        new = replace(self, **{name: value for name, value in asked.items() if value is not None})
        before, now = self._flat(), new._flat()
        growing = "recipe.steps" if self.algorithm in LEARNERS else "recipe.algorithm.updates"
        for name in {**before, **now}:
            there, here = before.get(name), now.get(name)
            if there == here:
                continue
            if name != growing:
                raise ValueError(
                    f"{str(self.folder)!r} holds a run of another {name}: {there} there, "
                    f"{here} here"
                )
            if here is None or there is None or here < there:
                raise ValueError(
                    f"{str(self.folder)!r} holds a run of {name} {there}: it can be lengthened, "
                    f"not cut to {here}"
                )
        return new

    def _flat(self) -> dict[str, Any]:
        """Return the settings, those of the recipe by their own names."""
        settings = self.settings()
        return {k: x for k, x in settings.items() if k != "recipe"} | dict(
            _named(settings["recipe"], "recipe")
        )

    def state(self) -> None:
        """Write run.json anew."""
        content = {**self.settings(), "command": self.command, "versions": versions()}
        with whole_file(self.folder / RUN) as part:
            part.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")

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


def _named(values: Mapping[str, Any], above: str) -> Iterator[tuple[str, Any]]:
    for name, value in values.items():
        if isinstance(value, Mapping) and name in GROUPS:
            yield from _named(value, f"{above}.{name}")
        else:
            yield f"{above}.{name}", value


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
