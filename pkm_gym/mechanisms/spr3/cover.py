"""Covering a cylinder: what the 3-SPR needs for it, and how well it is conditioned there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pkm_gym.core.compile import kernel
from pkm_gym.core.mechanism import IndexMap, dimension
from pkm_gym.core.sampling import lowest_of_five, rectangle
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.box import SMALLEST_PART
from pkm_gym.mechanisms.spr3.indices import conditioning_of, projections_of
from pkm_gym.mechanisms.spr3.kinematics import fold_margin
from pkm_gym.mechanisms.spr3.lockstep import Lanes, legs_of, solve_places
from pkm_gym.mechanisms.spr3.mechanism import LCI, Spr3
from pkm_gym.mechanisms.spr3.words import position

SIXTH = math.pi / 3.0  # of a turn: by symmetry the rest of the cylinder is the same

# Where extremes lie, in units of radius and half height around the centre: five points each of the
# near rim, the near radius under leg 3 and the far rim, and the far end's centre. Kernels take them
# as an argument: a loop whose few rounds are known beforehand isn't vectorised.
FIFTHS = np.linspace(0.0, 1.0, 5)
RIM = np.stack([np.cos(SIXTH * FIFTHS), np.sin(SIXTH * FIFTHS)], axis=-1)
LOOKS = np.array(
    [(x, y, -1.0) for x, y in RIM] + [(x, 0.0, -1.0) for x in FIFTHS]
    + [(x, y, 1.0) for x, y in RIM] + [(0.0, 0.0, 1.0)]
)  # fmt: skip


@kernel
def _look(
    at: FloatArray,
    count: int,
    a: float,
    b: float,
    z_c: float,
    radius: float,
    height: float,
    lanes: Lanes,
    extremes: FloatArray,
) -> None:
    """Keep the extremes over the first ``count`` of points ``at`` (n, 3), in ``LOOKS``'s units.

    ``extremes`` (7,): positions looked at, the sum of the shares of the way there, smallest det J,
    shortest and longest leg (m), smallest S cosine, smallest margin to the fold.
    """
    n = at.shape[0]
    for k in range(n):
        place = lanes.places[k]
        place.x, place.y = radius * at[k, 0], radius * at[k, 1]
        place.z = z_c + 0.5 * height * at[k, 2]
    solve_places(lanes, n, b)
    conditioning_of(lanes, n, a, b, 0.0, 1.0)
    projections_of(lanes, n, a, b)
    legs_of(lanes, n, a, b)
    extremes[0] += count
    for k in range(count):
        pose, leg = lanes.poses[k], lanes.legs[k]
        extremes[1] += pose.done
        if pose.done < 1.0:
            continue
        extremes[2] = min(extremes[2], lanes.local[k].det)
        extremes[3] = min(extremes[3], leg.q1, leg.q2, leg.q3)
        extremes[4] = max(extremes[4], leg.q1, leg.q2, leg.q3)
        extremes[5] = min(extremes[5], lanes.joints[k].s_cos)
        extremes[6] = min(extremes[6], fold_margin(pose.hx, pose.hy, pose.s, b))


@kernel
def cylinder_extremes(
    a: float,
    b: float,
    z_c: float,
    radius: float,
    height: float,
    looks: FloatArray,
    lanes: Lanes,
    extremes: FloatArray,
) -> None:
    """Fill ``extremes`` (7,), see ``_look``, over a cylinder, from ``LOOKS``.

    For the shortest leg and the S angle it is looked at once more between the samples.
    """
    extremes[:] = 0.0
    extremes[2] = extremes[3] = extremes[5] = extremes[6] = math.inf
    _look(looks, looks.shape[0], a, b, z_c, radius, height, lanes, extremes)
    if extremes[1] == extremes[0]:
        shortest, cosines = np.empty(5), np.empty(5)
        for k in range(5):
            leg = lanes.legs[5 + k]
            shortest[k], cosines[k] = min(leg.q1, leg.q2, leg.q3), lanes.joints[k].s_cos
        azimuth = 0.25 * lowest_of_five(cosines)[1] * SIXTH
        again = np.zeros_like(looks)  # the others stay at the centre
        again[:2, 2] = -1.0
        again[0, 0] = 0.25 * lowest_of_five(shortest)[1]
        again[1, 0], again[1, 1] = math.cos(azimuth), math.sin(azimuth)
        _look(again, 2, a, b, z_c, radius, height, lanes, extremes)


@kernel
def cylinder_mean(
    a: float,
    b: float,
    z_c: float,
    radius: float,
    height: float,
    length: float,
    spin: float,
    nodes: FloatArray,
    weights: FloatArray,
    lanes: Lanes,
) -> tuple[float, float]:
    """Return the smallest det J and the mean conditioning index over nodes of the cylinder.

    ``nodes`` (k, 3) and ``weights`` (k,) are those of ``triangular_cylinder``. The index has a cusp
    at the isotropic pose z = b / sqrt(2): where the cylinder holds it, it is cut there in two.
    """
    near, far = z_c - 0.5 * height, z_c + 0.5 * height
    cut = far
    if length == 0.0:
        cut = min(far, max(near, b * math.sqrt(0.5)))
    det, mean, count = math.inf, 0.0, nodes.shape[0]
    for start, end in ((near, cut), (cut, far)):
        part = (end - start) / height
        if part < SMALLEST_PART:
            continue
        for k in range(count):
            place = lanes.places[k]
            place.x, place.y = radius * nodes[k, 0], radius * nodes[k, 1]
            place.z = 0.5 * (start + end + (end - start) * nodes[k, 2])
        solve_places(lanes, count, b)
        conditioning_of(lanes, count, a, b, length, spin)
        for k in range(count):
            if lanes.poses[k].done < 1.0:
                return -math.inf, math.nan
            det = min(det, lanes.local[k].det)
            mean += part * weights[k] * lanes.local[k].lci
    return det, mean


@dataclass(frozen=True, slots=True)
class CylinderSpr3(Spr3):
    """A 3-SPR with just the legs that a cylinder of positions asks for."""

    z_c: float = dimension("m", "height of the cylinder's centre over the fixed platform")
    radius: float = dimension("m", "radius of the cylinder")
    height: float = dimension("m", "height of the cylinder")

    range_slack: ClassVar[float] = 1e-4  # the legs' range is that of samples

    def workspace(self) -> FloatArray:
        """Return the cylinder's outline (5, 2) in the mirror plane of leg 3, m."""
        near, far = self.z_c - 0.5 * self.height, self.z_c + 0.5 * self.height
        r = self.radius
        return np.array([(-r, near), (r, near), (r, far), (-r, far), (-r, near)])

    def workspace_grid(self, columns: int, rows: int) -> FloatArray:
        """Return poses (rows, columns, 3) over the cylinder's section by that plane."""
        near, far = self.z_c - 0.5 * self.height, self.z_c + 0.5 * self.height
        points = rectangle((-self.radius, near), (self.radius, far), columns, rows)
        return self.pose_at(np.insert(points, 1, 0.0, axis=-1))

    def cylinder_points(self) -> FloatArray:
        """Return positions (n, 3), m, over a third of the cylinder's ends and their rims."""
        ends = self.z_c + 0.5 * self.height * np.array([-1.0, 1.0])
        radii, azimuths, z = np.meshgrid(
            np.linspace(0.0, self.radius, 5), np.linspace(0.0, 2.0 * SIXTH, 9), ends
        )
        points = np.stack([radii * np.cos(azimuths), radii * np.sin(azimuths), z], axis=-1)
        return points.reshape(-1, 3)

    def sample_poses(self) -> FloatArray:
        """Return the poses at the centre and at two opposite ends of the rims (3, 3)."""
        r, half = self.radius, 0.5 * self.height
        ends = [(0.0, 0.0, self.z_c), (r, 0.0, self.z_c - half), (-r, 0.0, self.z_c + half)]
        return self.pose_at(np.array(ends))

    def search_poses(self) -> FloatArray:
        """Return poses (n, 3) over the cylinder's ends and rims, where extremes lie."""
        return self.pose_at(self.cylinder_points())

    def place(self, pose: FloatArray) -> str:
        """Return in words where the platform's centre is at a pose (3,)."""
        return f"at {position(self.position(pose))}"

    def index_maps(self, pose: FloatArray, jacobian: str = "velocity") -> dict[str, IndexMap]:
        """Return the local indices at poses (..., 3), NaN out of reach.

        The S joints' largest angle may lie outside the section that is drawn.
        """
        lengths = self.inverse_kinematics(pose)
        local = self._local_within_reach(pose, jacobian)
        return {
            "gci": IndexMap("lci", "", "mean", local["lci"], doc=LCI),
            "q_min": IndexMap(
                "q", "m", "min", lengths.min(axis=-1), doc="shortest of the three legs"
            ),
            "q_max": IndexMap(
                "q", "m", "max", lengths.max(axis=-1), doc="longest of the three legs"
            ),
            "det": IndexMap("det", "", "min", local["det"], drawn=False),
            "s_angle": IndexMap("s_angle", "rad", "max", local["s_angle"], drawn=False),
        }
