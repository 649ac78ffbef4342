"""The studies of one problem in a storage."""

from __future__ import annotations

import json
import time
import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict
from datetime import datetime, timedelta
from importlib.metadata import version
from typing import Any, Literal

import numpy as np
import optuna
from optuna import Study
from optuna.exceptions import UpdateFinishedTrialError
from optuna.storages import BaseStorage
from optuna.trial import FrozenTrial, TrialState

from pkm_gym.core.names import unknown
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.core.units import converted, show, span
from pkm_gym.studies import create_study
from pkm_gym.studies.buildable.robust import words_of
from pkm_gym.studies.storage.storages import study_names

LIBRARIES = ("pkm_gym", "optuna", "numpy", "numba")

# A process shows signs of life for the trials that it has open. Without one for so long it is taken
# for dead; trials of others, which show none, may take longer.
HEARTBEAT, SILENCE = 10.0, 30.0  # seconds
STALE = timedelta(minutes=10)

SIGN = "alive"  # the last sign: number of the process, seconds since 1970
ENQUEUED = "fixed_params"  # Optuna's name for the design of a trial that was enqueued

LIVE = (TrialState.COMPLETE, TrialState.RUNNING, TrialState.WAITING)

# What the values of a study's trials are.
Values = Literal["objectives", "penalised"]


def load_study(storage: BaseStorage, name: str) -> Study:
    """Load a study that must exist.

    Raises:
        ValueError: with the closest match, if there is none of that name.
    """
    names = study_names(storage)
    if not names:
        raise ValueError(f"there is no study {name!r}: the storage is empty")
    if name not in names:
        raise ValueError(unknown("study", name, names))
    return optuna.load_study(study_name=name, storage=storage)


def open_study(
    problem: DesignProblem,
    storage: BaseStorage,
    name: str,
    *,
    values: Values = "objectives",
    command: str = "",
) -> Study:
    """Make a study of a problem and its task, or open it.

    Args:
        problem: what is searched, with its task.
        storage: where the study lives.
        name: of the study.
        values: what its trials' values are.
        command: kept with a new study.

    Raises:
        ValueError: in one sentence, if the study stands for another problem, task or kind of
            values.
    """
    study = create_study(problem, study_name=name, storage=storage, load_if_exists=True)
    identity = _identity(problem, values)
    kept = study.user_attrs
    if "hash" not in kept and not count_finished(study):
        for key, value in ({"command": command, "versions": _versions()} | identity).items():
            study.set_user_attr(key, value)
        _name_metrics(study, problem)
        return study
    _check_identity(name, kept, identity, problem)
    return study


def _identity(problem: DesignProblem, values: Values) -> dict[str, Any]:
    """Return what must agree for two runs to share a study; the hash, last, completes it."""
    return {
        "problem": problem.name,
        "objectives": [f"{o.name} [{o.unit}]" if o.unit else o.name for o in problem.objectives],
        "variables": {v.name: [v.low, v.high] for v in problem.variables},
        "fixed": dict(problem.fixed),
        "options": {k: x for k, x in _plain(problem.options).items() if x is not None},
        "task": _plain(problem.task),
        "values": values,
        "robust": words_of(problem),
        "hash": problem.hash(),
    }


def _plain(record: Any) -> dict[str, Any]:
    """Return a dataclass as what JSON gives back."""
    plain: dict[str, Any] = json.loads(json.dumps(asdict(record)))
    return plain


def _check_identity(
    name: str, kept: dict[str, Any], wanted: dict[str, Any], problem: DesignProblem
) -> None:
    if "hash" not in kept:
        raise ValueError(f"the study {name!r} was not made by pkm_gym: choose another --name")
    of_task = {v.name: v.unit for v in problem.task_variables}
    of_design = {v.name: v.unit for v in problem.all_variables}
    units = {"task": of_task, "variables": of_design, "fixed": of_design}
    for key, value in wanted.items():
        if kept.get(key) != value:
            what = "its version"
            if key != "hash":
                what = _difference(kept.get(key), value, units.get(key, {}))
            raise ValueError(
                f"the study {name!r} stands for another problem ({key}: {what}): choose another "
                "--name"
            )


def _difference(kept: Any, wanted: Any, units: Mapping[str, str]) -> str:
    """Say how two recorded values differ: of mappings, only the entries that do, with units."""
    if not (isinstance(kept, dict) and isinstance(wanted, dict)):
        return f"{kept or 'none'} there, {wanted or 'none'} here"
    names = [n for n in {**kept, **wanted} if kept.get(n) != wanted.get(n)]
    return "; ".join(
        f"{name} = {_read(kept.get(name), units.get(name, ''))} there, "
        f"{_read(wanted.get(name), units.get(name, ''))} here"
        for name in names
    )


def _read(value: Any, unit: str) -> str:
    """Return a recorded value as people read it: a number, a range, or whatever it is."""
    if value is None:
        return "none"
    if isinstance(value, list) and len(value) == 2:
        return f"{span(value[0], value[1], unit)} {converted(0.0, unit)[1]}".rstrip()
    return show(value, unit) if isinstance(value, float) else str(value)


def _versions() -> dict[str, str]:
    return {library: version(library) for library in LIBRARIES}


def stands_for(study: Study, problem: DesignProblem) -> bool:
    """Whether a study searches just this problem and task."""
    kept = study.user_attrs
    return bool(kept.get("hash") == problem.hash() and kept.get("task") == _plain(problem.task))


def version_note(study: Study) -> str:
    """Say which libraries have changed since the study was made, or nothing."""
    kept = study.user_attrs.get("versions", {})
    changed = [
        f"{library} {kept[library]} then, {now} now"
        for library, now in _versions().items()
        if kept.get(library, now) != now
    ]
    return f"the study was made with other versions: {'; '.join(changed)}" if changed else ""


def _name_metrics(study: Study, problem: DesignProblem) -> None:
    names = [objective.name for objective in problem.objectives]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        study.set_metric_names(names)


def finished(study: Study) -> list[FrozenTrial]:
    """Return the trials that have values."""
    return study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))


def count_finished(study: Study) -> int:
    """Return how many trials have values."""
    return len(finished(study))


def live(trials: list[FrozenTrial]) -> list[FrozenTrial]:
    """Return the trials that have values or may still get them."""
    return [trial for trial in trials if trial.state in LIVE]


def enqueued(trial: FrozenTrial) -> dict[str, float] | None:
    """Return the design that a trial was enqueued with, by name, or None."""
    design: dict[str, float] | None = trial.system_attrs.get(ENQUEUED)
    return design


def show_alive(study: Study, trial_id: int, worker: int) -> None:
    """Show that a process is working on a trial."""
    study._storage.set_trial_system_attr(trial_id, SIGN, [worker, time.time()])


def fail_stale(study: Study, beginner: int | None = None) -> None:
    """Tell as failed what dead processes have left running; designs that were enqueued wait again.

    Args:
        study: whose trials they are.
        beginner: number of a process that begins: an earlier one of that number is dead.
    """
    for trial in study.get_trials(deepcopy=False, states=(TrialState.RUNNING,)):
        if _is_dead(trial, beginner):
            with suppress(UpdateFinishedTrialError):  # another process was faster
                study._storage.set_trial_state_values(trial._trial_id, TrialState.FAIL)
                if design := enqueued(trial):
                    study.enqueue_trial(design)


def _is_dead(trial: FrozenTrial, beginner: int | None) -> bool:
    if SIGN not in trial.system_attrs:  # somebody else's, or just opened: it has no design yet
        patience = STALE if trial.params else timedelta(seconds=SILENCE)
        return datetime.now() - (trial.datetime_start or datetime.now()) > patience
    worker, at = trial.system_attrs[SIGN]
    return worker == beginner or time.time() - at > SILENCE


def designs_of(study: Study, problem: DesignProblem) -> FloatArray:
    """Return the designs (n, d) of a study's finished trials.

    Raises:
        ValueError: if the study is empty, or its trials lack a variable of the problem.
    """
    trials = finished(study)
    if not trials:
        raise ValueError(f"the study {study.study_name!r} has no finished trial")
    missing = [n for n in problem.variable_names if any(n not in t.params for t in trials)]
    if missing:
        raise ValueError(f"the study {study.study_name!r} has no {', '.join(missing)}")
    return np.array([[t.params[n] for n in problem.variable_names] for t in trials])
