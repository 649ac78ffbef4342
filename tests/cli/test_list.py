"""``pkm-gym list``: what there is, and one problem in full."""

from __future__ import annotations

from dataclasses import fields

import gymnasium
import pytest

import pkm_gym


def test_all_problems_are_listed_with_their_environments(run):
    text = run("list").stdout
    for name in pkm_gym.problems():
        problem = pkm_gym.make_problem(name)
        assert name in text
        assert all(variable.name in text for variable in problem.all_variables)
        assert all(objective.name in text for objective in problem.all_objectives)
    for env_id, spec in gymnasium.registry.items():
        if spec.namespace == "PKM":
            assert env_id in text


@pytest.mark.parametrize("name", pkm_gym.problems())
def test_one_problem_is_shown_in_full(run, name):
    problem = pkm_gym.make_problem(name)
    rows = run("list", name).stdout.splitlines()
    starts = {row.partition(" ")[0] for row in rows}
    named = [*problem.all_variables, *problem.task_variables, *problem.index_table]
    named += [*problem.all_objectives, *fields(problem.options)]
    assert starts >= {item.name for item in named}
    assert all(any(name in row for row in rows) for name in problem.constraint_names)
    words = " ".join(" ".join(rows).split())
    assert problem.reference.citation in words
    origin = "printed" if problem.reference else "default"
    assert f"Variables and the {origin} design" in words


def test_lengths_and_angles_are_shown_in_millimetres_and_degrees(run):
    rows = run("list", "diamond").stdout.splitlines()
    width = next(row.split() for row in rows if row.startswith("b "))
    assert width[1:9] == ["800.0", "mm", "400", "to", "1200", "100", "to", "2000"]
    assert next(row.split() for row in rows if row.startswith("alpha_low "))[2] == "deg"
    assert next(row.split() for row in rows if row.startswith("alpha_min "))[1] == "deg"


def test_an_unknown_mechanism_is_answered_with_the_closest_match(refused):
    assert refused("list", "diamnod") == "unknown mechanism 'diamnod'; did you mean 'diamond'?"
