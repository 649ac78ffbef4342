"""Optuna's samplers by name, seeded so that a resumed study repeats nothing."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
from optuna import Trial, samplers
from optuna.exceptions import ExperimentalWarning
from optuna.samplers import BaseSampler

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.names import check_known, imported
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.trial import TrialObjective, record, trial_attributes
from pkm_gym.studies.storage.studies import Values

MAKERS: dict[str, Callable[[int], BaseSampler]] = {
    "tpe": lambda seed: samplers.TPESampler(seed=seed),
    "cmaes": lambda seed: samplers.CmaEsSampler(seed=seed, warn_independent_sampling=False),
    "gp": lambda seed: samplers.GPSampler(seed=seed, deterministic_objective=True),
    "nsga2": lambda seed: samplers.NSGAIISampler(seed=seed),
    "nsga3": lambda seed: samplers.NSGAIIISampler(seed=seed),
    "qmc": lambda seed: samplers.QMCSampler(
        seed=seed, scramble=True, warn_independent_sampling=False
    ),
    "random": lambda seed: samplers.RandomSampler(seed=seed),
}

# Samplers of a higher room, imported when asked for: name -> a function of problem and seed.
HIGHER = {"designer": "pkm_gym.agents.designers.sampler:search_sampler"}

SAMPLERS = (*MAKERS, *HIGHER)


def check_sampler(name: str, objectives: int) -> None:
    """Refuse a sampler that is unknown, not installed, or made for one objective only.

    Raises:
        ValueError: in one sentence.
    """
    check_known("sampler", [name], SAMPLERS)
    if name in ("cmaes", "designer") and objectives > 1:
        raise ValueError(f"{name} searches one objective: use tpe, nsga2 or nsga3 for several")
    if name == "gp" and find_spec("torch") is None:
        raise ValueError("the sampler gp needs torch: pip install 'pkm_gym[agents]'")


def make_sampler(name: str, *, seed: int, start: int = 0, worker: int = 0) -> BaseSampler:
    """Return a sampler whose random numbers no other run of the study uses.

    Args:
        name: one of ``MAKERS``.
        seed: of the whole study.
        start: how many trials the study has when the sampler starts.
        worker: number of this process among those that share the study.
    """
    # The study itself counts how far its Sobol sequence has got, so that one goes on.
    key = (seed, worker) if name == "qmc" else (seed, worker, start)
    own_seed = int(np.random.SeedSequence(key).generate_state(1)[0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExperimentalWarning)
        return MAKERS[name](own_seed)


def sampler_for(
    problem: DesignProblem, name: str, *, seed: int, start: int = 0, worker: int = 0
) -> BaseSampler:
    """Return what ``make_sampler`` returns, or a sampler that knows the problem.

    Raises:
        ValueError: if nothing was trained for the problem.
    """
    if name not in HIGHER:
        return make_sampler(name, seed=seed, start=start, worker=worker)
    sampler: BaseSampler = imported(HIGHER[name])(problem, seed)
    return sampler


def values_for(sampler: str) -> Values:
    """Return what a sampler's trials have as values.

    CMA-ES ranks designs without looking at constraints, so they are penalised in its values.
    """
    return "penalised" if sampler == "cmaes" else "objectives"


def score(
    trial: Trial, evaluation: Evaluation, i: int, values: Values, objective: TrialObjective
) -> list[float]:
    """Return the values of the trial of design i; set its constraints and attributes."""
    if values == "objectives":
        record(trial, evaluation, i)
        return [float(value) for value in objective.values(evaluation)[i]]
    for name, value in trial_attributes(evaluation, i).items():
        trial.set_user_attr(name, value)
    trial.set_user_attr("constraints", constraints_of(evaluation, i))
    return [float(objective.descended(evaluation)[i])]


def constraints_of(evaluation: Evaluation, i: int) -> dict[str, Any]:
    """Return the constraints of design i by name, feasible when <= 0."""
    names = evaluation.problem.constraint_names
    return dict(zip(names, map(float, evaluation.constraints[i]), strict=True))
