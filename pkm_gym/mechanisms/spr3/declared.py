"""What is said of the 3-SPR's two design problems: its own workspace, and a given cylinder."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

from pkm_gym.core.declaration import Declaration, Objective
from pkm_gym.core.limit import Limit
from pkm_gym.core.options import Options, option
from pkm_gym.core.product import Product
from pkm_gym.core.rows import index, own, record, undefined, variable
from pkm_gym.core.task import Task, quantity

# The homogeneous Jacobian that the conditioning indices are taken of: see ``indices.homogeneous``.
JACOBIANS = ("velocity", "tilt-a", "tilt-b", "tilt-D", "points")


@dataclass(frozen=True)
class Conditioning:
    """What paper.toml says of a Jacobian: its index at the optimum."""

    gci: float
    doc: str = ""


@dataclass(frozen=True)
class Spr3Options(Options):
    """Options of the 3-SPR."""

    jacobian: str = option("velocity", "whose conditioning", choices=lambda: JACOBIANS)
    nodes: int = option(3, "Gauss nodes in each of three directions", low=2, high=64)


# The workspace of the legs ------------------------------------------------------------------------


@dataclass(frozen=True)
class Spr3Task(Task):
    """What the 3-SPR must do; the defaults are the paper's legs and size, and limits of ours."""

    lam: float = quantity(
        0.2, "", "half the legs' stroke over their middle length",
        legal=(0.02, 0.5), family=(0.19, 0.25),
    )  # fmt: skip
    D: float = quantity(0.43, "m", "characteristic length (a + b + q_c) / 3", legal=(0.01, 10.0))
    volume_min: float = quantity(
        0.15, "", "smallest volume of the workspace over D^3",
        legal=(1e-4, 2.0), family=(0.045, 0.15),
    )  # fmt: skip
    parasitic_max: float = quantity(
        0.06, "", "largest parasitic offset over D", legal=(1e-3, 1.0), family=(0.055, 0.125)
    )
    s_angle_max: float = quantity(
        math.pi / 4, "rad", "largest angle of an S joint", legal=(0.05, 1.5), family=(0.77, 1.15)
    )
    r_angle_min: float = quantity(
        0.0, "rad", "smallest angle of an R joint, 0 = off", legal=(0.0, 1.5), family=(0.0, 0.75)
    )
    lci_low: float = quantity(
        0.3, "", "smallest local conditioning index", legal=(0.01, 0.95), family=(0.3, 0.64)
    )


class Design(NamedTuple):
    """Ratios of the dimensions; r2 = b / D = 3 - r1 - r3."""

    r1: Annotated[float, variable(0.15, 0.8, "", "a / D")]
    r3: Annotated[float, variable(1.1, 1.8, "", "q_c / D")]


class Indices(NamedTuple):
    """What is measured over the workspace."""

    gci: Annotated[float, index("", "mean local conditioning index over the workspace")]
    volume: Annotated[float, index("m^3", "volume of the workspace")]
    parasitic: Annotated[float, index("m", "largest parasitic offset")]
    s_angle: Annotated[
        float, index("rad", "largest angle of an S joint, from the base's normal to the leg")
    ]
    r_angle: Annotated[
        float, index("rad", "smallest angle of an R joint, from the platform's plane to the leg")
    ]
    lci_min: Annotated[float, index("", "smallest local conditioning index")]
    det: Annotated[float, index("", "smallest det J", reported=False)]
    fold: Annotated[float, index("", "smallest margin to the fold", reported=False)]


class Limits(NamedTuple):
    """The limits that the kernel fills itself."""

    dimensions: Annotated[float, own("r1, r2 and r3 make a machine")]
    assembly: Annotated[float, own("the legs can be assembled all over their range")]


SPR3 = Declaration(
    name="spr3",
    title="3-DOF spatial mechanism with two rotations and one translation",
    problem="pkm_gym.mechanisms.spr3.problem:Spr3Problem",
    task=Spr3Task,
    options=Spr3Options,
    design=Design,
    indices=Indices,
    limits=Limits,
    constraints=(
        "dimensions",
        "assembly",
        Limit("determinant", "lower", 0.0, of="det"),
        Limit("fold", "lower", 0.0),
        Limit("volume", "lower", "volume_min", times=("D", 3)),
        Limit("parasitic", "upper", "parasitic_max", times=("D", 1)),
        Limit("s_angle", "upper", "s_angle_max"),
        Limit("r_angle", "lower", "r_angle_min"),
        Limit("lci", "lower", "lci_low", of="lci_min"),
    ),
    objectives=(Objective("gci", "maximise", worst=0.0),),
    penalty_weight=5.0,
    dimensions=("r2", "a", "b", "q_min", "q_max"),
    products={
        "volume": Product("volume_min", {"D": 3}, "m^3", "smallest volume of the workspace"),
        "offset": Product("parasitic_max", {"D": 1}, doc="largest parasitic offset"),
    },
    motion={"speed": 20.0, "frame_skip": 20},
)

TASK, DESIGN = record(Spr3Task), record(Design)
UNDEFINED = undefined(Indices)


# A given cylinder ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class CylinderTask(Task):
    """The cylinder that the platform's centre must cover, and how large the machine may be."""

    radius: float = quantity(
        0.13, "m", "radius of the cylinder", legal=(0.001, 10.0), family=(0.1, 0.15)
    )
    height: float = quantity(
        0.065, "m", "height of the cylinder", legal=(0.001, 10.0), family=(0.04, 0.08)
    )
    stroke_ratio: float = quantity(
        1.5, "", "longest leg over shortest leg, at most", legal=(1.01, 5.0), family=(1.45, 1.75)
    )
    D_max: float = quantity(
        0.43, "m", "largest characteristic length (a + b + q_c) / 3", legal=(0.01, 10.0)
    )
    s_angle_max: float = quantity(
        math.pi / 4, "rad", "largest angle of an S joint", legal=(0.05, 1.5), family=(0.7, 0.95)
    )


class CylinderDesign(NamedTuple):
    """The machine's dimensions, and where the cylinder stands."""

    a: Annotated[
        float, variable(0.1, 0.5, "m", "radius of the revolute joints on the moving platform")
    ]
    b: Annotated[
        float, variable(0.2, 0.8, "m", "radius of the spherical joints on the fixed platform")
    ]
    z_c: Annotated[
        float, variable(0.3, 0.9, "m", "height of the cylinder's centre over the fixed platform")
    ]


class CylinderIndices(NamedTuple):
    """What is measured over the cylinder."""

    gci: Annotated[float, index("", "mean local conditioning index over the cylinder")]
    q_min: Annotated[float, index("m", "shortest leg in the cylinder")]
    q_max: Annotated[float, index("m", "longest leg in the cylinder")]
    stroke_ratio: Annotated[float, index("", "longest over shortest leg")]
    D: Annotated[float, index("m", "characteristic length (a + b + q_c) / 3, q_c between the two")]
    s_angle: Annotated[
        float, index("rad", "largest angle of an S joint, from the base's normal to the leg")
    ]
    det: Annotated[float, index("", "smallest det J", reported=False)]


class CylinderLimits(NamedTuple):
    """The limits that the kernel fills itself."""

    dimensions: Annotated[float, own("a, b and z_c make a machine")]
    assembly: Annotated[float, own("the platform reaches the cylinder on this side of its fold")]


SPR3_CYLINDER = Declaration(
    name="spr3_cylinder",
    title="3-SPR that covers a given cylinder",
    problem="pkm_gym.mechanisms.spr3.cylinder:Spr3CylinderProblem",
    task=CylinderTask,
    options=Spr3Options,
    design=CylinderDesign,
    indices=CylinderIndices,
    limits=CylinderLimits,
    constraints=(
        "dimensions",
        "assembly",
        Limit("determinant", "lower", 0.0, of="det"),
        Limit("stroke", "upper", "stroke_ratio", of="stroke_ratio", scale="relative"),
        Limit("size", "upper", "D_max", of="D"),
        Limit("s_angle", "upper", "s_angle_max"),
    ),
    objectives=(Objective("gci", "maximise", worst=0.0),),
    penalty_weight=10.0,
    reference="cylinder.toml",
)

CYLINDER_TASK, CYLINDER_DESIGN = record(CylinderTask), record(CylinderDesign)
CYLINDER_UNDEFINED = undefined(CylinderIndices)
