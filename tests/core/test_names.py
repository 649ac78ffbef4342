"""How an unknown name is answered."""

from __future__ import annotations

import pytest

from pkm_gym.core.names import check_known, unknown


def test_a_known_name_passes() -> None:
    check_known("field", ["payload", "delta"], {"payload": 1, "delta": 2})


@pytest.mark.parametrize(
    ("name", "answer"),
    [
        ("paylod", "unknown field 'paylod'; did you mean 'payload'?"),
        ("zzz", "unknown field 'zzz'; known: delta, payload"),
        (3, "unknown field 3; known: delta, payload"),
    ],
)
def test_the_closest_or_all_known_names_are_offered(name: object, answer: str) -> None:
    assert unknown("field", name, ["payload", "delta"]) == answer
    with pytest.raises(ValueError, match=answer.replace("?", r"\?")):
        check_known("field", ["delta", name], ["payload", "delta"])
