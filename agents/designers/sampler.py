"""DesignerSampler: a trained designer as a sampler of any Optuna study of its problem."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from optuna import Study
from optuna.distributions import BaseDistribution, FloatDistribution
from optuna.samplers import BaseSampler, TPESampler
from optuna.trial import FrozenTrial, TrialState

from pkm_gym.agents.designers.designer import Designer
from pkm_gym.agents.designers.library import designer_for, load_designer
from pkm_gym.agents.designers.memory import Memory
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.task import TaskLike, shown_differences
from pkm_gym.core.trial import told_objective
from pkm_gym.core.types import FloatArray

PROPOSED = "pkm_gym:proposed"  # attribute of the trials that a designer proposed
ONLY = np.arange(1)


class DesignerSampler(BaseSampler):
    """Proposes what a trained designer would evaluate next, as long as its budget lasts.

    The session is read from the study's trials each time, so that a study goes on in mid-session
    after an interruption. Trials that something else proposed, such as enqueued ones, don't belong
    to it. It proposes one design after the other: not made for several jobs at a time.

    Args:
        designer: a loaded designer, or what ``load_designer`` takes.
        task: what is designed for: a Task or a mapping of the fields that differ from the paper's.
        then: samples when the budget is spent; TPE by default.
        seed: of TPE.
    """

    def __init__(
        self,
        designer: Designer | str,
        task: TaskLike = None,
        *,
        then: BaseSampler | None = None,
        seed: int | None = None,
    ) -> None:
        self.designer = load_designer(designer) if isinstance(designer, str) else designer
        self.problem = self.designer.problem
        self.task = self.problem.task_type.of(task)
        self.then = then or TPESampler(seed=seed)

    def reseed_rng(self) -> None:
        """Reseed what samples when the budget is spent."""
        self.then.reseed_rng()

    def infer_relative_search_space(
        self, study: Study, trial: FrozenTrial
    ) -> dict[str, BaseDistribution]:
        """Return the problem's variables, or what the next sampler infers.

        Raises:
            ValueError: for a study of another problem, task or objective.
        """
        self._check(study)
        if self.session(study).left[0]:
            return {v.name: FloatDistribution(v.low, v.high) for v in self.problem.variables}
        return self.then.infer_relative_search_space(study, trial)

    def sample_relative(
        self, study: Study, trial: FrozenTrial, search_space: dict[str, BaseDistribution]
    ) -> dict[str, Any]:
        """Return the designer's next design, or what the next sampler samples."""
        session = self.session(study)
        if not session.left[0]:
            return self.then.sample_relative(study, trial, search_space)
        study._storage.set_trial_system_attr(trial._trial_id, PROPOSED, int(session.evaluations[0]))
        return dict(zip(self.problem.variable_names, _floats(self.designer.propose(session)[0]),
                        strict=True))  # fmt: skip

    def sample_independent(
        self,
        study: Study,
        trial: FrozenTrial,
        param_name: str,
        param_distribution: BaseDistribution,
    ) -> Any:
        """Return what the next sampler samples."""
        return self.then.sample_independent(study, trial, param_name, param_distribution)

    def before_trial(self, study: Study, trial: FrozenTrial) -> None:
        """Tell the next sampler."""
        self.then.before_trial(study, trial)

    def after_trial(
        self,
        study: Study,
        trial: FrozenTrial,
        state: TrialState,
        values: Sequence[float] | None,
    ) -> None:
        """Tell the next sampler."""
        self.then.after_trial(study, trial, state, values)

    def session(self, study: Study) -> Memory:
        """Return the session that the study's finished trials make."""
        session = self.designer.open(self.task.pack()[None])
        for trial in study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,)):
            if PROPOSED in trial.system_attrs and session.left[0]:
                design = np.array([[trial.params[name] for name in self.problem.variable_names]])
                session.record(ONLY, self._told(trial, design))
        return session

    def _told(self, trial: FrozenTrial, design: FloatArray) -> Evaluation:
        """Return what the trial says of its design; evaluate it if that isn't enough."""
        attributes = trial.user_attrs
        constraints = attributes.get("constraints") or trial.constraints
        value = told_objective(attributes, self.problem.objectives[0])
        known = "log_merit" in attributes and value is not None
        if not known or set(constraints) != set(self.problem.constraint_names):
            return self.problem.evaluate(design, self.task)
        return Evaluation.remembered(
            self.problem,
            design,
            self.task.pack(),
            np.array([value]),
            np.array([[constraints[name] for name in self.problem.constraint_names]]),
            np.array([attributes["log_merit"]]),
        )

    def _check(self, study: Study) -> None:
        """Refuse a study of something else.

        Raises:
            ValueError: in one sentence.
        """
        kept: Mapping[str, Any] = study.user_attrs
        if kept.get("hash", self.problem.hash()) != self.problem.hash():
            raise ValueError(
                f"the study {study.study_name!r} is not of the {self.problem.name} that the "
                "designer was trained for"
            )
        task = self.problem.task_type.of(kept.get("task"))
        if "task" in kept and task != self.task:
            raise ValueError(
                f"the study {study.study_name!r} is of another task than the sampler: "
                f"{shown_differences(task, self.task)}"
            )
        names = set(self.problem.variable_names)
        for trial in study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))[:1]:
            if set(trial.params) != names:
                raise ValueError(
                    f"the study {study.study_name!r} searches {', '.join(trial.params)}, not "
                    f"{', '.join(names)}"
                )


def search_sampler(problem: DesignProblem, seed: int) -> DesignerSampler:
    """Return the sampler "designer" of ``pkm-gym search``.

    Raises:
        ValueError: if no designer was trained for the problem.
    """
    return DesignerSampler(designer_for(problem), problem.task, seed=seed)


def proposals(problem: DesignProblem, n: int) -> FloatArray:
    """Return the designs (n, d) that the problem's designer evaluates first on its task.

    Raises:
        ValueError: if no designer was trained for it, or for an n beyond its budget.
    """
    return designer_for(problem).design(problem.task, n).designs[0]


def _floats(design: FloatArray) -> list[float]:
    return [float(value) for value in design]
