"""Opponents of the benchmark that search with Optuna's samplers, or with CMA-ES itself.

Any sampler competes in three lines of a module of yours; the method's name is then
"module:attribute"::

    @method()
    def brute(view, training):
        return sampler_search(lambda seed: BruteForceSampler(seed=seed))
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from inspect import getfile
from pathlib import Path
from typing import Literal

import numpy as np
from cmaes import CMA  # type: ignore[attr-defined]  # imported there without __all__
from optuna import Trial, create_study
from optuna.samplers import BaseSampler, TPESampler

from pkm_gym.benchmark.methods import Search, method
from pkm_gym.benchmark.optima import KnownOptima
from pkm_gym.benchmark.session import Session
from pkm_gym.benchmark.training import Training
from pkm_gym.benchmark.view import Told, View
from pkm_gym.core.trial import penalised
from pkm_gym.core.types import FloatArray
from pkm_gym.studies.search.samplers import check_sampler, make_sampler, values_for
from pkm_gym.studies.storage.storages import quiet

MakeSampler = Callable[[int], BaseSampler]
Values = Literal["objectives", "merit"]

ENQUEUED = 16  # neighbours' optima that TPE tries first
STARTED_AT = 16  # neighbours whose optima's mean is CMA-ES's first mean
SIGMA = 0.01  # CMA-ES's first step size there, a share of the range


def sampler_search(
    make: MakeSampler,
    *,
    values: Values = "objectives",
    first: Callable[[FloatArray], FloatArray] | None = None,
) -> Search:
    """Return the search that asks an Optuna sampler and tells it what was evaluated.

    Args:
        make: returns a new sampler of a seed.
        values: what the trials have as values: the "objectives", with named constraints beside
            them, or the "merit", for a sampler that knows no constraints.
        first: returns, for a packed task (m,), designs (n, d) to be tried first.
    """

    def search(session: Session) -> None:
        view = session.view
        seed = int(session.generator.integers(2**31))
        less = values == "merit" or view.objective.sign > 0.0
        with quiet():
            study = create_study(direction="minimize" if less else "maximize", sampler=make(seed))
            for design in first(session.task) if first else ():
                study.enqueue_trial(dict(zip(view.variable_names, design, strict=True)))
            while True:
                trial = study.ask()
                design = [trial.suggest_float(v.name, v.low, v.high) for v in view.variables]
                study.tell(trial, _value(trial, session.evaluate(np.array(design)), view, values))

    return search


def _value(trial: Trial, told: Told, view: View, values: Values) -> float:
    """Return the value of the trial of the one design; set its constraints unless that is merit."""
    if values == "merit":
        return float(np.exp(told.log_merit[0]))
    for name, value in zip(view.constraint_names, told.constraints[0], strict=True):
        trial.set_constraint(name, float(value))
    sign, worst = view.objective.sign, view.objective.worst
    width = float(told.constraints.shape[1])
    return float(penalised(told.values, told.constraints, sign, worst, width)[0])


def _optima(_name: str) -> list[Path]:
    return [Path(getfile(KnownOptima))]


@method()
def tpe(_view: View, _training: None) -> Search:
    """Search with TPE as Optuna sets it up: multivariate, constrained, 10 trials to start up."""
    return _named("tpe")


@method()
def tpe_4(_view: View, _training: None) -> Search:
    """Search with TPE with 4 trials to start up."""
    return sampler_search(lambda seed: TPESampler(seed=seed, n_startup_trials=4))


@method()
def cmaes(view: View, _training: None) -> Search:
    """Search with CMA-ES on the merit, from the centre of the box."""
    # Its first trial belongs to no generation: let it be the mean of the first one.
    centre = 0.5 * (view.low + view.high)
    return _named("cmaes", first=lambda _: centre[None])


@method()
def nsga2(_view: View, _training: None) -> Search:
    """Search with NSGA-II, constrained."""
    return _named("nsga2")


@method(evaluations=40, tasks=16)
def gp(_view: View, _training: None) -> Search:
    """Search with a Gaussian process, constrained; about a second a trial."""
    check_sampler("gp", 1)
    search = _named("gp")

    def on_one_thread(session: Session) -> None:
        with _one_thread():
            search(session)

    return on_one_thread


@method(knowledge="transfer", files=_optima)
def neighbours_tpe(view: View, training: Training) -> Search:
    """Search with TPE that is first given the optima of the nearest tasks."""
    nearest = KnownOptima(view, training).nearest
    return _named("tpe", first=lambda task: nearest(task, ENQUEUED))


@method(knowledge="transfer", files=_optima)
def neighbours_cmaes(view: View, training: Training) -> Search:
    """Search with CMA-ES on the merit, from the mean of the optima of the nearest tasks."""
    nearest = KnownOptima(view, training).nearest
    span = view.high - view.low

    def search(session: Session) -> None:
        near = (nearest(session.task, STARTED_AT) - view.low) / span
        while True:
            _descend(session, near.mean(axis=0))

    return search


def _descend(session: Session, mean: FloatArray) -> None:
    """Run CMA-ES from a point (d,) of the unit cube until it has converged."""
    view = session.view
    d = len(mean)
    bounds = np.tile([0.0, 1.0], (d, 1))
    seed = int(session.generator.integers(2**31))
    optimiser = CMA(mean=mean, sigma=SIGMA, bounds=bounds, seed=seed)
    while not optimiser.should_stop():
        points = np.array([optimiser.ask() for _ in range(optimiser.population_size)])
        designs = view.low + (view.high - view.low) * points
        told = session.evaluate(np.clip(designs, view.low, view.high))
        optimiser.tell(list(zip(points, map(float, told.log_merit), strict=True)))


def _named(name: str, first: Callable[[FloatArray], FloatArray] | None = None) -> Search:
    def make(seed: int) -> BaseSampler:
        return make_sampler(name, seed=seed)

    values: Values = "objectives" if values_for(name) == "objectives" else "merit"
    return sampler_search(make, values=values, first=first)


@contextmanager
def _one_thread() -> Iterator[None]:
    """Keep PyTorch on one thread: the matrices are small, and sums keep their order."""
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
