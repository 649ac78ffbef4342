"""RecordEvaluations: what an agent evaluates in its environment, as a log of the benchmark."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium.utils import RecordConstructorArgs

from pkm_gym.benchmark.methods import Knowledge, Start
from pkm_gym.benchmark.record import TRACKS, Cost, EvaluationLog, Setting
from pkm_gym.benchmark.splits import load_split, sha256, split_file
from pkm_gym.core.names import check_known
from pkm_gym.core.pool import Pool
from pkm_gym.core.tally import TALLY
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.design import Observation
from pkm_gym.envs.infos import Info
from pkm_gym.envs.wrappers import design_env
from pkm_gym.mechanisms import lasting

Action = npt.NDArray[Any]
FREE = Cost()
SAME = 1e-9  # of two designs, a share of the range


class RecordEvaluations(
    gym.Wrapper[Observation, Action, Observation, Action], RecordConstructorArgs
):
    """Record every design that is evaluated, each episode on its task.

    Example:
        >>> problem, split = load_split("diamond", "val")
        >>> env = RecordEvaluations(FixedTasks(gym.make("PKM/DiamondFamily-v0"), split))
        >>> ...  # as many episodes as there are tasks
        >>> env.log("val", method="mine", start="free", knowledge="scratch").save("mine.npz")

    ``pkm-gym score mine.npz`` then scores it.

    Args:
        env: a design environment.

    Raises:
        TypeError: if ``env`` is no design environment.
    """

    def __init__(self, env: gym.Env[Observation, Action]) -> None:
        RecordConstructorArgs.__init__(self)
        super().__init__(env)
        self._inner = design_env(env, "RecordEvaluations")
        self._tasks: list[FloatArray] = []
        self._starts: list[FloatArray] = []
        self._designs: list[list[FloatArray]] = []
        self._outside: list[int] = []

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, Info]:
        """Begin the record of a new episode."""
        self._look()
        observation, info = self.env.reset(seed=seed, options=options)
        self._tally = TALLY.designs
        self._outside.append(0)
        self._starts.append(self._inner.session.last[0].copy())
        self._tasks.append(self._inner.session.tasks[0].copy())
        self._designs.append([])
        return observation, info

    def step(self, action: Action) -> tuple[Observation, Any, bool, bool, Info]:
        """Record the design that the action means."""
        self._look()
        outcome = self.env.step(action)
        self._tally = TALLY.designs
        self._designs[-1].append(self._inner.session.last[0].copy())
        return outcome

    def log(
        self,
        split: str,
        *,
        method: str,
        start: Start,
        knowledge: Knowledge,
        pool: int = 0,
        seed: int = 0,
        training: Cost = FREE,
        folder: Path | None = None,
    ) -> EvaluationLog:
        """Return what was recorded as a log of a split.

        Of several episodes on a task the first one counts. The track and the costs are stated by
        you; that the episodes began as the track has it is checked.

        Args:
            split: whose tasks the episodes were about.
            method: what the log is to be called.
            start: the track: "given" (at the split's starts) or "free".
            knowledge: the track: "transfer" (it was trained on other tasks or knew some, and says
                so by ``pool`` and ``training``) or "scratch".
            pool: how many solved tasks the method knew.
            seed: which of several trainings of the method it is.
            training: what it cost before the first task, besides the pool.
            folder: of the splits; see ``load_split``.

        Raises:
            ValueError: in one sentence, for another problem than the benchmark's, a task that the
                split lacks, or a track that the episodes or the costs contradict.
        """
        for what, said in (("start", start), ("knowledge", knowledge)):
            check_known(what, [said], TRACKS[what])
        if (knowledge == "transfer") != bool(pool or training.evaluations):
            raise ValueError(
                f"knowledge is {knowledge!r} with a pool of {pool} and a training of "
                f"{training.evaluations} evaluations: who knows of other tasks is in the track "
                "'transfer' and states what that cost, who doesn't in 'scratch'"
            )
        self._look()
        inner, name = self._inner, lasting(self._inner.problem)
        problem, tasks = load_split(name, split, folder)
        if inner.problem.hash() != problem.hash():
            raise ValueError(
                f"the environment's {problem.name} differs from the benchmark's: make "
                f"PKM/{problem.declared.environment}Family-v0 as it comes"
            )
        rows_of = {task.tobytes(): row for row, task in enumerate(tasks.tasks)}
        episodes: dict[int, int] = {}
        for i, task in enumerate(self._tasks):
            row = rows_of.get(task.tobytes())
            if row is None:
                raise ValueError(f"{problem.unpack(task)} is not in {split}: use FixedTasks")
            episodes.setdefault(row, i)
        rows = np.array(sorted(episodes), dtype=np.int64)
        budget = inner.rules.budget
        designs_of = np.full((len(rows), budget, len(problem.low)), np.nan)
        for i, row in enumerate(rows):
            episode = self._designs[episodes[int(row)]]
            designs_of[i, : len(episode)] = np.reshape(episode, (-1, len(problem.low)))
        for row in rows.tolist():
            self._check_start(self._starts[episodes[row]], row, tasks, start, knowledge)
        setting = Setting(
            problem=name,
            split=split,
            hash=problem.hash(),
            sha256=sha256(split_file(problem, split, folder)),
            method=method,
            source="",
            start=start,
            knowledge=knowledge,
            seed=seed,
            budget=budget,
            pool=pool,
            folder=str(folder or ""),
        )
        return EvaluationLog(
            setting,
            rows,
            designs_of,
            seconds=np.zeros(len(rows)),
            learned=np.zeros(len(rows), dtype=np.int64),
            outside=np.array([self._outside[episodes[int(row)]] for row in rows], dtype=np.int64),
            version=version("pkm_gym"),
            command="RecordEvaluations",
            training=training,
        )

    def _check_start(
        self, own: FloatArray, row: int, tasks: Pool, start: Start, knowledge: Knowledge
    ) -> None:
        """Refuse an episode that began, at a design (d,), where its track doesn't."""
        problem = self._inner.problem
        span = problem.high - problem.low

        def at(design: FloatArray) -> bool:
            return bool((np.abs(own - design) <= SAME * span).all())

        if start == "given" and not at(tasks.starts[row]):
            raise ValueError(
                f"the episode on task {row} did not begin at the split's start: with start='given' "
                "it does, by reset(options={'design': ...})"
            )
        if start == "free" and at(tasks.designs[row]):
            raise ValueError(
                f"the episode on task {row} began at the split's optimum: that is no free start"
            )
        centred = at(0.5 * (problem.low + problem.high)) or self._inner.opening.start == "random"
        if start == "free" and knowledge == "scratch" and not centred:
            raise ValueError(
                f"the episode on task {row} began at a design that was handed over: with "
                "start='free' and knowledge='scratch' it begins at the centre or at random"
            )

    def _look(self) -> None:
        """Count what was evaluated since the last step, past the environment."""
        if self._outside:
            self._outside[-1] += TALLY.designs - self._tally
            self._tally = TALLY.designs
