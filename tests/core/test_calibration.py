"""The calibration of a problem: read where there is one, refused where it is broken."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pkm_gym.core.calibration import PENALTY_WEIGHT, SCALE, WORST, calibration
from pkm_gym.core.declaration import Declaration, Objective

GOOD = """
[slider]
penalty_weight = 7
[slider.objectives.size]
worst = 12.5
scale = 1.5
powers = { way = 1 }
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: Any) -> Any:
    """A function that writes a package with a calibration; it returns the package's name."""

    def made(content: str) -> str:
        name = f"calibrated_{abs(hash(request.node.name))}"
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").touch()
        (tmp_path / name / "calibration.toml").write_text(content, encoding="utf-8")
        monkeypatch.syspath_prepend(str(tmp_path))
        return name

    return made


def test_a_calibration_fills_in_what_is_not_declared(package: Any, said: dict[str, Any]) -> None:
    name = package(GOOD)
    made = Declaration(**{**said, "problem": f"{name}.problem:Slider"})
    size, mass = made.objectives
    assert (made.penalty_weight, size.worst, size.scale) == (7.0, 12.5, 1.5)
    assert dict(size.powers) == {"way": 1}
    assert (mass.worst, mass.scale, dict(mass.powers)) == (WORST, SCALE, {})
    own = Declaration(
        **{
            **said,
            "problem": f"{name}.problem:Slider",
            "penalty_weight": 3.0,
            "objectives": (Objective("size", "minimise", worst=9.0),),
        }
    )
    assert (own.penalty_weight, own.objectives[0].worst, own.objectives[0].scale) == (3.0, 9.0, 1.5)


def test_without_one_nothing_is_said(package: Any, said: dict[str, Any]) -> None:
    for name in ("", "no_such_package", "pkm_gym.core", package("")):
        assert calibration(name, "slider") == {}
    assert Declaration(**said).penalty_weight == PENALTY_WEIGHT


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("[slider", "is no calibration: it is no TOML, see its end; make it again"),
        ("slider = 1 = 2", "is no calibration: it is no TOML, see line 1, column 12; make it"),
        (
            "[slider]\npenalty_weight = nan",
            "is no calibration: slider.penalty_weight is nan: it must be a finite",
        ),
        (
            "[slider]\npenalty_weight = 'much'",
            "is no calibration: slider.penalty_weight is 'much': it must be a finite",
        ),
        (
            "[slider.objectives.size]\nworst = inf",
            "is no calibration: slider.objectives.size.worst is inf: it must be a finite",
        ),
        (
            "[slider.objectives.size]\nscale = -inf",
            "is no calibration: slider.objectives.size.scale is -inf: it must be a finite",
        ),
        (
            "[slider.objectives.size]\nscale = [1.0]",
            r"is no calibration: slider.objectives.size.scale is \[1.0\]: it must be a finite",
        ),
    ],
)
def test_a_broken_file_is_refused_by_name(package: Any, content: str, sentence: str) -> None:
    name = package(content)
    with pytest.raises(ValueError, match=rf"{name}.calibration\.toml'? {sentence}") as refused:
        calibration(name, "slider")
    assert str(refused.value).endswith("make it again with `pkm-gym calibrate slider`")
    assert "\n" not in str(refused.value)
