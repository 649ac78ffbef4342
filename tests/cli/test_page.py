"""``pkm-gym page``: what is declared, as a page, and a page's part made anew."""

from __future__ import annotations

import pytest

import pkm_gym
from pkm_gym.mechanisms import declaration


@pytest.mark.parametrize("name", pkm_gym.problems())
def test_everything_declared_is_on_the_page(run, name):
    text = run("page", name).stdout
    said = declaration(name)
    items = [*said.variables, *said.task.variables(), *said.options.table(), *said.index_table]
    for item in [*items, *said.objectives, *said.own_limits]:
        assert f"\n| `{item.name}` |" in text
    for constraint in said.constraint_names:
        assert f"\n| `{constraint}` |" in text
    assert f"`PKM/{said.environment}Family-v0`" in text


@pytest.mark.parametrize("name", pkm_gym.problems())
def test_a_family_without_splits_is_called_so(run, refused, name):
    without = not declaration(name).splits
    assert ("has no splits" in run("page", name).stdout) == without
    assert ("splits for the benchmark: none" in run("list", name).stdout) == without
    if without:
        for verb in ("splits", "benchmark"):
            assert refused(verb, name).startswith(f"{name} declares no splits: ")


def test_a_file_is_not_written_over_unless_told(run, refused, tmp_path):
    path = tmp_path / "page.md"
    assert run("page", "diamond", "-o", path).exit_code == 0
    first = path.read_text()
    path.write_text("mine")
    assert "exists" in refused("page", "diamond", "-o", path)
    assert path.read_text() == "mine"
    assert run("page", "diamond", "-o", path, "--force").exit_code == 0
    assert path.read_text() == first


def test_only_the_part_that_was_made_is_made_anew(run, refused, tmp_path):
    path = tmp_path / "page.md"
    run("page", "spr3", "-o", path)
    made = path.read_text()
    head, _, tail = made.partition("### Task")
    path.write_text(f"before\n{head}stale\n<!-- end -->\nafter <!-- end -->\n")
    assert tail
    assert run("page", "spr3", "--into", path).exit_code == 0
    assert path.read_text() == f"before\n{made}after <!-- end -->\n"
    assert "made by pkm-gym page diamond" in refused("page", "diamond", "--into", path)
    assert "one of them" in refused("page", "spr3", "--into", path, "-o", path)


def test_an_unknown_problem_is_refused_with_the_closest(refused):
    assert "did you mean 'diamond'" in refused("page", "diamnd")
