"""What is said of the Diamond's design problem: task, variables, indices, limits, objectives."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

from pkm_gym.core.declaration import Declaration, Objective
from pkm_gym.core.limit import Limit
from pkm_gym.core.options import option
from pkm_gym.core.product import Product
from pkm_gym.core.reach import REACH, ReachLimits
from pkm_gym.core.rows import index, record, undefined, variable
from pkm_gym.core.task import Task, quantity
from pkm_gym.mechanisms.diamond.masses import MassOptions


@dataclass(frozen=True)
class DiamondTask(Task):
    """What the Diamond must do; the defaults are the paper's task."""

    b: float = quantity(0.8, "m", "width of the workspace", legal=(0.1, 2.0), family=(0.4, 1.2))
    h_ratio: float = quantity(
        0.15, "", "height over width of the workspace", legal=(0.1, 0.4), family=(0.15, 0.2)
    )
    delta: float = quantity(1.0, "", "b / (2 (e + l1))", legal=(0.5, 2.0))
    payload: float = quantity(0.0, "kg", "carried mass", legal=(0.0, 10.0), family=(0.0, 2.0))
    sigma_low: float = quantity(
        0.6, "", "lower bound of sigma_min", legal=(0.2, 1.2), family=(0.6, 0.81)
    )
    sigma_high: float = quantity(
        1.5, "", "upper bound of sigma_max", legal=(1.2, 3.0), family=(1.35, 1.9)
    )
    lam_e_min: float = quantity(0.2, "", "smallest e/l1", legal=(0.0, 1.0))
    alpha_low: float = quantity(
        0.0, "rad", "smallest transmission angle between the rods, 0 = off",
        legal=(0.0, 1.5), family=(0.0, 1.15),
    )  # fmt: skip
    beta_low: float = quantity(
        0.0, "rad", "smallest transmission angle at the elbows, 0 = off",
        legal=(0.0, 1.5), family=(0.0, 0.85),
    )  # fmt: skip
    cycle_width_ratio: float = quantity(
        1.0, "", "width of the pick-and-place cycle over b", legal=(0.05, 1.0)
    )
    cycle_lift_ratio: float = quantity(
        25 / 305, "", "lift of the cycle over its width", legal=(0.005, 0.1)
    )
    cycle_time_ratio: float = quantity(
        1.0, "", "cycle time over 0.30 s sqrt(b / 0.8 m)", legal=(0.5, 10.0)
    )
    overlap: float = quantity(0.5, "", "overlap of lift and traverse", legal=(0.0, 0.95))


@dataclass(frozen=True)
class DiamondOptions(MassOptions):
    """Options of the Diamond."""

    sampling: tuple[int, int] = option(
        (16, 7),
        "columns and rows of samples on the right half of the workspace, to start from",
        low=2,
        high=10_000,
    )
    cycle: bool = option(
        False, "report the cycle's indices; the objectives tau_peak and tau_rms imply it"
    )
    cycle_samples: int = option(801, "instants of the pick-and-place cycle", low=11, high=100_000)


class Design(NamedTuple):
    """Ratios of the dimensions."""

    lam_e: Annotated[float, variable(0.2, 0.75, "", "e / l1", scanned=True)]
    lam_l: Annotated[float, variable(1.2, 3.6, "", "l2 / l1", step=0.02)]
    gap: Annotated[float, variable(0.1, 0.7, "", "lam_H - lam_l + 1, lam_H = H / l1", step=0.02)]


class Indices(NamedTuple):
    """What is measured over the workspace, and over the cycle."""

    tau_G: Annotated[
        float,
        index("N m/(m/s^2)", "largest drive torque per unit of platform acceleration"),
    ]
    sigma_max: Annotated[float, index("", "largest singular value of l1 J")]
    sigma_min: Annotated[float, index("", "smallest singular value of l1 J")]
    condition: Annotated[float, index("", "worst condition number of J")]
    alpha_min: Annotated[float, index("rad", "smallest transmission angle between the rods")]
    beta_min: Annotated[float, index("rad", "smallest transmission angle at the elbows")]
    arm_angle_min: Annotated[float, index("rad", "smallest arm angle of limb 1")]
    arm_angle_max: Annotated[float, index("rad", "largest arm angle of limb 1")]
    tau_peak: Annotated[float, index("N m", "peak drive torque over the cycle", reported="cycle")]
    tau_rms: Annotated[
        float, index("N m", "rms torque of the worse drive over the cycle", reported="cycle")
    ]
    power_peak: Annotated[
        float, index("W", "peak power of a drive over the cycle", reported="cycle")
    ]
    speed_peak: Annotated[float, index("rad/s", "peak arm rate over the cycle", reported="cycle")]
    sin_alpha: Annotated[float, index("", "smallest sin alpha", reported=False)]


DIAMOND = Declaration(
    name="diamond",
    title="2-DOF translational pick-and-place robot",
    version=2,
    problem="pkm_gym.mechanisms.diamond.problem:DiamondProblem",
    task=DiamondTask,
    options=DiamondOptions,
    design=Design,
    indices=Indices,
    limits=ReachLimits,
    constraints=(
        *REACH,
        Limit("assembly", "lower", 0.0, of="sin_alpha"),
        Limit("sigma_max", "upper", "sigma_high"),
        Limit("sigma_min", "lower", "sigma_low"),
        Limit("spacing", "lower", "lam_e_min", of="lam_e"),
        Limit("alpha", "lower", "alpha_low", of="alpha_min"),
        Limit("beta", "lower", "beta_low", of="beta_min"),
    ),
    option_limits=(
        Limit("torque", "upper", "torque_max", of="tau_peak"),
        Limit("rms", "upper", "rms_max", of="tau_rms"),
        Limit("speed", "upper", "speed_max", of="speed_peak"),
        Limit("power", "upper", "power_max", of="power_peak"),
    ),
    objectives=(
        Objective("tau_G", "minimise", worst=100.0),
        Objective("tau_peak", "minimise", worst=1e5),
        Objective("tau_rms", "minimise", worst=1e5),
        Objective("condition", "minimise", worst=20.0),
        Objective("sigma_min", "maximise", worst=0.05),
        Objective("sigma_max", "minimise", worst=5.0),
    ),
    penalty_weight=5.0,
    dimensions=("lam_H", "e", "l1", "l2", "H"),
    products={
        "h": Product("h_ratio", {"b": 1}, doc="height of the workspace"),
        "cycle_width": Product("cycle_width_ratio", {"b": 1}, doc="width of the cycle"),
        "cycle_lift": Product(
            "cycle_lift_ratio", {"cycle_width_ratio": 1, "b": 1}, doc="lift of the cycle"
        ),
        "cycle_time": Product(
            "cycle_time_ratio", {"b": 0.5}, "s", "time of the cycle", factor=0.30 / math.sqrt(0.8)
        ),
    },
    motion={},
)

TASK, DESIGN = record(DiamondTask), record(Design)
UNDEFINED = undefined(Indices)
