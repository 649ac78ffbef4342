"""The loop of a search: ask, evaluate a batch, tell; in threads, until done or Ctrl-C."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from types import FrameType

import numpy as np
from optuna import Study, Trial
from optuna.exceptions import UpdateFinishedTrialError

from pkm_gym.core.cache import say_once
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.studies.dashboard.pictures import Pictures
from pkm_gym.studies.search.claims import Claims
from pkm_gym.studies.search.samplers import score
from pkm_gym.studies.storage.studies import (
    Values,
    count_finished,
    designs_of,
    fail_stale,
    finished,
)

PAUSE = 0.1  # seconds between two looks at whether other workers have finished their trials
PAUSES = 20  # after so many it is said that they are waited for

Report = Callable[[int, Evaluation], None]


class Runner:
    """Asks a study for designs, evaluates them in batches and tells it.

    Args:
        study: with its sampler.
        problem: what is searched, with its task.
        trials: how many finished trials the study shall have.
        values: what the study's values are.
        batch: designs an ``evaluate``.
        worker: number of this process among those that share the study.
        pictures: promises the best designs their pictures.
        report: called after each batch with the finished trials and the best design.
    """

    def __init__(
        self,
        study: Study,
        problem: DesignProblem,
        *,
        trials: int,
        values: Values = "objectives",
        batch: int = 1,
        worker: int = 0,
        pictures: Pictures | None = None,
        report: Report | None = None,
    ) -> None:
        self.study = study
        self.best: Evaluation | None = None
        self.best_trial = -1
        self.ran = False
        self._problem = problem
        self._objective = problem.objective_for(problem.task)
        self._trials = trials
        self._values = values
        self._batch = batch
        self._pictures = pictures
        self._report = report
        self._claims = Claims(study, trials, worker)
        self._pauses = 0
        self._lock = threading.Lock()
        self._stop = threading.Event()
        if count_finished(study):
            self.best, self.best_trial = answer(study, problem)

    def run(self, jobs: int = 1) -> bool:
        """Run until the study has its trials, in ``jobs`` threads; return whether Ctrl-C came."""
        with interruptible(self._stop), self._claims:
            if jobs == 1:
                self._work()
            else:
                with ThreadPoolExecutor(jobs) as pool:
                    for worker in [pool.submit(self._work) for _ in range(jobs)]:
                        worker.result()
        return self._stop.is_set()

    def _work(self) -> None:
        try:
            while not self._stop.is_set():
                if trials := self._take():
                    self._step(trials)
                elif count_finished(self.study) >= self._trials:
                    return
                else:
                    self._wait()
        except BaseException:
            self._stop.set()
            raise

    def _take(self) -> list[tuple[Trial, FloatArray]]:
        """Open some trials: one at first, for samplers learn the space from it."""
        with self._lock:
            most = self._batch if count_finished(self.study) else 1
            size = min(most, self._claims.free())
            claims = [self._claims.claim(self._objective.suggest) for _ in range(size)]
            return [claim for claim in claims if claim]

    def _step(self, opened: list[tuple[Trial, FloatArray]]) -> None:
        trials = [trial for trial, _ in opened]
        evaluation = self._problem.evaluate(np.array([design for _, design in opened]))
        with self._lock:
            self._keep_best(trials, evaluation)
        for i, trial in enumerate(trials):
            with self._claims.closing(trial):
                values = score(trial, evaluation, i, self._values, self._objective)
                self.study.tell(trial, values, skip_if_finished=True)
        with self._lock:
            self.ran = True
            self._show()

    def _wait(self) -> None:
        """Wait for the trials that others have open; give up those of processes that died."""
        with self._lock:
            fail_stale(self.study)
            self._pauses += 1
            if self._pauses == PAUSES:
                say_once("waiting for the trials that other workers have open")
        self._stop.wait(PAUSE)

    def _keep_best(self, trials: Sequence[Trial], evaluation: Evaluation) -> None:
        i = evaluation.best()
        if self.best and not evaluation.beats(i, self.best, 0):
            return
        self.best = self._problem.evaluate(evaluation.designs[i : i + 1])
        self.best_trial = trials[i].number
        if self._pictures:
            with suppress(UpdateFinishedTrialError):  # taken for dead while this process slept
                self._pictures.promise(trials[i], self.best)

    def _show(self) -> None:
        assert self.best is not None
        if self._report:
            self._report(count_finished(self.study), self.best)


@contextmanager
def interruptible(stop: threading.Event) -> Iterator[None]:
    """Have the first Ctrl-C set ``stop``, so that open trials finish; the second one interrupts."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def on_interrupt(number: int, frame: FrameType | None) -> None:
        if stop.is_set():
            signal.default_int_handler(number, frame)
        stop.set()

    before = signal.signal(signal.SIGINT, on_interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def answer(study: Study, problem: DesignProblem) -> tuple[Evaluation, int]:
    """Return the evaluation of a study's answer, one design, and the number of its trial.

    Raises:
        ValueError: if the study has no finished trial.
    """
    designs = designs_of(study, problem)
    i = problem.evaluate(designs).best()
    return problem.evaluate(designs[i : i + 1]), finished(study)[i].number
