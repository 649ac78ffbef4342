"""The front of several objectives that studies have found, and its hypervolume."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from optuna import Study
from optuna._hypervolume import compute_hypervolume
from optuna.storages import BaseStorage

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.names import check_known
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.scalar import non_dominated
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms import called
from pkm_gym.studies.report.rows import Row
from pkm_gym.studies.search.polish import verified_optimum
from pkm_gym.studies.storage.storages import open_storage, study_names
from pkm_gym.studies.storage.studies import (
    count_finished,
    designs_of,
    finished,
    load_study,
    stands_for,
)

REFERENCE = "reference_point"  # the user attribute of a study that holds it: objective -> SI value
BEYOND = 0.1  # of what an objective varies by among the optima: how far beyond them it is
SAME = 1e-6  # of a variable's range, within which two designs are one


@dataclass(frozen=True, eq=False)
class Front:
    """What studies of one problem have found of its front.

    Attributes:
        found: the distinct designs of the front, in the order of the first objective.
        trials: for each of them the study that found it first, and its trial.
        feasible: losses (m, k) of all feasible designs: objectives, negative where maximised.
        finished: how many trials were looked at.
        optima: objective -> the verified optimum of it alone, None where nothing is feasible.
        reference: objective -> value in SI, from which the hypervolume is measured.
    """

    found: Evaluation
    trials: list[tuple[str, int]]
    feasible: FloatArray
    finished: int
    optima: Mapping[str, Row | None]
    reference: Mapping[str, float]

    @property
    def problem(self) -> DesignProblem:
        """Whose front it is."""
        return self.found.problem

    @property
    def losses(self) -> FloatArray:
        """Array (n, k): the objectives of the front, negative where they are maximised."""
        return losses_of(self.found)

    @property
    def hypervolume(self) -> float:
        """What the front dominates of the space before the reference, in the objectives' units."""
        return hypervolume(self.losses, self._limit)

    @property
    def share(self) -> float:
        """The hypervolume over that of a design as good as each optimum; NaN where one is missing.

        Below 1 where the objectives compete; no front reaches it then.
        """
        rows = [self.optima[o.name] for o in self.problem.objectives]
        values = [np.nan if row is None or row.value is None else row.value for row in rows]
        ideal = signs_of(self.problem) * np.array(values)
        return self.hypervolume / float(np.prod(self._limit - ideal))

    @property
    def _limit(self) -> FloatArray:
        values = [self.reference[objective.name] for objective in self.problem.objectives]
        return signs_of(self.problem) * np.array(values)


def signs_of(problem: DesignProblem) -> FloatArray:
    """Return the objectives' signs (k,): +1 where less is better."""
    return np.array([objective.sign for objective in problem.objectives])


def losses_of(evaluation: Evaluation) -> FloatArray:
    """Return objectives (n, k), negative where they are maximised: less is better."""
    return evaluation.objectives * signs_of(evaluation.problem)


def hypervolume(losses: FloatArray, reference: FloatArray) -> float:
    """Return the volume that losses (n, k) dominate before a reference point (k,), by Optuna."""
    inside = losses[(losses < reference).all(axis=1)]
    return float(compute_hypervolume(inside, reference)) if len(inside) else 0.0


def front(
    problem: DesignProblem,
    where: str,
    *,
    name: str | None = None,
    reference: Mapping[str, float] | None = None,
) -> Front:
    """Gather the front of a problem's objectives from the studies of a storage.

    Args:
        problem: with two objectives or more, its task and options.
        where: a journal file or a database URL.
        name: of one study; all those of just this problem and these objectives if not given.
        reference: objective -> value, kept with the studies in place of the one they have. If they
            have none, it lies a tenth beyond the worst that the objectives' own optima have.

    Raises:
        ValueError: in one sentence, where there is no such study, nothing feasible in it, or a
            reference that names other objectives.
    """
    names = [objective.name for objective in problem.objectives]
    if len(names) < 2:
        raise ValueError(_one_objective(problem))
    storage = open_storage(where, create=False)
    studies = _studies(problem, storage, name)
    evaluations = [problem.evaluate(designs_of(study, problem)) for study in studies]
    trials = [(study.study_name, trial.number) for study in studies for trial in finished(study)]
    whole = Evaluation.joined(evaluations)
    losses = losses_of(whole)
    usable = np.flatnonzero(whole.feasible & np.isfinite(losses).all(axis=1))
    if not len(usable):
        raise ValueError(
            f"none of the {len(trials)} trials of {problem.name} is feasible: search with more "
            "--trials, or a --warm-start"
        )
    rows = usable[non_dominated(losses[usable])]
    rows = rows[_distinct(problem, whole.designs[rows])]
    rows = rows[np.argsort(whole.objectives[rows, 0], kind="stable")]
    optima = {one: verified_optimum(problem.with_objectives(one)) for one in names}
    point = _reference(problem, studies, optima, losses[usable], reference)
    return Front(
        problem.evaluate(whole.designs[rows]),
        [trials[i] for i in rows],
        losses[usable],
        len(trials),
        optima,
        point,
    )


def objectives_searched(kind: type[DesignProblem], where: str) -> list[str]:
    """Return the objectives of the one set of several that a storage's studies search.

    Raises:
        ValueError: in one sentence, where there is none, or more than one.
    """
    storage = open_storage(where, create=False)
    found: dict[frozenset[str], list[str]] = {}
    for study in (load_study(storage, name) for name in study_names(storage)):
        names = _objectives(study)
        if study.user_attrs.get("problem") == kind.name and len(names) > 1:
            found.setdefault(frozenset(names), names)
    if len(found) == 1:
        return next(iter(found.values()))
    if not found:
        raise ValueError(_no_study(kind.name, [o.name for o in kind.all_objectives]))
    sets = "; ".join(" and ".join(names) for names in found.values())
    raise ValueError(f"the studies of {kind.name} search {sets}: choose with --objective")


def _one_objective(problem: DesignProblem) -> str:
    known = [objective.name for objective in problem.all_objectives]
    if len(known) < 2:
        return f"{problem.name} has one objective, {known[0]}: a front needs two or more"
    return f"a front needs two objectives or more: {problem.name} has {', '.join(known)}"


def _no_study(problem: str, objectives: Sequence[str]) -> str:
    words = " ".join(f"--objective {name}" for name in objectives[:2])
    return f"no study has searched several objectives: `pkm-gym search {problem} {words}` does"


def _objectives(study: Study) -> list[str]:
    """Return the names of a study's objectives, as its note says, without their units."""
    return [text.partition(" [")[0] for text in study.user_attrs.get("objectives", ())]


def _studies(problem: DesignProblem, storage: BaseStorage, name: str | None) -> list[Study]:
    """Return the studies, with finished trials, of just this problem and its objectives."""
    names = [objective.name for objective in problem.objectives]
    chosen = []
    for one in [name] if name else study_names(storage):
        study = load_study(storage, one)
        kept = _objectives(study)
        same = set(kept) == set(names) and stands_for(study, problem.with_objectives(*kept))
        if same and count_finished(study):
            chosen.append(study)
        elif name:
            words = " and ".join(kept) or "nothing of ours"
            raise ValueError(
                f"the study {name!r} searches {words}, not {' and '.join(names)} of this task, or "
                "has no finished trial"
            )
    if not chosen:
        raise ValueError(_no_study(called(problem), names))
    return chosen


def _distinct(problem: DesignProblem, designs: FloatArray) -> list[int]:
    """Return the first rows (sorted) of those designs (n, d) that are the same."""
    places = np.round((designs - problem.low) / (problem.high - problem.low) / SAME)
    return sorted(np.unique(places, axis=0, return_index=True)[1].tolist())


def _reference(
    problem: DesignProblem,
    studies: Sequence[Study],
    optima: Mapping[str, Row | None],
    feasible: FloatArray,
    given: Mapping[str, float] | None,
) -> dict[str, float]:
    """Return the reference point: the given one, the one that is kept, or that of the optima."""
    names = [objective.name for objective in problem.objectives]
    kept: Any = next((s.user_attrs[REFERENCE] for s in studies if REFERENCE in s.user_attrs), None)
    if given:
        check_known("objective", given, names)
        if missing := [name for name in names if name not in given]:
            raise ValueError(f"the reference point lacks {', '.join(missing)}")
        kept = {name: float(given[name]) for name in names}
    elif kept is None:
        kept = dict(zip(names, _beyond(problem, optima, feasible).tolist(), strict=True))
    for study in studies:
        if study.user_attrs.get(REFERENCE) != kept:
            study.set_user_attr(REFERENCE, kept)
    return {name: float(kept[name]) for name in names}


def _beyond(
    problem: DesignProblem, optima: Mapping[str, Row | None], feasible: FloatArray
) -> FloatArray:
    """Return the point (k,) a tenth beyond the worst that the optima have of each objective.

    Where they agree in one, a tenth of its value beyond it; without optima, of what is feasible.
    """
    rows = [row for row in optima.values() if row is not None]
    losses = feasible
    if rows:
        designs = np.array([problem.design(row.design) for row in rows])
        losses = losses_of(problem.evaluate(designs))
    worst, width = losses.max(axis=0), np.ptp(losses, axis=0)
    width = np.where(width > SAME * abs(worst), width, np.where(worst == 0.0, 1.0, abs(worst)))
    return (worst + BEYOND * width) * signs_of(problem)
