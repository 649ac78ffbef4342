"""What is said of the 6-PUS's two design problems: the paper's, and one for a layout."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from typing import Annotated, NamedTuple

from pkm_gym.core.declaration import Declaration, Objective
from pkm_gym.core.limit import Limit
from pkm_gym.core.options import Options, option
from pkm_gym.core.rows import index, own, record, undefined, variable
from pkm_gym.core.task import Task, quantity

CONVENTIONS = ("influence", "symmetric")  # of the angular slices of H
SAMPLINGS = {"coarse": 512, "default": 2048, "fine": 65536}  # poses of the half box
WORKSPACES = ("box", "paper")  # that the means are over

LEAST_ASPECT = 0.05  # of det G^-1 to its value at home


@dataclass(frozen=True)
class Pus6Options(Options):
    """Options of both problems."""

    convention: str = option(
        "influence", "of the second-order coefficients", choices=lambda: CONVENTIONS
    )
    sampling: str = option(
        "default", "poses that the means are over: 512, 2,048 or 65,536", choices=lambda: SAMPLINGS
    )
    workspace: str = option(
        "box", "the task's box, or the paper's lattice as reconstructed", choices=lambda: WORKSPACES
    )
    same_aspect: bool = option(
        False, "count only poses of the lattice on the home side of the singularity"
    )


@dataclass(frozen=True)
class Pus6Task(Task):
    """The box that the tool must reach, and what joints and screws can do.

    All of it is ours but the characteristic length, the paper's centimetre, and the stroke, which
    is identified from its tables.
    """

    xy: float = quantity(
        0.05, "m", "half the box's width in x and in y", legal=(0.005, 0.2), family=(0.04, 0.06)
    )
    z: float = quantity(0.03, "m", "half the box's height", legal=(0.0, 0.2))
    tilt: float = quantity(
        radians(10.0), "rad", "largest tilt alpha and beta to either side",
        legal=(radians(0.5), radians(45.0)), family=(radians(7.0), radians(13.0)),
    )  # fmt: skip
    spin: float = quantity(
        radians(10.0), "rad", "largest spin gamma to either side",
        legal=(radians(0.5), radians(45.0)), family=(radians(6.0), radians(14.0)),
    )  # fmt: skip
    stroke: float = quantity(
        0.294, "m", "travel of the screws", legal=(0.05, 2.0), family=(0.28, 0.34)
    )
    rod_tilt: float = quantity(
        radians(65.0), "rad", "largest angle of a rod to the vertical",
        legal=(radians(20.0), radians(85.0)),
    )  # fmt: skip
    s_cone: float = quantity(
        radians(40.0), "rad", "largest angle of an S joint from its home direction",
        legal=(radians(10.0), radians(80.0)), family=(radians(34.0), radians(42.0)),
    )  # fmt: skip
    clearance: float = quantity(
        0.04, "m", "smallest distance of two rods' centre lines", legal=(1e-3, 0.3)
    )
    spacing: float = quantity(
        0.08, "m", "smallest distance of neighbouring screws", legal=(1e-3, 0.3)
    )
    characteristic_length: float = quantity(
        0.01, "m", "unit of length of eta_F and eta_I", legal=(1e-4, 10.0)
    )
    tool: float = quantity(
        0.0, "m", "length of the tool below the platform", legal=(0.0, 0.5)
    )  # fmt: skip


ScrewRadius = Annotated[
    float,
    variable(0.30, 0.46, "m", "radius of the screws", default=0.38, searched=False, step=0.01),
]
ANGLES = radians(4.0), radians(60.0)  # between the screws of a column, the S joints of a corner


class Design(NamedTuple):
    """The dimensions; the paper searches the first two."""

    L: Annotated[float, variable(0.40, 0.55, "m", "length of the rods", step=0.01, scanned=True)]
    R: Annotated[
        float, variable(0.08, 0.22, "m", "radius of the S joints", step=0.01, scanned=True)
    ]
    r_B: ScrewRadius
    phi_A: Annotated[
        float,
        variable(
            *ANGLES, "rad", "angle between the screws of a column",
            default=radians(15.0), searched=False, step=radians(1.0),
        ),
    ]  # fmt: skip
    phi_C: Annotated[
        float,
        variable(
            *ANGLES, "rad", "angle between the S joints of a corner",
            default=radians(30.0), searched=False, step=radians(1.0),
        ),
    ]  # fmt: skip


class Indices(NamedTuple):
    """What is measured over the box; the eta are means of 1/K."""

    eta_omega: Annotated[float, index("", "angular velocity, eq. (1)")]
    eta_v: Annotated[float, index("", "linear velocity, eq. (1)")]
    eta_alpha: Annotated[float, index("", "angular acceleration, eqs (2), (4)")]
    eta_a: Annotated[float, index("", "linear acceleration, eqs (3), (4)")]
    eta_F: Annotated[float, index("", "force and torque, eqs (5), (6)")]
    eta_I: Annotated[float, index("", "inertia force, eqs (7), (8), as the paper's tables have it")]
    balanced: Annotated[
        float,
        index(
            "",
            "geometric mean of omega, v, a and I, each over the printed design's",
            compared=True,
        ),
    ]
    balanced5: Annotated[
        float, index("", "the same with alpha, which depends on a convention", compared=True)
    ]
    stroke: Annotated[float, index("m", "travel that the screws need")]
    rod_tilt: Annotated[float, index("rad", "largest angle of a rod to the vertical")]
    s_cone: Annotated[float, index("rad", "largest angle of an S joint from its home direction")]
    clearance: Annotated[float, index("m", "smallest distance of two rods' centre lines")]
    spacing: Annotated[float, index("m", "distance of the screws of a column")]
    aspect: Annotated[float, index("", "least det G^-1 over its value at home")]
    reach: Annotated[
        float, index("", "largest horizontal part of a rod over its length", reported=False)
    ]


class Limits(NamedTuple):
    """The limit that the kernels fill themselves."""

    dimensions: Annotated[float, own("lengths and angles make a machine")]


CONSTRAINTS = (
    "dimensions",
    Limit("reach", "upper", 1.0),
    Limit("stroke", "upper", "stroke"),
    Limit("rod_tilt", "upper", "rod_tilt"),
    Limit("s_cone", "upper", "s_cone"),
    Limit("clearance", "lower", "clearance"),
    Limit("spacing", "lower", "spacing"),
    Limit("aspect", "lower", LEAST_ASPECT),
)
OBJECTIVES = tuple(
    Objective(name, "maximise", worst=0.0)
    for name in (
        "balanced", "balanced5", "eta_omega", "eta_v", "eta_alpha", "eta_a", "eta_F", "eta_I",
    )
)  # fmt: skip

PUS6 = Declaration(
    name="pus6",
    title="6-DOF engraving machine with six vertical screws",
    problem="pkm_gym.mechanisms.pus6.problem:Pus6Problem",
    task=Pus6Task,
    options=Pus6Options,
    design=Design,
    indices=Indices,
    limits=Limits,
    constraints=CONSTRAINTS,
    objectives=OBJECTIVES,
    penalty_weight=5.0,
    starts=8,
    coarse={"sampling": "coarse"},
    motion={"frame_skip": 20},
    splits={},  # two variables, and mostly one limit that holds an optimum back
)

TASK, DESIGN = record(Pus6Task), record(Design)
UNDEFINED = undefined(Indices)


# A layout for a tool ------------------------------------------------------------------------------


@dataclass(frozen=True)
class LayoutTask(Pus6Task):
    """The same, with a tool and rods that need room."""

    clearance: float = quantity(
        0.04, "m", "smallest distance of two rods' centre lines", legal=(1e-3, 0.3),
        family=(0.035, 0.05),
    )  # fmt: skip
    tool: float = quantity(
        0.0, "m", "length of the tool below the platform", legal=(0.0, 0.5), family=(0.0, 0.06)
    )


class LayoutDesign(NamedTuple):
    """The same dimensions in a wider box, the angles of both hexagons among them."""

    L: Annotated[float, variable(0.36, 0.60, "m", "length of the rods", step=0.03)]
    R: Annotated[float, variable(0.06, 0.24, "m", "radius of the S joints", step=0.03)]
    r_B: ScrewRadius
    phi_A: Annotated[
        float,
        variable(
            *ANGLES, "rad", "angle between the screws of a column",
            step=radians(5.0),
        ),
    ]  # fmt: skip
    phi_C: Annotated[
        float,
        variable(
            *ANGLES, "rad", "angle between the S joints of a corner",
            step=radians(5.0),
        ),
    ]  # fmt: skip


PUS6_LAYOUT = Declaration(
    name="pus6_layout",
    title="6-PUS engraving machine with hexagons for its task",
    problem="pkm_gym.mechanisms.pus6.problem:Pus6LayoutProblem",
    task=LayoutTask,
    options=Pus6Options,
    design=LayoutDesign,
    indices=Indices,
    limits=Limits,
    constraints=CONSTRAINTS,
    objectives=OBJECTIVES,
    penalty_weight=5.0,
    reference="layout.toml",
    evaluations=24,
    starts=8,
    coarse={"sampling": "coarse"},
    splits={"train": 512, "val": 64, "test": 64, "ood": 64},
)
