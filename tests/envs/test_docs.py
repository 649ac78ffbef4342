"""The pages of the environments: their tables are right."""

from __future__ import annotations

from pathlib import Path

import pytest

PAGES = Path(__file__).parents[2] / "docs" / "environments"


def test_page_states_ids_spaces_and_layout(env_id, make):
    env = make(env_id)
    room, _, mechanism = env.problem.declared.package.rpartition(".")
    if room != "pkm_gym.mechanisms":
        pytest.skip("its page is elsewhere")
    text = (PAGES / f"{mechanism}.md").read_text()
    size, moves = env.observation_space.shape[0], env.action_space.shape[0]
    assert f"`{env_id}`" in text
    assert f"`Box(-1, 1, ({size},), float32)`" in text
    assert f"`Box(-1, 1, ({moves},), float32)`" in text
    for name, part in env.observation_layout.items():
        assert f"| `{name}` | {part.start}:{part.stop} |" in text
    for field in env.problem.task_variables:
        assert f"`{field.name}`" in text


def test_class_docstring_is_the_page_of_the_environment(env_id, make):
    env = make(env_id)
    text = type(env).__doc__
    for title in (
        "Description",
        "Action Space",
        "Observation Space",
        "Rewards",
        "Starting State",
        "Episode End",
        "Arguments",
        "Version History",
        "References",
    ):
        assert f"    ## {title}\n" in text
    for name in env.observation_layout:
        assert f"    | {name} |" in text
