"""What is said of the five-bar's design problem: task, variables, indices, limits, objectives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

from pkm_gym.core.declaration import Declaration, Objective
from pkm_gym.core.limit import Limit
from pkm_gym.core.options import Options, option
from pkm_gym.core.reach import REACH, ReachLimits
from pkm_gym.core.rows import index, record, undefined, variable
from pkm_gym.core.task import Task, quantity


@dataclass(frozen=True)
class FiveBarTask(Task):
    """Where the tool must go, and what the machine may be."""

    width: float = quantity(
        0.3, "m", "width of the workspace", legal=(0.05, 1.0), family=(0.2, 0.4)
    )
    height: float = quantity(
        0.15, "m", "height of the workspace", legal=(0.02, 0.6), family=(0.1, 0.2)
    )
    top: float = quantity(
        0.25, "m", "from the drives down to the workspace", legal=(0.05, 1.0), family=(0.2, 0.3)
    )
    size_max: float = quantity(
        0.75, "m", "largest l1 + l2 + e", legal=(0.2, 4.0), family=(0.7, 1.0)
    )
    e_min: float = quantity(
        0.03, "m", "smallest e, for the motors", legal=(0.005, 0.2), family=(0.02, 0.06)
    )
    alpha_low: float = quantity(
        0.5, "rad", "smallest transmission angle between the rods",
        legal=(0.0, 1.2), family=(0.35, 0.6),
    )  # fmt: skip
    beta_low: float = quantity(
        0.5, "rad", "smallest transmission angle at the elbows",
        legal=(0.0, 1.2), family=(0.35, 0.6),
    )  # fmt: skip


@dataclass(frozen=True)
class FiveBarOptions(Options):
    """Options of the five-bar."""

    nodes: int = option(8, "nodes in either direction on half the workspace", low=3, high=200)


class Design(NamedTuple):
    """The lengths of the links."""

    l1: Annotated[float, variable(0.1, 0.5, "m", "arm, from drive to elbow", step=0.02)]
    l2: Annotated[float, variable(0.15, 0.7, "m", "rod, from elbow to tool", step=0.02)]
    e: Annotated[float, variable(0.01, 0.3, "m", "half the drives' distance", step=0.02)]


class Indices(NamedTuple):
    """What is measured over the workspace."""

    gci: Annotated[float, index("", "mean of the local conditioning 1 / condition number of J")]
    rate: Annotated[float, index("1/m", "largest arm rate (rad/s) at a tool's speed of 1 m/s")]
    size: Annotated[float, index("m", "l1 + l2 + e")]
    alpha_min: Annotated[float, index("rad", "smallest transmission angle between the rods")]
    beta_min: Annotated[float, index("rad", "smallest transmission angle at the elbows")]
    sin_alpha: Annotated[float, index("", "smallest sin alpha", reported=False)]


FIVE_BAR = Declaration(
    name="five_bar",
    title="planar five-bar for a rectangle under its drives",
    problem="five_bar.problem:FiveBarProblem",
    task=FiveBarTask,
    options=FiveBarOptions,
    design=Design,
    indices=Indices,
    limits=ReachLimits,
    constraints=(
        *REACH,
        Limit("assembly", "lower", 0.0, of="sin_alpha"),
        Limit("size", "upper", "size_max"),
        Limit("spacing", "lower", "e_min", of="e", words="half the drives' distance e"),
        Limit("alpha", "lower", "alpha_low", of="alpha_min"),
        Limit("beta", "lower", "beta_low", of="beta_min"),
    ),
    objectives=(Objective("gci", "maximise"), Objective("rate", "minimise")),
    motion={},
)

TASK, DESIGN = record(FiveBarTask), record(Design)
UNDEFINED = undefined(Indices)
