"""A slider, registered nowhere and without paper, grid or twin; Python in a new process."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
import pytest

from pkm_gym.core.declaration import Declaration, Objective
from pkm_gym.core.limit import Limit
from pkm_gym.core.mechanism import IndexMap, Link, Mechanism, dimension
from pkm_gym.core.options import Options, option
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.rows import Measured, index, own, variable
from pkm_gym.core.task import Task, quantity
from pkm_gym.core.types import FloatArray


@dataclass(frozen=True)
class SliderTask(Task):
    way: float = quantity(0.5, "m", "how far it slides", legal=(0.1, 2.0))
    size_max: float = quantity(
        4.0, "", "largest size over the way", legal=(0.5, 9.0), family=(3.0, 5.0)
    )
    slope_max: float = quantity(0.9, "rad", "steepest slope", legal=(0.0, 1.5), family=(0.7, 1.1))


@dataclass(frozen=True)
class SliderOptions(Options):
    samples: int = option(5, "poses along the way", low=2, high=100)
    full: bool = option(False, "report the mass")


class SliderDesign(NamedTuple):
    arm: Annotated[float, variable(0.2, 1.5, "m", "arm")]
    rod: Annotated[float, variable(0.2, 1.5, "m", "rod")]
    tail: Annotated[float, variable(0.1, 2.0, "m", "tail", default="rod", searched=False)]
    gap: Annotated[float, variable(0.0, 0.4, "m", "gap", default=0.1, searched=False)]


class SliderIndices(NamedTuple):
    size: Annotated[float, index("m", "size")]
    slope: Annotated[float, index("rad", "steepest slope")]
    mass: Annotated[float, index("kg", "mass", reported="full")]
    margin: Annotated[float, index("m", "margin", reported=False)]


class SliderLimits(NamedTuple):
    dimensions: Annotated[float, own("arm and rod make a machine")]
    reach: Annotated[float, own("arm and rod reach both ends of the way")]


@dataclass(frozen=True, slots=True)
class Slider(Mechanism):
    """A point that is moved along x by a screw; its slope grows with x."""

    arm: float = dimension("m", "arm")
    rod: float = dimension("m", "rod")
    way: float = dimension("m", "way")

    pose_names = ("x",)
    twist_names = ("vx",)
    joint_names = ("q",)

    def inverse_kinematics(self, pose: FloatArray) -> FloatArray:
        pose = np.asarray(pose, dtype=float)
        return np.where(np.abs(pose) <= self.arm + self.rod, pose, np.nan)

    def forward_kinematics(self, joints: FloatArray, near: FloatArray | None = None) -> FloatArray:
        del near
        return self.inverse_kinematics(joints)

    def inverse_jacobian(self, pose: FloatArray) -> FloatArray:
        return np.ones_like(self.inverse_kinematics(pose))[..., None]

    jacobian = inverse_jacobian

    def twist(self, pose: FloatArray, pose_rate: FloatArray) -> FloatArray:
        del pose
        return np.array(pose_rate)

    def search_poses(self) -> FloatArray:
        return np.linspace(0.0, self.way, 11)[:, None]

    def index_maps(self, pose: FloatArray) -> dict[str, IndexMap]:
        slopes = np.arctan(pose[..., 0] / self.rod)
        return {"slope": IndexMap("slope", "rad", "max", slopes)}

    def links(self, pose: FloatArray) -> tuple[Link, ...]:
        return (Link("platform", np.array([[pose[0], 0.0]])),)

    def workspace(self) -> FloatArray:
        return np.array([[0.0, 0.0], [self.way, 0.0], [0.0, 0.0]])

    def workspace_grid(self, columns: int, rows: int) -> FloatArray:
        return np.broadcast_to(np.linspace(0.0, self.way, columns)[:, None], (rows, columns, 1))

    def sample_poses(self) -> FloatArray:
        return np.array([[0.0], [self.way]])


OBJECTIVES = (Objective("size", "minimise"), Objective("mass", "minimise"))

SLIDER = Declaration(
    name="slider",
    title="a slider",
    problem=f"{__name__}:SliderProblem",
    task=SliderTask,
    options=SliderOptions,
    design=SliderDesign,
    indices=SliderIndices,
    limits=SliderLimits,
    constraints=(
        "dimensions",
        "reach",
        Limit("size", "upper", "size_max", times=("way", 1)),
        Limit("slope", "upper", "slope_max"),
        Limit("margin", "lower", 0.0, scale="absolute"),
        Limit("short", "upper", 1.4, of="rod"),
    ),
    objectives=OBJECTIVES,
)


class SliderProblem(DesignProblem):
    declared = SLIDER

    def _measure(self, designs: FloatArray, tasks: FloatArray, rows: Measured) -> None:
        for i, (arm, rod, tail, gap) in enumerate(designs):
            way = tasks[i % len(tasks), 0]
            bad = min(arm, rod)
            reach = way - arm - rod
            rows.own[i] = (
                1.0 if not np.isfinite(designs[i]).all() else -bad if bad > 0.0 else 1.0 - bad,
                reach,
            )
            rows.unreached[i] = max(0.0, reach)
            rows.table[i] = np.nan
            if rows.own[i, 0] <= 0.0 and reach <= 0.0:
                size = arm + rod + tail + gap
                rows.table[i] = size, np.arctan(way / rod), 2.0 * size, arm - gap

    def _mechanism(self, design: FloatArray, task: Any) -> Slider:
        return Slider(arm=float(design[0]), rod=float(design[1]), way=task.way)

    def explain_own(self, design: FloatArray, task: Any, broken: list[str]) -> list[str]:
        lack = task.way - design[0] - design[1]
        return [f"{name}: {1e3 * lack:.1f} mm are lacking" for name in broken]


@pytest.fixture
def slider() -> type[DesignProblem]:
    """The slider's problem."""
    return SliderProblem


@pytest.fixture
def said() -> Mapping[str, Any]:
    """What is declared of the slider, by argument, to be changed."""
    names = ("name", "title", "problem", "task", "options", "design", "indices", "limits",
             "constraints")  # fmt: skip
    return {name: getattr(SLIDER, name) for name in names} | {"objectives": OBJECTIVES}


@pytest.fixture
def run() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Run code with arguments and environment in a new process, which must succeed."""

    def run_code(
        code: str, *arguments: str, **environment: str
    ) -> subprocess.CompletedProcess[str]:
        done = subprocess.run(
            [sys.executable, "-c", code, *arguments],
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done

    return run_code
