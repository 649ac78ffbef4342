"""The leg over the rectangle of its foot: forces, speeds, cylinders, gap and dead points."""

from __future__ import annotations

import math

import numpy as np

from pkm_gym.core.compile import formula, kernel
from pkm_gym.core.dimensions import SMALLEST, dimensions_violation
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.stroke_leg.declared import (
    GAIT_UNDEFINED,
    GaitDesign,
    GaitIndices,
    GaitLimits,
    GaitTask,
)
from pkm_gym.mechanisms.stroke_leg.kinematics import (
    Links,
    crank_angles,
    cylinder,
    cylinder_range,
    dead_point_margins,
    frame_side,
    gap_of,
)
from pkm_gym.mechanisms.stroke_leg.mechanism import angles_violation
from pkm_gym.mechanisms.stroke_leg.problem import DEAD

REACH_MARGIN = 1e-9  # a foot nearer to the stretched rhombi, as a share, is out of reach
BOUNDARY = ("s", "d", "thrust2", "thrust4", "rate2", "rate4", "gap")


def boundary(intervals: int) -> FloatArray:
    """Return the points (4 intervals, 2) of the unit square's edges."""
    t, zero = np.arange(intervals) / intervals, np.zeros(intervals)
    edges = [(t, zero), (zero + 1.0, t), (1.0 - t, zero + 1.0), (zero, 1.0 - t)]
    return np.concatenate([np.stack(edge, axis=-1) for edge in edges])


@formula
def sums(x: float, z: float, side: float) -> tuple[float, float, float, float]:
    """Return sin s, cos s, sin d, cos d of the foot: s = theta + varphi, d = theta - varphi."""
    radius = math.sqrt(x * x + z * z)
    cos_t = radius / (4.0 * side)
    sin_t = math.sqrt(1.0 - cos_t * cos_t)
    sin_v, cos_v = -x / radius, -z / radius
    return (
        sin_t * cos_v + cos_t * sin_v,
        cos_t * cos_v - sin_t * sin_v,
        sin_t * cos_v - cos_t * sin_v,
        cos_t * cos_v + sin_t * sin_v,
    )


@formula
def turned(sine: float, cosine: float, by_sine: float, by_cosine: float) -> tuple[float, float]:
    """Return sine and cosine of the sum of two angles."""
    return sine * by_cosine + cosine * by_sine, cosine * by_cosine - sine * by_sine


@kernel
def mean_square_force(
    low: tuple[float, float],
    size: tuple[float, float],
    side: float,
    links: Links,
    nodes: FloatArray,
    weights: FloatArray,
) -> float:
    """Return the mean of F2^2 + F4^2 over the rectangle for a unit vertical force on the foot."""
    l1, ob, theta_b, l5, l6, phi, gamma = links
    sin_a, cos_a = math.sin(phi + theta_b), math.cos(phi + theta_b)
    sin_g, cos_g = math.sin(-gamma), math.cos(-gamma)
    mean = 0.0
    for row in range(len(nodes)):
        z = low[1] + size[1] * nodes[row]
        for column in range(len(nodes)):
            x = low[0] + size[0] * nodes[column]
            sin_s, cos_s, sin_d, cos_d = sums(x, z, side)
            minus_cosine2, minus_sine2 = turned(sin_s, cos_s, sin_a, cos_a)
            cosine4, minus_sine4 = turned(sin_d, cos_d, sin_g, cos_g)
            _, k2 = cylinder(l1, ob, -minus_cosine2, -minus_sine2)
            _, k4 = cylinder(l5, l6, cosine4, -minus_sine4)
            by2, by4 = sin_s / k2, sin_d / k4
            mean += weights[row] * weights[column] * (by2 * by2 + by4 * by4)
    return 4.0 * side * side * mean


@formula
def cone_share(sine: float, cosine: float, sin_cone: float, cos_cone: float) -> float:
    """Return the largest |sin(angle + a)| for |a| within the cone."""
    across, along = abs(sine), abs(cosine)
    return 1.0 if along <= sin_cone else across * cos_cone + along * sin_cone


@kernel
def fill_boundary(
    low: tuple[float, float],
    size: tuple[float, float],
    side: float,
    cone: float,
    links: Links,
    edge: FloatArray,
    values: FloatArray,
) -> None:
    """Fill ``values`` (7, n) at n points of the rectangle's boundary, see ``BOUNDARY``.

    s and d (rad), the largest force of either cylinder within the cone, the speed of either piston,
    and the gap (m). Forces and speeds are of no meaning across a dead line.
    """
    l1, ob, theta_b, l5, l6, phi, gamma = links
    sin_b, cos_b = math.sin(theta_b), math.cos(theta_b)
    bx, bz = ob * cos_b, ob * sin_b
    sin_p, cos_p, sin_g, cos_g = math.sin(phi), math.cos(phi), math.sin(-gamma), math.cos(-gamma)
    sin_cone, cos_cone = math.sin(cone), math.cos(cone)
    for i in range(edge.shape[0]):
        x, z = low[0] + size[0] * edge[i, 0], low[1] + size[1] * edge[i, 1]
        sin_s, cos_s, sin_d, cos_d = sums(x, z, side)
        sin_a, cos_a = turned(sin_s, cos_s, sin_p, cos_p)
        sin_m, cos_m = turned(sin_d, cos_d, sin_g, cos_g)
        minus_cosine2, minus_sine2 = turned(sin_a, cos_a, sin_b, cos_b)
        _, k2 = cylinder(l1, ob, -minus_cosine2, -minus_sine2)
        _, k4 = cylinder(l5, l6, sin_m, -cos_m)
        by2, by4 = 2.0 * side / abs(k2), 2.0 * side / abs(k4)
        sin_2t = sin_s * cos_d + cos_s * sin_d
        values[0, i], values[1, i] = math.atan2(sin_s, cos_s), math.atan2(sin_d, cos_d)
        values[2, i] = by2 * cone_share(sin_s, cos_s, sin_cone, cos_cone)
        values[3, i] = by4 * cone_share(sin_d, cos_d, sin_cone, cos_cone)
        values[4, i], values[5, i] = 1.0 / (by2 * sin_2t), 1.0 / (by4 * sin_2t)
        values[6, i] = gap_of(sin_a, cos_a, sin_m, cos_m, bx, bz, links)


@kernel
def measure_one(
    design: GaitDesign,
    task: GaitTask,
    nodes: FloatArray,
    weights: FloatArray,
    edge: FloatArray,
    values: FloatArray,
) -> tuple[GaitIndices, GaitLimits, float]:
    """Return one design's indices, own limits, and > 0 where it is out of reach.

    Where the rhombi don't reach, or a crank crosses its dead line. Leaves what it saw on the
    boundary in ``values`` (7, n).
    """
    l1, l3, l6, side = design.l1, design.l3, design.l6, design.l
    impossible = dimensions_violation((l1, l3, l6, side), SMALLEST)
    impossible = max(impossible, angles_violation(design.phi, design.th3, design.gamma))
    if impossible > 0.0:
        return GAIT_UNDEFINED, GaitLimits(impossible, math.nan), 0.0
    half, hip, lift = 0.5 * task.stride, task.hip_height, task.lift
    far = math.hypot(abs(task.x0) + half, hip) / (4.0 * side)
    near = math.hypot(max(0.0, abs(task.x0) - half), hip - lift) / (4.0 * side)
    mount = l3 * math.sin(design.th3)
    reach = far - 1.0
    if reach > -REACH_MARGIN:
        return only_mount(mount), GaitLimits(impossible, reach), REACH_MARGIN + max(0.0, reach)

    ob, theta_b = frame_side(l3, l6, design.th3)
    links = (l1, ob, theta_b, l1, l6, design.phi, design.gamma)
    low, size = (task.x0 - half, -hip), (task.stride, lift)
    fill_boundary(low, size, side, task.cone, links, edge, values)
    s_min, s_max = values[0].min(), values[0].max()
    d_min, d_max = values[1].min(), values[1].max()
    A_short, A_long, D_short, D_long = dead_point_margins(s_min, s_max, d_min, d_max, links)
    a_max, at_d_min = crank_angles(s_min, d_min, theta_b, design.phi, design.gamma)
    a_min, at_d_max = crank_angles(s_max, d_max, theta_b, design.phi, design.gamma)
    l2_min, l2_max = cylinder_range(l1, ob, a_min, a_max)
    l4_min, l4_max = cylinder_range(l1, l6, at_d_min, at_d_max)
    margin = min(A_short, A_long, D_short, D_long)
    unreached = DEAD + max(0.0, -margin) if margin < DEAD else 0.0
    rms = thrust = rate = math.nan
    if unreached == 0.0:
        rms = math.sqrt(mean_square_force(low, size, side, links, nodes, weights))
        thrust = max(values[2].max(), values[3].max())
        rate = max(values[4].max(), values[5].max())
    indices = GaitIndices(
        thrust_rms=rms,
        thrust=thrust,
        rate=rate,
        gap=values[6].min(),
        mount=mount,
        stroke2=l2_max - l2_min,
        stroke4=l4_max - l4_min,
        l2_min=l2_min,
        l2_max=l2_max,
        l4_min=l4_min,
        l4_max=l4_max,
        theta_min=math.acos(far),
        theta_max=math.acos(near),
        dead_A_short=A_short,
        dead_A_long=A_long,
        dead_D_short=D_short,
        dead_D_long=D_long,
    )
    return indices, GaitLimits(dimensions=impossible, reach=reach), unreached


@kernel
def only_mount(mount: float) -> GaitIndices:
    """Return the indices of a leg whose foot doesn't reach the rectangle."""
    nan = math.nan
    return GaitIndices(
        nan, nan, nan, nan, mount, nan, nan, nan, nan, nan, nan, nan, nan, nan, nan, nan, nan
    )
