"""Which trials a process may evaluate, when several search the same study at once.

Nobody can lock a study, but its trials are numbered in the order in which they are opened. So a
trial is opened first, and evaluated only if it is among the first N that haven't failed: then N
finish and no more, however many processes open one at the same moment.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Self

from optuna import Study, Trial
from optuna.exceptions import UpdateFinishedTrialError
from optuna.trial import TrialState

from pkm_gym.core.types import FloatArray
from pkm_gym.studies.storage.studies import ENQUEUED, HEARTBEAT, enqueued, live, show_alive


class Claims:
    """The trials that this process has open; entered, it shows signs of life for them.

    Those that are still open at the end are told as failed.

    Args:
        study: whose trials they are.
        total: how many finished trials the study shall have.
        worker: number of this process.
    """

    def __init__(self, study: Study, total: int, worker: int) -> None:
        self._study = study
        self._total = total
        self._worker = worker
        self._open: dict[int, Trial] = {}
        self._end = threading.Event()

    def __enter__(self) -> Self:
        self._end.clear()
        threading.Thread(target=self._beat, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        for trial in [*self._open.values()]:
            with suppress(Exception):  # where the storage is what failed: the next start does it
                self._fail(trial)

    def free(self) -> int:
        """Return how many trials the study lacks that nobody has open."""
        first = live(self._study.get_trials(deepcopy=False))[: self._total]
        waiting = sum(trial.state == TrialState.WAITING for trial in first)
        return self._total - len(first) + waiting

    def claim(self, suggest: Callable[[Trial], FloatArray]) -> tuple[Trial, FloatArray] | None:
        """Open a trial and return it with its design; return None if others were faster."""
        trial = self._study.ask()
        self._open[trial._trial_id] = trial
        with suppress(UpdateFinishedTrialError):
            show_alive(self._study, trial._trial_id, self._worker)
            trials = self._study.get_trials(deepcopy=False)
            own, before = trials[trial.number], live(trials[: trial.number])
            if len(before) < self._total:
                if enqueued(own) in [enqueued(other) or other.params for other in before]:
                    trial = self._freed(trial)  # several workers have enqueued the same designs
                return trial, suggest(trial)
        with self.closing(trial):
            self._fail(trial)
        return None

    @contextmanager
    def closing(self, trial: Trial) -> Iterator[None]:
        """Bear that a trial was taken for dead while this process slept; close it."""
        with suppress(UpdateFinishedTrialError):
            yield
        del self._open[trial._trial_id]

    def _freed(self, trial: Trial) -> Trial:
        """Return a trial without the design that it was enqueued with: the sampler proposes one."""
        self._study._storage.set_trial_system_attr(trial._trial_id, ENQUEUED, {})
        return Trial(self._study, trial._trial_id)

    def _fail(self, trial: Trial) -> None:
        self._study.tell(trial, state=TrialState.FAIL, skip_if_finished=True)

    def _beat(self) -> None:
        while not self._end.wait(HEARTBEAT):
            for number in [*self._open]:
                with suppress(Exception):  # what is wrong is said where it is told
                    show_alive(self._study, number, self._worker)
