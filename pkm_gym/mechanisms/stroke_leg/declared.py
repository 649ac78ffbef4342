"""What is said of the leg's two design problems: the paper's, and one for a gait."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, radians
from typing import Annotated, NamedTuple

from pkm_gym.core.declaration import Declaration, Objective
from pkm_gym.core.limit import Limit
from pkm_gym.core.options import Options, option
from pkm_gym.core.product import Product
from pkm_gym.core.rows import Index, index, own, record, undefined, variable
from pkm_gym.core.task import Task, quantity

MEASURES = ("uniform", "area")  # of a mean: (theta, varphi), or the foot's x and z
SAMPLINGS = ("gauss", "grid", "midpoint")
PRINTED_WEIGHTS = (0.516, 20.8, 8.19)  # mu_1, mu_2, mu_3 of eq. (22)
GRID_NODES = 61  # 1 deg each way, which the printed eta_FC fits: sigma / 61
EXTENSION = 2.0  # a cylinder with its rod all out is less than twice as long as with it all in


class Limits(NamedTuple):
    """The limit that the kernels fill themselves."""

    dimensions: Annotated[float, own("lengths and angles make a machine")]


DEAD_POINTS = ("dead_A_short", "dead_A_long", "dead_D_short", "dead_D_long")


def _dead_point(crank: str, cylinder: str, length: str) -> Index:
    return index("rad", f"smallest angle of {crank} to its dead line, cylinder {cylinder} {length}")


# Indices of both problems.
DeadAShort = Annotated[float, _dead_point("OA", "AB", "short")]
DeadALong = Annotated[float, _dead_point("OA", "AB", "long")]
DeadDShort = Annotated[float, _dead_point("OD", "CD", "short")]
DeadDLong = Annotated[float, _dead_point("OD", "CD", "long")]
Shortest2 = Annotated[float, index("m", "shortest length of the cylinder AB")]
Longest2 = Annotated[float, index("m", "longest length of the cylinder AB")]
Shortest4 = Annotated[float, index("m", "shortest length of the cylinder CD")]
Longest4 = Annotated[float, index("m", "longest length of the cylinder CD")]
Stroke2 = Annotated[float, index("m", "stroke of the cylinder AB")]
Stroke4 = Annotated[float, index("m", "stroke of the cylinder CD")]
Gap = Annotated[float, index("m", "smallest distance of the cylinders' axes")]


def _cylinder_limits(number: int) -> tuple[Limit, Limit]:
    """Return the limits of a cylinder's shortest and longest length."""
    name = f"cylinder{number}"
    return (
        Limit(f"{name}_short", "lower", "l_min", of=f"l{number}_min"),
        Limit(f"{name}_long", "upper", "l_min", of=f"l{number}_max", times=("ratio", 1)),
    )


# The paper's problem ------------------------------------------------------------------------------


@dataclass(frozen=True)
class StrokeLegOptions(Options):
    """Options of the paper's problem."""

    measure: str = option(
        "uniform",
        "what a mean is over: (theta, varphi), or the foot's area",
        choices=lambda: MEASURES,
    )
    sampling: str = option(
        "gauss",
        "Gauss nodes on either side of theta = 45 deg, an even grid, or the middles of one",
        choices=lambda: SAMPLINGS,
    )
    nodes: int = option(8, "Gauss nodes in varphi, and in theta on either side", low=2, high=64)
    points: int = option(GRID_NODES, "points of a grid in either direction", low=3, high=1001)
    mu: tuple[float, float, float] = option(
        PRINTED_WEIGHTS, "weights of lambda, eqs (22)-(25)", low=0.0, high=1e6
    )


@dataclass(frozen=True)
class StrokeLegTask(Task):
    """How far the foot must go, and what the cylinders are.

    The rectangle, the side and the cylinders' range are the paper's; clearance and gap are ours.
    """

    theta_min: float = quantity(
        radians(15.0), "rad", "smallest half opening angle of the rhombi",
        legal=(radians(2.0), radians(40.0)), family=(radians(12.0), radians(22.0)),
    )  # fmt: skip
    theta_max: float = quantity(
        radians(75.0), "rad", "largest half opening angle of the rhombi",
        legal=(radians(50.0), radians(88.0)), family=(radians(60.0), radians(75.0)),
    )  # fmt: skip
    swing: float = quantity(
        radians(30.0), "rad", "swing to either side",
        legal=(radians(1.0), radians(45.0)), family=(radians(15.0), radians(30.0)),
    )  # fmt: skip
    l_min: float = quantity(0.26, "m", "shortest cylinder", legal=(0.02, 1.0), family=(0.23, 0.29))
    ratio: float = quantity(
        345.0 / 260.0, "", "longest cylinder over shortest", legal=(1.05, 20.0),
        family=(1.32, 1.5),
    )  # fmt: skip
    clearance: float = quantity(
        radians(5.0), "rad", "smallest angle of a crank to its dead line",
        legal=(radians(1.0), radians(20.0)),
    )  # fmt: skip
    gap_min: float = quantity(
        0.06, "m", "smallest distance of the cylinders' axes", legal=(1e-3, 0.3),
        family=(0.03, 0.08),
    )  # fmt: skip
    l: float = quantity(0.26, "m", "side of the rhombi", legal=(0.05, 1.0))


class Design(NamedTuple):
    """The dimensions of the frame and the cranks; the paper searches the first five."""

    l1: Annotated[float, variable(0.04, 0.11, "m", "crank OA", step=0.005)]
    l3: Annotated[float, variable(0.18, 0.32, "m", "frame link CB", step=0.01)]
    l6: Annotated[float, variable(0.24, 0.36, "m", "frame link OC", step=0.01)]
    phi: Annotated[
        float,
        variable(
            radians(120.0),
            radians(160.0),
            "rad",
            "angle from OA to OF, one body",
            step=radians(5.0),
        ),
    ]
    th3: Annotated[
        float, variable(radians(60.0), radians(90.0), "rad", "angle OCB", step=radians(5.0))
    ]
    gamma: Annotated[
        float,
        variable(
            radians(20.0), radians(70.0), "rad", "angle from OD to OE, one body",
            default=0.25 * pi, searched=False, step=radians(5.0),
        ),
    ]  # fmt: skip
    l5: Annotated[
        float, variable(0.04, 0.11, "m", "crank OD", default="l1", searched=False, step=0.005)
    ]


class Indices(NamedTuple):
    """What is measured over the rectangle of theta and varphi."""

    eta_P: Annotated[float, index("", "mean condition number of J")]
    sigma: Annotated[float, index("", "standard deviation of the condition number")]
    eta_FC: Annotated[float, index("", "sigma / 61, the paper's eta_FC")]
    eta_DL: Annotated[float, index("", "smallest condition number")]
    lambda_paper: Annotated[float, index("", "the paper's tolerance-weighted sum lambda")]
    dexterity: Annotated[
        float, index("", "mean of eta_P and sigma, each over what |k2| = |k4| everywhere gives")
    ]
    force: Annotated[
        float, index("", "largest force of the cylinders (norm) for a unit force on the foot")
    ]
    stroke2: Stroke2
    stroke4: Stroke4
    gap: Gap
    dead_A_short: DeadAShort
    dead_A_long: DeadALong
    dead_D_short: DeadDShort
    dead_D_long: DeadDLong
    l2_min: Shortest2
    l2_max: Longest2
    l4_min: Shortest4
    l4_max: Longest4
    extension: Annotated[
        float, index("", "longest over shortest length of a cylinder", reported=False)
    ]


STROKE_LEG = Declaration(
    name="stroke_leg",
    title="2-DOF stroke-amplification leg of a quadruped",
    problem="pkm_gym.mechanisms.stroke_leg.problem:StrokeLegProblem",
    task=StrokeLegTask,
    products={"l_max": Product("ratio", {"l_min": 1}, doc="longest cylinder")},
    options=StrokeLegOptions,
    design=Design,
    indices=Indices,
    limits=Limits,
    constraints=(
        "dimensions",
        *(Limit(name, "lower", "clearance") for name in DEAD_POINTS),
        *_cylinder_limits(2),
        *_cylinder_limits(4),
        Limit("extension", "upper", EXTENSION),
        Limit("gap", "lower", "gap_min"),
    ),
    objectives=(
        Objective("dexterity", "minimise", worst=100.0, scale=1.160197),
        Objective("lambda_paper", "minimise", worst=100.0, scale=8.264108),
        Objective("eta_P", "minimise", worst=100.0, scale=2.053139),
        Objective("force", "minimise", worst=1e4, scale=48.3153, powers={"l": 1}),
    ),
    penalty_weight=10.0,
    starts=3,
    motion={"speed": 0.5, "frame_skip": 24},
    family={
        "free": ("l1", "l3", "l6", "phi", "th3", "gamma"),
        "bounds": {"phi": (radians(80.0), radians(160.0))},
    },
)

TASK, DESIGN = record(StrokeLegTask), record(Design)
UNDEFINED = undefined(Indices)


# A leg for a gait ---------------------------------------------------------------------------------

LEAST_OPENING, MOST_OPENING = radians(10.0), radians(80.0)  # of theta
LEAST_CLEARANCE = radians(5.0)  # of a crank to its dead line


@dataclass(frozen=True)
class GaitTask(Task):
    """Where the foot goes, what the cylinders are and can do, and how much room there is."""

    stride: float = quantity(
        0.35, "m", "length of the foot's rectangle", legal=(0.05, 0.8), family=(0.25, 0.45)
    )
    lift: float = quantity(
        0.12, "m", "height of the foot's rectangle", legal=(0.01, 0.4), family=(0.06, 0.2)
    )
    hip_height: float = quantity(
        0.72, "m", "height of the hip over the ground", legal=(0.45, 1.2), family=(0.62, 0.82)
    )
    x0: float = quantity(
        0.0, "m", "middle of the rectangle before the hip", legal=(-0.3, 0.3), family=(-0.08, 0.08)
    )
    l_min: float = quantity(0.255, "m", "shortest cylinder", legal=(0.05, 1.0), family=(0.22, 0.29))
    ratio: float = quantity(
        1.4, "", "longest cylinder over shortest", legal=(1.05, 4.0), family=(1.3, 1.5)
    )
    cone: float = quantity(
        radians(15.0), "rad", "largest angle of the ground's force to the vertical",
        legal=(0.0, radians(45.0)), family=(radians(5.0), radians(25.0)),
    )  # fmt: skip
    thrust: float = quantity(
        15.0, "", "largest force of a cylinder for a unit force on the foot",
        legal=(2.0, 100.0), family=(10.0, 20.0),
    )  # fmt: skip
    rate: float = quantity(
        0.12, "", "largest speed of a piston for a unit speed of the foot",
        legal=(0.01, 1.0), family=(0.08, 0.16),
    )  # fmt: skip
    mount: float = quantity(
        0.175, "m", "largest height of B over the hip", legal=(0.05, 0.5), family=(0.13, 0.22)
    )
    gap: float = quantity(
        0.05, "m", "smallest distance of the cylinders' axes", legal=(1e-3, 0.3),
        family=(0.03, 0.08),
    )  # fmt: skip


class GaitDesign(NamedTuple):
    """The dimensions; both cranks are of one length."""

    l1: Annotated[float, variable(0.03, 0.12, "m", "cranks OA and OD", step=0.03)]
    l3: Annotated[float, variable(0.15, 0.32, "m", "frame link CB", step=0.04)]
    l6: Annotated[float, variable(0.2, 0.36, "m", "frame link OC", step=0.04)]
    phi: Annotated[
        float,
        variable(
            radians(80.0), radians(160.0), "rad", "angle from OA to OF, one body",
            step=radians(20.0),
        ),
    ]  # fmt: skip
    th3: Annotated[
        float, variable(radians(50.0), radians(100.0), "rad", "angle OCB", step=radians(10.0))
    ]
    gamma: Annotated[
        float,
        variable(
            radians(20.0), radians(70.0), "rad", "angle from OD to OE, one body",
            step=radians(10.0),
        ),
    ]  # fmt: skip
    l: Annotated[float, variable(0.18, 0.34, "m", "side of the rhombi", step=0.04)]


class GaitIndices(NamedTuple):
    """What is measured over the foot's rectangle."""

    thrust_rms: Annotated[
        float,
        index("", "root mean square of the cylinders' forces (norm) for a unit vertical force"),
    ]
    thrust: Annotated[
        float, index("", "largest force of a cylinder for a unit force within the cone")
    ]
    rate: Annotated[float, index("", "largest speed of a piston for a unit speed of the foot")]
    gap: Gap
    mount: Annotated[float, index("m", "height of B over the hip")]
    stroke2: Stroke2
    stroke4: Stroke4
    l2_min: Shortest2
    l2_max: Longest2
    l4_min: Shortest4
    l4_max: Longest4
    theta_min: Annotated[float, index("rad", "smallest half opening angle of the rhombi")]
    theta_max: Annotated[float, index("rad", "largest half opening angle of the rhombi")]
    dead_A_short: DeadAShort
    dead_A_long: DeadALong
    dead_D_short: DeadDShort
    dead_D_long: DeadDLong


class GaitLimits(NamedTuple):
    """The limits that the kernel fills itself."""

    dimensions: Annotated[float, own("lengths and angles make a machine")]
    reach: Annotated[float, own("the rhombi reach all of the foot's rectangle")]


STROKE_LEG_GAIT = Declaration(
    name="stroke_leg_gait",
    title="stroke-amplification leg for a given gait",
    problem="pkm_gym.mechanisms.stroke_leg.gait:StrokeLegGaitProblem",
    task=GaitTask,
    products={"l_max": Product("ratio", {"l_min": 1}, doc="longest cylinder")},
    design=GaitDesign,
    indices=GaitIndices,
    limits=GaitLimits,
    constraints=(
        "dimensions",
        "reach",
        Limit("opening_low", "lower", LEAST_OPENING, of="theta_min"),
        Limit("opening_high", "upper", MOST_OPENING, of="theta_max"),
        *(Limit(name, "lower", LEAST_CLEARANCE) for name in DEAD_POINTS),
        *_cylinder_limits(2),
        *_cylinder_limits(4),
        Limit("thrust", "upper", "thrust", scale="relative"),
        Limit("rate", "upper", "rate", scale="relative"),
        Limit("gap", "lower", "gap"),
        Limit("mount", "upper", "mount"),
    ),
    objectives=(Objective("thrust_rms", "minimise"),),
    reference="gait.toml",
    evaluations=24,
    searches=3,
    starts=6,
    neighbours=6,
    evolutions=3,
    thorough=(0, 3),
    splits={"train": 2048, "val": 64, "test": 64, "ood": 64},
)

GAIT_TASK, GAIT_DESIGN = record(GaitTask), record(GaitDesign)
GAIT_UNDEFINED = undefined(GaitIndices)
