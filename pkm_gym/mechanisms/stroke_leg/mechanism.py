"""The leg as a Mechanism: dimensions in SI, the kinematic verbs, and where its foot goes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pkm_gym.core.compile import kernel
from pkm_gym.core.mechanism import IndexMap, Link, Mechanism, as_rows, dimension
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.stroke_leg.kinematics import (
    LOCAL_INDICES,
    Links,
    crank_angles_batch,
    cylinder_accelerations_batch,
    forward_kinematics_batch,
    frame_side,
    inverse_jacobian_batch,
    inverse_kinematics_batch,
    jacobian_batch,
    local_indices_batch,
    side_of_D,
)

MODES = ((1.0, -1.0), (1.0, 1.0), (-1.0, -1.0), (-1.0, 1.0))  # signs: A over OB, D over OC
BARREL = 0.75  # of a drawn cylinder, in the shortest lengths that its crank allows
LARGEST_ANGLES = {"phi": math.pi, "th3": math.pi, "gamma": 2.0 * math.pi}


@kernel
def angles_violation(phi: float, th3: float, gamma: float) -> float:
    """Return 1 where an angle lies outside its open range (0, pi), gamma's (0, 2 pi); else -1."""
    inside = 0.0 < phi < math.pi and 0.0 < th3 < math.pi and 0.0 < gamma < 2.0 * math.pi
    return -1.0 if inside else 1.0


def explain_angles(named: Mapping[str, float]) -> str:
    """Say in words which angle makes no machine, "" if all do."""
    for name, high in LARGEST_ANGLES.items():
        if not 0.0 < named[name] < high:
            return (
                f"dimensions: {name} = {np.degrees(named[name]):g} deg makes no machine: it must "
                f"lie between 0 and {np.degrees(high):g} deg"
            )
    return ""


DEAD_POINTS = {  # what they are at a pose
    "dead_A_short": "angle of OA to its dead line, cylinder AB short",
    "dead_A_long": "angle of OA to its dead line, cylinder AB long",
    "dead_D_short": "angle of OD to its dead line, cylinder CD short",
    "dead_D_long": "angle of OD to its dead line, cylinder CD long",
}


@dataclass(frozen=True, slots=True)
class Leg(Mechanism):
    """A leg: two cranks that cylinders turn, each one body with an upper link of the rhombi.

    Pose: (x, z) of the foot I, m, in the frame at the hip O with x from O to C and z up. Joints:
    the cylinders' lengths l2 = AB and l4 = CD, m. The twist is the foot's velocity, m/s.

    Home mode: A above OB; D below OC, or above with a gamma in the lower half (the twin design,
    gamma + 180 deg).
    """

    l1: float = dimension("m", "crank OA")
    l3: float = dimension("m", "frame link CB")
    l6: float = dimension("m", "frame link OC")
    phi: float = dimension("rad", "angle from OA to OF, one body", high=math.pi)
    th3: float = dimension("rad", "angle OCB", high=math.pi)
    gamma: float = dimension("rad", "angle from OD to OE, one body", high=2.0 * math.pi)
    l5: float = dimension("m", "crank OD")
    l: float = dimension("m", "side of the rhombi")

    pose_names = ("x", "z")
    twist_names = ("vx", "vz")
    joint_names = ("l_2", "l_4")
    joint_unit = "m"
    drawn_axes = ("x", "z")
    twin_module = "pkm_gym.mechanisms.stroke_leg.twin"
    work: ClassVar[float] = 0.15

    @property
    def geometry(self) -> Links:
        """What the kernels take: OA, OB and the angle of OB, OD, OC, phi, gamma."""
        ob, theta_b = frame_side(self.l3, self.l6, self.th3)
        return self.l1, ob, theta_b, self.l5, self.l6, self.phi, self.gamma

    # Positions ------------------------------------------------------------------------------------

    def inverse_kinematics(self, pose: FloatArray) -> FloatArray:
        """Return the cylinders' lengths (..., 2), m; NaN out of the rhombi's reach. Eqs (3)-(7)."""
        return self._batch(inverse_kinematics_batch, pose, (2,), self.l, self.geometry)

    def forward_kinematics(self, joints: FloatArray, near: FloatArray | None = None) -> FloatArray:
        """Return the foot (..., 2), m, of cylinders (..., 2); NaN where they don't fit.

        In the assembly mode of the poses ``near`` (..., 2), or in the home mode.
        """
        joints = as_rows(joints, 2)
        modes = self.home_mode if near is None else self.assembly_mode(near)
        joints, modes = (np.array(each) for each in np.broadcast_arrays(joints, modes))
        rows = np.ascontiguousarray(modes.reshape(-1, 2))
        return self._batch(forward_kinematics_batch, joints, (2,), rows, self.l, self.geometry)

    def all_assembly_modes(self, joints: FloatArray) -> FloatArray:
        """Return the foot (4, ..., 2), m, of cylinders (..., 2) in each mode of ``MODES``.

        NaN where a crank doesn't fit or the rhombi are folded through.
        """
        joints = as_rows(joints, 2)
        found = []
        for mode in MODES:
            rows = np.ascontiguousarray(np.broadcast_to(mode, joints.shape).reshape(-1, 2))
            found.append(
                self._batch(forward_kinematics_batch, joints, (2,), rows, self.l, self.geometry)
            )
        return np.stack(found)

    @property
    def home_mode(self) -> FloatArray:
        """The signs (2,) of the mode that the leg is built in: A over OB, D over OC."""
        return np.array([1.0, side_of_D(self.gamma)])

    def assembly_mode(self, pose: FloatArray) -> FloatArray:
        """Return on which side (..., 2) of their dead lines A and D are, +1 above and -1 below."""
        return np.where(np.sin(self.crank_angles(pose)) > 0.0, 1.0, -1.0)

    def crank_angles(self, pose: FloatArray) -> FloatArray:
        """Return the angles (..., 2), rad, from OB to OA and from OC to OD."""
        return self._batch(crank_angles_batch, pose, (2,), self.l, self.geometry)

    def dead_point_angles(self, pose: FloatArray) -> dict[str, FloatArray]:
        """Return how far (rad) the cranks are from their dead lines: name of the index -> (...).

        Negative across.
        """
        a, d = np.moveaxis(self.crank_angles(pose), -1, 0)
        centre = 0.5 * np.pi * self.home_mode[1]
        d = np.remainder(d - centre + np.pi, 2.0 * np.pi) - np.pi  # from where OD is square to OC
        d = 0.5 * np.pi + d * self.home_mode[1]
        return {
            "dead_A_short": np.asarray(a),
            "dead_A_long": np.asarray(np.pi - a),
            "dead_D_short": np.asarray(d),
            "dead_D_long": np.asarray(np.pi - d),
        }

    def opening(self, pose: FloatArray) -> FloatArray:
        """Return theta and varphi (..., 2), rad, of the foot (..., 2). Eq. (3)."""
        x, z = np.moveaxis(as_rows(pose, 2), -1, 0)
        cosine = np.hypot(x, z) / (4.0 * self.l)
        inside = (cosine > 0.0) & (cosine < 1.0)
        theta = np.arccos(np.where(inside, cosine, np.nan))
        return np.stack([theta, np.where(inside, np.arctan2(-x, -z), np.nan)], axis=-1)

    def foot(self, opening: FloatArray) -> FloatArray:
        """Return the foot (..., 2), m, at theta and varphi (..., 2), rad. Eq. (3)."""
        theta, varphi = np.moveaxis(as_rows(opening, 2), -1, 0)
        radius = -4.0 * self.l * np.cos(theta)
        return np.stack([radius * np.sin(varphi), radius * np.cos(varphi)], axis=-1)

    # Velocities, accelerations and forces ---------------------------------------------------------

    def jacobian(self, pose: FloatArray) -> FloatArray:
        """Return J (..., 2, 2): foot velocity = J @ cylinder rates. Eq. (16), corrected."""
        return self._batch(jacobian_batch, pose, (2, 2), self.l, self.geometry)

    def inverse_jacobian(self, pose: FloatArray) -> FloatArray:
        """Return (..., 2, 2): cylinder rates = inverse_jacobian @ foot velocity."""
        return self._batch(inverse_jacobian_batch, pose, (2, 2), self.l, self.geometry)

    def twist(self, pose: FloatArray, pose_rate: FloatArray) -> FloatArray:
        """Return the foot's velocity, which is the rate of the pose."""
        del pose
        return np.array(pose_rate, dtype=float)

    def cylinder_accelerations(
        self, pose: FloatArray, velocity: FloatArray, acceleration: FloatArray
    ) -> FloatArray:
        """Return the accelerations (..., 2), m/s^2, of the pistons of a motion of the foot."""
        motion = np.concatenate(np.broadcast_arrays(pose, velocity, acceleration), axis=-1)
        return self._batch(
            cylinder_accelerations_batch, motion, (2,), self.l, self.geometry, length=6
        )

    def cylinder_forces(self, pose: FloatArray, force: FloatArray) -> FloatArray:
        """Return the forces (..., 2), N, of the cylinders that hold a force (..., 2) on the foot.

        F = -J^T f, > 0 where the cylinder pushes; links without weight.
        """
        return -np.einsum("...ji,...j->...i", self.jacobian(pose), np.asarray(force, dtype=float))

    def foot_force(self, pose: FloatArray, forces: FloatArray) -> FloatArray:
        """Return the force (..., 2), N, on the foot that cylinder forces (..., 2) hold."""
        inverse = self.inverse_jacobian(pose)
        return -np.einsum("...ji,...j->...i", inverse, np.asarray(forces, dtype=float))

    # Local indices --------------------------------------------------------------------------------

    def local_indices(self, pose: FloatArray) -> dict[str, FloatArray]:
        """Return the local indices at poses (..., 2): name -> (...), see ``LOCAL_INDICES``."""
        table = self._batch(local_indices_batch, pose, (len(LOCAL_INDICES),), self.l, self.geometry)
        return {name: table[..., k] for k, name in enumerate(LOCAL_INDICES)}

    def index_maps(self, pose: FloatArray) -> dict[str, IndexMap]:
        """Return what all legs have in common at poses (..., 2): cylinders, gap, dead points."""
        lengths = self.inverse_kinematics(pose)
        maps = {
            "gap": IndexMap(
                "gap",
                "m",
                "min",
                self.local_indices(pose)["gap"],
                doc="distance of the cylinders' axes",
            ),
            **{
                name: IndexMap(name, "rad", "min", values, doc=DEAD_POINTS[name])
                for name, values in self.dead_point_angles(pose).items()
            },
        }
        for k, (name, cylinder) in enumerate((("l2", "AB"), ("l4", "CD"))):
            for kind in ("min", "max"):
                maps[f"{name}_{kind}"] = IndexMap(
                    name, "m", kind, lengths[..., k], doc=f"length of the cylinder {cylinder}"
                )
        return maps

    # How it is drawn ------------------------------------------------------------------------------

    def points(self, pose: FloatArray) -> dict[str, FloatArray]:
        """Return the joints' centres (..., 2), m, by the paper's letter, at poses (..., 2)."""
        pose = as_rows(pose, 2)
        theta, varphi = np.moveaxis(self.opening(pose), -1, 0)
        beta = 1.5 * np.pi - varphi - theta
        alpha = 1.5 * np.pi - varphi + theta
        origin = np.zeros_like(pose)
        _, ob, theta_b, *_ = self.geometry
        f, e = self.l * _unit(beta), self.l * _unit(alpha)
        g = f + e
        return {
            "O": origin,
            "C": origin + np.array([self.l6, 0.0]),
            "B": origin + ob * _unit(np.asarray(theta_b)),
            "A": self.l1 * _unit(beta - self.phi),
            "D": self.l5 * _unit(alpha - self.gamma),
            "F": f,
            "E": e,
            "G": g,
            "J": f + 2.0 * e,
            "H": e + 2.0 * f,
            "I": 2.0 * g,
        }

    def links(self, pose: FloatArray) -> tuple[Link, ...]:
        """Return the frame, the cylinders, the cranks with their upper links, and the rhombi."""
        at = self.points(np.asarray(pose, dtype=float))

        def line(names: str) -> FloatArray:
            return np.stack([at[name] for name in names])

        return (
            Link("base", line("OCB")),
            *(Link("rod", line(names)) for names in ("FJ", "EH", "JI", "HI")),
            Link("cylinder", _with_barrel(line("BA"), self.geometry[1] - self.l1)),
            Link("cylinder", _with_barrel(line("CD"), self.l6 - self.l5)),
            *(Link("arm", line(names)) for names in ("AOF", "DOE")),
            Link("platform", at["I"][None]),
        )


def _with_barrel(ends: FloatArray, shortest: float) -> FloatArray:
    """Return a cylinder (3, 2) of its two ends: the barrel fits into its shortest length."""
    along = ends[1] - ends[0]
    tip = ends[0] + BARREL * abs(shortest) * along / np.linalg.norm(along)
    return np.stack([ends[0], tip, ends[1]])


def _unit(angle: FloatArray) -> FloatArray:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)
