"""What is said of the 5-PSS/UPU's two design problems: the paper's, and one that works."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from typing import Annotated, NamedTuple

from pkm_gym.core.declaration import Declaration, Objective
from pkm_gym.core.limit import Limit
from pkm_gym.core.options import Options, option
from pkm_gym.core.product import Product
from pkm_gym.core.rows import index, own, record, undefined, variable
from pkm_gym.core.task import Task, quantity

SAMPLINGS = {"coarse": 256, "default": 1024, "fine": 4096}  # poses that the means are over
LEVELS = {"default": 3, "fine": 5}  # of each coordinate, at which limits are looked for
YAWS = ("euler0", "upu")  # alpha: 0 as in the paper, or what a UPU limb gives
WEIGHTS = (1.06, 0.88, 0.91, 1.80)  # of F, as the paper prints them

LEAST_SHARE = 0.1  # of r, R, L in their mean
LEAST_COSINE = 0.2  # of a rod to its rail
LEAST_GAP = radians(20.0)  # of neighbouring joints on base and platform
RAIL_SHARE = 0.95  # of R / cos theta, where the rails meet
LEAST_RCOND = 1e-3
LENGTHS = ("r", "R", "L")
SINGULAR_AT_HOME = "singular at the home pose: rank 4 of 6"


@dataclass(frozen=True)
class Pss5UpuOptions(Options):
    """Options of the paper's problem."""

    yaw: str = option("euler0", "how the platform turns about z", choices=lambda: YAWS)
    sampling: str = option(
        "default", "poses that the means are over: 256, 1,024 or 4,096", choices=lambda: SAMPLINGS
    )
    nodes: str = option(
        "default", "levels of each coordinate that limits are looked for at: 3 or 5",
        choices=lambda: LEVELS,
    )  # fmt: skip


@dataclass(frozen=True)
class SkewOptions(Pss5UpuOptions):
    """Options of the skew problem."""

    yaw: str = option("upu", "how the platform turns about z", choices=lambda: YAWS)


@dataclass(frozen=True)
class Pss5UpuTask(Task):
    """The box that the platform must reach, over home, in shares of n = (r + R + L) / 3.

    All of it is ours: the paper gives no workspace.
    """

    xy: float = quantity(
        0.15, "", "half the box's width in x and y over n", legal=(0.01, 0.5), family=(0.06, 0.18)
    )
    z: float = quantity(
        0.10, "", "half the box's height over n", legal=(0.005, 0.5), family=(0.04, 0.12)
    )
    tilt: float = quantity(
        radians(20.0), "rad", "largest beta and gamma to either side",
        legal=(radians(0.5), radians(45.0)), family=(radians(5.0), radians(22.0)),
    )  # fmt: skip
    n: float = quantity(0.5, "m", "mean of r, R and L", legal=(0.01, 10.0))


class Design(NamedTuple):
    """The space model's shares, n1 + n2 + n3 = 3; the paper searches the first two."""

    n2: Annotated[float, variable(0.9, 1.8, "", "R / n", step=0.05)]
    n3: Annotated[float, variable(0.5, 1.7, "", "L / n", step=0.05)]
    theta: Annotated[
        float,
        variable(
            radians(5.0), radians(75.0), "rad", "inclination of the rails",
            default=radians(30.0), searched=False, step=radians(5.0),
        ),
    ]  # fmt: skip
    lam0: Annotated[
        float,
        variable(
            0.4, 0.995, "", "cosine of rod and rail that gives the height of home",
            default=0.8, searched=False, step=0.05,
        ),
    ]  # fmt: skip


class Indices(NamedTuple):
    """What is measured over the box."""

    K_v: Annotated[float, index("", "mean s3 / s1 of J_v")]
    K_w: Annotated[float, index("", "mean s2 / s1 of J_w")]
    K_lambda: Annotated[float, index("", "mean of the least input transmission")]
    K_eta: Annotated[float, index("", "mean of the least output transmission")]
    F: Annotated[float, index("", "composite with the paper's weights, of raw indices")]
    gti: Annotated[float, index("", "mean of the least transmission")]
    gtw: Annotated[float, index("", "share of the box with a least transmission of 0.7")]
    transmission: Annotated[float, index("", "least cosine of a rod to its rail")]
    slider_low: Annotated[float, index("m", "least way of a slider from its rail's foot")]
    slider_high: Annotated[float, index("m", "greatest way of a slider from its rail's foot")]
    rail_start: Annotated[float, index("", "least way of a slider over n", reported=False)]
    rail_end: Annotated[
        float, index("", "greatest way of a slider over the allowed one", reported=False)
    ]
    reach: Annotated[
        float, index("", "least of 1 - (distance from the rail over L)^2", reported=False)
    ]
    share: Annotated[float, index("", "least of r, R and L over n", reported=False)]
    platform: Annotated[float, index("", "radius of the platform over the base's", reported=False)]


class Limits(NamedTuple):
    """The limit that the kernels fill themselves."""

    dimensions: Annotated[float, own("lengths and angles make a machine")]


CONSTRAINTS = (
    "dimensions",
    Limit("share", "lower", LEAST_SHARE),
    Limit("platform", "upper", 1.0),
    Limit("reach", "lower", 0.0),
    Limit("transmission", "lower", LEAST_COSINE),
    Limit("rail_start", "lower", 0.0),
    Limit("rail_end", "upper", 1.0),
)

PSS5_UPU = Declaration(
    name="pss5_upu",
    title="5-DOF mechanism of five rails and a UPU limb",
    problem="pkm_gym.mechanisms.pss5_upu.problem:Pss5UpuProblem",
    task=Pss5UpuTask,
    options=Pss5UpuOptions,
    design=Design,
    indices=Indices,
    limits=Limits,
    constraints=CONSTRAINTS,
    dimensions=LENGTHS,
    products={
        "half_width": Product("xy", {"n": 1}, doc="half the box's width in x and y"),
        "half_height": Product("z", {"n": 1}, doc="half the box's height"),
    },
    objectives=(
        Objective("gti", "maximise", worst=0.0, scale=0.224),
        Objective("F", "maximise", worst=0.0, scale=1.848),
    ),
    penalty_weight=5.0,
    environment="PSS5UPU",
    starts=8,
    motion=None,  # singular at home: what moves is the skew layout
    splits={},  # two variables, and two limits that hold the optimum
    notes=(SINGULAR_AT_HOME,),
)

TASK, DESIGN = record(Pss5UpuTask), record(Design)
UNDEFINED = undefined(Indices)


# A layout that works ------------------------------------------------------------------------------


@dataclass(frozen=True)
class SkewTask(Task):
    """The box, which may stand aside, and the room, rails, joints and motors that there are."""

    x: float = quantity(
        0.15, "", "half the box's width in x over n", legal=(0.01, 0.5), family=(0.06, 0.18)
    )
    y: float = quantity(
        0.15, "", "half the box's width in y over n", legal=(0.01, 0.5), family=(0.06, 0.18)
    )
    z: float = quantity(
        0.10, "", "half the box's height over n", legal=(0.005, 0.5), family=(0.04, 0.12)
    )
    tilt_x: float = quantity(
        radians(20.0), "rad", "largest tilt about x, gamma, to either side",
        legal=(radians(0.5), radians(45.0)), family=(radians(5.0), radians(22.0)),
    )  # fmt: skip
    tilt_y: float = quantity(
        radians(20.0), "rad", "largest tilt about y, beta, to either side",
        legal=(radians(0.5), radians(45.0)), family=(radians(5.0), radians(22.0)),
    )  # fmt: skip
    x0: float = quantity(
        0.0, "", "x of the box's centre over n", legal=(-0.3, 0.3), family=(-0.10, 0.10)
    )
    gap: float = quantity(
        LEAST_GAP, "rad", "least angle of neighbouring joints on base and platform",
        legal=(radians(2.0), radians(60.0)), family=(radians(10.0), radians(24.0)),
    )  # fmt: skip
    rail_length: float = quantity(
        1.1, "", "length of the rails over n", legal=(0.2, 3.0), family=(0.75, 1.1)
    )
    clearance: float = quantity(
        0.04, "m", "least distance of centre lines of rods, other rails and the UPU limb",
        legal=(1e-3, 0.5), family=(0.04, 0.12),
    )  # fmt: skip
    swing: float = quantity(
        radians(180.0), "rad", "largest angle of a rod from the box's centre, in base and platform",
        legal=(radians(5.0), radians(180.0)), family=(radians(36.0), radians(50.0)),
    )  # fmt: skip
    force: float = quantity(
        100.0, "", "largest force of a slider per vertical load",
        legal=(0.3, 1000.0), family=(0.9, 1.5),
    )  # fmt: skip
    height: float = quantity(
        10.0, "", "largest height of the platform over n", legal=(0.3, 20.0), family=(1.15, 1.5)
    )
    n: float = quantity(0.5, "m", "mean of r, R and L", legal=(0.01, 10.0))


def offset(doc: str, largest: float) -> object:
    """Return the variable of a joint's azimuth from the five-fold layout's."""
    return variable(-radians(largest), radians(largest), "rad", doc, step=radians(36.0))


class SkewDesign(NamedTuple):
    """Shares, rails, height and azimuths of joints, from 72 and 144 deg; 5 and 4 mirror 2 and 3."""

    n2: Annotated[float, variable(0.9, 1.8, "", "R / n", step=0.45)]
    n3: Annotated[float, variable(0.5, 1.7, "", "L / n", step=0.4)]
    theta: Annotated[
        float,
        variable(
            radians(5.0), radians(75.0), "rad", "inclination of the rails", step=radians(35.0)
        ),
    ]
    lam0: Annotated[
        float, variable(0.4, 0.995, "", "number that gives the height of home", step=0.25)
    ]
    a2: Annotated[float, offset("azimuth of the S joint 2 from 72 deg", 72.0)]
    a3: Annotated[float, offset("azimuth of the S joint 3 from 144 deg", 36.0)]
    b2: Annotated[float, offset("azimuth of the foot 2 from 72 deg", 72.0)]
    b3: Annotated[float, offset("azimuth of the foot 3 from 144 deg", 36.0)]


class SkewIndices(NamedTuple):
    """What is measured over the box; the least and greatest at its nodes."""

    K_v: Annotated[float, index("", "mean s3 / s1 of J_v")]
    K_w: Annotated[float, index("", "mean s2 / s1 of J_w")]
    K_lambda: Annotated[float, index("", "mean of the least input transmission")]
    K_eta: Annotated[float, index("", "mean of the least output transmission")]
    F: Annotated[float, index("", "composite with the paper's weights, of raw indices")]
    gti: Annotated[float, index("", "mean of the least transmission")]
    gtw: Annotated[float, index("", "share of the box with a least transmission of 0.7")]
    lti_min: Annotated[float, index("", "least transmission")]
    rcond: Annotated[float, index("", "least reciprocal condition of the limbs' system")]
    transmission: Annotated[float, index("", "least cosine of a rod to its rail")]
    slider_low: Annotated[float, index("m", "least way of a slider from its rail's foot")]
    slider_high: Annotated[float, index("m", "greatest way of a slider from its rail's foot")]
    rod_rod: Annotated[float, index("m", "least distance of two rods")]
    rod_rail: Annotated[float, index("m", "least distance of a rod and another's rail")]
    rod_upu: Annotated[float, index("m", "least distance of a rod and the UPU limb")]
    swing: Annotated[float, index("rad", "largest angle of a rod from the box's centre")]
    force: Annotated[float, index("", "largest force of a slider per vertical load")]
    height: Annotated[float, index("", "largest height of the platform over n")]
    gap: Annotated[float, index("rad", "least angle of neighbouring joints")]
    clearance: Annotated[float, index("m", "least distance of centre lines", reported=False)]
    determinant: Annotated[
        float, index("", "least determinant over that of the box's centre", reported=False)
    ]
    rail_start: Annotated[float, index("", "least way of a slider over n", reported=False)]
    rail_end: Annotated[
        float, index("", "greatest way of a slider over the allowed one", reported=False)
    ]
    reach: Annotated[
        float, index("", "least of 1 - (distance from the rail over L)^2", reported=False)
    ]
    share: Annotated[float, index("", "least of r, R and L over n", reported=False)]
    platform: Annotated[float, index("", "radius of the platform over the base's", reported=False)]


PSS5_UPU_SKEW = Declaration(
    name="pss5_upu_skew",
    title="5-DOF mechanism of five rails in a layout that isn't singular",
    problem="pkm_gym.mechanisms.pss5_upu.skew:SkewProblem",
    task=SkewTask,
    options=SkewOptions,
    design=SkewDesign,
    indices=SkewIndices,
    limits=Limits,
    constraints=(
        *CONSTRAINTS,
        Limit("azimuth_gap", "lower", "gap", of="gap"),
        Limit("clearance", "lower", "clearance"),
        Limit("determinant", "lower", 0.0),
        Limit("rcond", "lower", LEAST_RCOND, scale="relative"),
        Limit("swing", "upper", "swing"),
        Limit("force", "upper", "force", scale="relative"),
        Limit("height", "upper", "height"),
    ),
    dimensions=LENGTHS,
    products={
        "half_width": Product("x", {"n": 1}, doc="half the box's width in x"),
        "half_depth": Product("y", {"n": 1}, doc="half the box's width in y"),
        "half_height": Product("z", {"n": 1}, doc="half the box's height"),
        "centre": Product("x0", {"n": 1}, doc="x of the box's centre"),
        "rail": Product("rail_length", {"n": 1}, doc="length of the rails"),
        "top": Product("height", {"n": 1}, doc="largest height of the platform"),
    },
    objectives=(
        Objective("gti", "maximise", worst=0.0, scale=0.831),
        Objective("F", "maximise", worst=0.0, scale=3.361),
        Objective("lti_min", "maximise", worst=0.0, scale=0.69),
    ),
    penalty_weight=5.0,
    reference="skew.toml",
    environment="PSS5UPUSkew",
    motion={"frame_skip": 10},
    motion_environment="PSS5UPU",
    evaluations=24,
    family={"sampling": "coarse"},
    searches=1,
    starts=6,
    neighbours=8,
    rounds=2,
    thorough=(2, 4),
    coarse={"sampling": "coarse"},
    finer={"nodes": "fine"},  # between three levels one feasible design in 15 is singular
    splits={"train": 256, "val": 32, "test": 32, "ood": 32},
)

SKEW_TASK, SKEW_DESIGN = record(SkewTask), record(SkewDesign)
SKEW_UNDEFINED = undefined(SkewIndices)
