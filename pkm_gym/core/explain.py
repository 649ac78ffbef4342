"""Broken limits in words: what, where in the workspace, by how much, what is allowed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pkm_gym.core.limit import Limit

if TYPE_CHECKING:
    from pkm_gym.core.evaluation import Evaluation


def sentences(evaluation: Evaluation, i: int) -> list[str]:
    """Return a sentence for each limit that design i breaks; what is undefined has none."""
    problem, task = evaluation.problem, evaluation.task(i)
    broken = evaluation.defined[i] & (evaluation.constraints[i] > 0.0)
    limits = [limit for limit, bad in zip(problem.limits, broken, strict=True) if bad]
    own = [limit for limit in limits if isinstance(limit, str)] or _nearest(evaluation, i)
    full = problem.complete(evaluation.designs[i : i + 1])[0]
    if "dimensions" in own:
        return [problem.explain_dimensions(full)]
    lines = problem.explain_own(full, task, own) if own else []
    derived = [limit for limit in limits if isinstance(limit, Limit)]
    places = _places(evaluation, i, derived)
    words = {item.name: f"the {item.doc}" for item in problem.declared.index_table}
    for limit in derived:
        name = limit.quantity
        value = float(evaluation.quantity(name)[i])
        lines.append(
            limit.sentence(
                value, task, problem.unit(name), words.get(name, name), places.get(name, "")
            )
        )
    return lines


def _nearest(evaluation: Evaluation, i: int) -> list[str]:
    """Return the own limit that a design on the edge of its reach is about to break."""
    if not evaluation.unreached[i] > 0.0:
        return []
    named = zip(evaluation.problem.limits, evaluation.constraints[i], strict=True)
    reach = {n: value for n, value in named if isinstance(n, str) and n != "dimensions"}
    return [max(reach, key=lambda name: reach[name])] if reach else []


def _places(evaluation: Evaluation, i: int, limits: list[Limit]) -> dict[str, str]:
    """Return where in the workspace the limited indices have their extremes, in words."""
    problem = evaluation.problem
    if not limits:
        return {}
    machine = problem.mechanism(evaluation.designs[i], evaluation.task(i))
    poses = machine.search_poses()
    maps = problem.index_maps(machine, poses)
    found = {}
    for name in (limit.quantity for limit in limits):
        if name in maps and np.isfinite(maps[name].values).any():
            at = maps[name].worst()
            if at is not None:
                found[name] = machine.place(poses[at])
    return found
