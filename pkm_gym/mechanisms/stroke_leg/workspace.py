"""The leg with what its foot must reach: a rectangle of opening and swing, or one of the foot."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pkm_gym.core.mechanism import IndexMap, dimension
from pkm_gym.core.sampling import rectangle
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.stroke_leg.mechanism import Leg

EDGE = 40  # steps along an edge that is drawn


@dataclass(frozen=True, slots=True)
class StrokeLeg(Leg):
    """A leg with the paper's workspace: theta_min to theta_max, varphi to either side."""

    theta_min: float = dimension("rad", "smallest half opening angle", high=0.5 * math.pi)
    theta_max: float = dimension("rad", "largest half opening angle", high=0.5 * math.pi)
    swing: float = dimension("rad", "swing to either side", high=math.pi)

    def index_maps(self, pose: FloatArray) -> dict[str, IndexMap]:
        """Return condition number, force, cylinders, gap and dead points at poses (..., 2).

        Condition number and force are undefined across a dead line.
        """
        local = self.local_indices(pose)
        maps = super(StrokeLeg, self).index_maps(pose)
        margins = [maps[name].values for name in ("dead_A_short", "dead_A_long")]
        margins += [maps[name].values for name in ("dead_D_short", "dead_D_long")]
        inside = np.minimum.reduce(margins) > 0.0
        eta = np.where(inside, local["eta"], np.nan)
        force = np.where(inside, local["sigma_max"], np.nan)
        return {
            "eta_P": IndexMap("eta", "", "mean", eta, doc="condition number of J"),
            "force": IndexMap(
                "sigma_max",
                "",
                "max",
                force,
                doc="largest force of the cylinders (norm) for a unit force on the foot",
            ),
            "eta_DL": IndexMap("eta", "", "min", eta, drawn=False),
            **maps,
        }

    def workspace(self) -> FloatArray:
        """Return the crown's outline (n, 2), m."""
        t, v = (self.theta_min, self.theta_max), (-self.swing, self.swing)
        corners = np.array([(t[0], v[1]), (t[0], v[0]), (t[1], v[0]), (t[1], v[1]), (t[0], v[1])])
        return self.foot(_edges(corners))

    def workspace_grid(self, columns: int, rows: int) -> FloatArray:
        """Return poses (rows, columns, 2), m: theta falls from row to row, varphi along one."""
        low, high = (self.swing, self.theta_min), (-self.swing, self.theta_max)
        return self.foot(rectangle(low, high, columns, rows)[..., ::-1])

    def search_poses(self) -> FloatArray:
        """Return poses (n, 2), m, all over the crown, its corners among them."""
        return self.workspace_grid(61, 61).reshape(-1, 2)

    def sample_poses(self) -> FloatArray:
        """Return the middle, and the corners with the longest cylinders (3, 2), m."""
        middle = 0.5 * (self.theta_min + self.theta_max)
        low, high = self.theta_min, self.theta_max
        return self.foot(np.array([(middle, 0.0), (low, -self.swing), (high, self.swing)]))

    def place(self, pose: FloatArray) -> str:
        """Return in words where a pose (2,) is."""
        theta, varphi = np.degrees(self.opening(pose)).tolist()
        return f"at theta = {theta:.1f} deg, varphi = {varphi + 0.0:.1f} deg"


@dataclass(frozen=True, slots=True)
class GaitLeg(Leg):
    """A leg with the rectangle that its foot moves in: ``stride`` by ``lift`` over the ground."""

    stride: float = dimension("m", "length of the foot's rectangle")
    lift: float = dimension("m", "height of the foot's rectangle")
    hip_height: float = dimension("m", "height of the hip over the ground")
    x0: float = dimension("m", "middle of the rectangle before the hip", low=-1e6)
    cone: float = dimension(
        "rad", "largest angle of the ground's force to the vertical", low=-1e-9, high=0.5 * math.pi
    )

    def index_maps(self, pose: FloatArray) -> dict[str, IndexMap]:
        """Return thrust, rate, opening, cylinders, gap and dead points at poses (..., 2)."""
        theta = self.opening(pose)[..., 0]
        vertical = self.cylinder_forces(pose, np.array([0.0, 1.0]))
        return {
            "thrust_rms": IndexMap(
                "cylinder forces",
                "",
                "mean",
                np.linalg.norm(vertical, axis=-1),
                doc="cylinders' forces (norm) for a unit vertical force",
            ),
            "thrust": IndexMap(
                "thrust",
                "",
                "max",
                self.largest_thrust(pose),
                doc="largest force of a cylinder for a unit force within the cone",
            ),
            "rate": IndexMap(
                "rate",
                "",
                "max",
                self.local_indices(pose)["rate"],
                doc="largest speed of a piston for a unit speed of the foot",
            ),
            "theta_min": IndexMap(
                "theta", "rad", "min", theta, doc="half opening angle of the rhombi"
            ),
            "theta_max": IndexMap("theta", "rad", "max", theta, drawn=False),
            **super(GaitLeg, self).index_maps(pose),
        }

    def largest_thrust(self, pose: FloatArray) -> FloatArray:
        """Return the largest force (...) of a cylinder for a unit force on the foot in the cone."""
        jacobian = self.jacobian(pose)
        length = np.linalg.norm(jacobian, axis=-2)  # of a cylinder's column
        from_vertical = np.arctan2(np.abs(jacobian[..., 0, :]), np.abs(jacobian[..., 1, :]))
        return np.asarray(
            (length * np.cos(np.maximum(0.0, from_vertical - self.cone))).max(axis=-1)
        )

    @property
    def _corners(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The rectangle's low and high x and z, m."""
        half, ground = 0.5 * self.stride, -self.hip_height
        return (self.x0 - half, ground), (self.x0 + half, ground + self.lift)

    def workspace(self) -> FloatArray:
        """Return the rectangle's outline (5, 2), m."""
        (left, bottom), (right, top) = self._corners
        corners = [(left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)]
        return np.array(corners)

    def workspace_grid(self, columns: int, rows: int) -> FloatArray:
        """Return poses (rows, columns, 2), m, from the bottom left corner to the top right one."""
        return rectangle(*self._corners, columns, rows)

    def search_poses(self) -> FloatArray:
        """Return poses (n, 2), m, all over the rectangle."""
        return self.workspace_grid(49, 49).reshape(-1, 2)

    def sample_poses(self) -> FloatArray:
        """Return the middle of the rectangle and two opposite corners (3, 2), m."""
        (left, bottom), (right, top) = self._corners
        return np.array([(self.x0, 0.5 * (bottom + top)), (left, bottom), (right, top)])


def _edges(corners: FloatArray) -> FloatArray:
    """Return points (n, 2) along the straight lines between corners (k, 2)."""
    t = np.arange(EDGE)[:, None] / EDGE
    sides = [(1.0 - t) * a + t * b for a, b in pairwise(corners)]
    return np.concatenate([*sides, corners[-1:]])
