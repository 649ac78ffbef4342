"""The 6-PUS as a Mechanism: dimensions in SI, the kinematic verbs, and the box it works in."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pkm_gym.core.compile import kernel
from pkm_gym.core.mechanism import IndexMap, Link, Mechanism, Symmetry, as_rows, dimension
from pkm_gym.core.names import check_known
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pus6.coefficients import (
    first_order_batch,
    inverse_batch,
    second_order_batch,
)
from pkm_gym.mechanisms.pus6.declared import CONVENTIONS
from pkm_gym.mechanisms.pus6.indices import BLOCK, LOCAL, POSE_WORK, states_of, tabulate
from pkm_gym.mechanisms.pus6.kinematics import (
    PER_LEG,
    forward_kinematics_batch,
    home_drop,
    inverse_kinematics_batch,
    lay_out,
    legs_batch,
)
from pkm_gym.mechanisms.pus6.limits import PER_NODE, limits_batch

LARGEST_ANGLE = 2.0 * math.pi / 3.0  # between two screws or two joints of a third
LEVELS = (-1.0, 0.0, 1.0)
NAMES = ("eta_omega", "eta_v", "eta_alpha", "eta_a", "eta_F", "eta_I")
WORDS = {  # what they are at a pose
    "eta_omega": "angular velocity, 1 / K of the pose",
    "eta_v": "linear velocity, 1 / K of the pose",
    "eta_alpha": "angular acceleration, 1 / K of the pose",
    "eta_a": "linear acceleration, 1 / K of the pose",
    "eta_F": "force and torque, 1 / K of the pose",
    "eta_I": "inertia force, 1 / K of the pose",
}


@kernel
def angles_violation(phi_A: float, phi_C: float) -> float:
    """Return 1 where an angle lies outside its open range (0, 120 deg), else -1."""
    inside = 0.0 < phi_A < LARGEST_ANGLE and 0.0 < phi_C < LARGEST_ANGLE
    return -1.0 if inside else 1.0


def explain_angles(named: Mapping[str, float]) -> str:
    """Say in words which angle makes no machine, "" if both do."""
    for name in ("phi_A", "phi_C"):
        if not 0.0 < named[name] < LARGEST_ANGLE:
            return (
                f"dimensions: {name} = {np.degrees(named[name]):g} deg makes no machine: it must "
                "lie between 0 and 120 deg"
            )
    return ""


@dataclass(frozen=True, slots=True)
class Pus6(Mechanism):
    """A 6-PUS with the box that its tool's tip works in.

    Pose: (x, y, z, alpha, beta, gamma), m and rad, of the tool's tip from home, where the platform
    is level; the rotation is Rx(alpha) Ry(beta) Rz(gamma). Twist: (omega, v), rad/s and m/s, v of
    the tip: not the rate of the pose. Joints: the sliders' heights over those of home, m.
    """

    L: float = dimension("m", "length of the rods")
    R: float = dimension("m", "radius of the S joints")
    r_B: float = dimension("m", "radius of the screws", default=0.38)
    phi_A: float = dimension(
        "rad", "angle between the screws of a column", high=LARGEST_ANGLE, default=math.radians(15)
    )
    phi_C: float = dimension(
        "rad", "angle between the S joints of a corner", high=LARGEST_ANGLE,
        default=math.radians(30),
    )  # fmt: skip
    tool: float = dimension("m", "length of the tool", low=-1e-12, default=0.0)
    xy: float = dimension("m", "half the box's width", default=0.05)
    z: float = dimension("m", "half the box's height", low=-1e-12, default=0.03)
    tilt: float = dimension("rad", "largest tilt", high=math.pi / 2, default=math.radians(10))
    spin: float = dimension("rad", "largest spin", high=math.pi, default=math.radians(10))
    characteristic_length: float = dimension("m", "unit of length of eta_F, eta_I", default=0.01)

    pose_names = ("x", "y", "z", "alpha", "beta", "gamma")
    twist_names = ("wx", "wy", "wz", "vx", "vy", "vz")
    joint_names = ("q_1", "q_2", "q_3", "q_4", "q_5", "q_6")
    joint_unit = "m"
    twin_module = "pkm_gym.mechanisms.pus6.twin"
    work: ClassVar[float] = 1.0

    @property
    def layout(self) -> FloatArray:
        """What the kernels take (30,): of each leg the S joint on the platform and the screw, m."""
        layout = np.empty(6 * PER_LEG)
        lay_out(layout, self.R, self.r_B, self.phi_A, self.phi_C, self.tool)
        return layout

    @property
    def h0(self) -> float:
        """How far a slider is above its S joint at home, m; NaN where the rods don't reach."""
        return float(home_drop(self.L, self.R, self.r_B, self.phi_A, self.phi_C))

    @property
    def home(self) -> float:
        """The height of all sliders at home over the tool's tip, m."""
        return self.h0 + self.tool

    # Positions ------------------------------------------------------------------------------------

    def inverse_kinematics(self, pose: FloatArray) -> FloatArray:
        """Return the sliders (..., 6), m, over those of home; NaN out of the rods' reach."""
        return self._batch(inverse_kinematics_batch, pose, (6,), self.layout, self.L, self.home)

    def forward_kinematics(self, joints: FloatArray, near: FloatArray | None = None) -> FloatArray:
        """Return the pose (..., 6) of sliders (..., 6), on the branch of ``near`` or of home.

        Follows the straight path of the sliders from ``near`` (..., 6); NaN where a direct
        singularity bars it.
        """
        start = np.zeros(6) if near is None else near
        joints, start = np.broadcast_arrays(as_rows(joints, 6), as_rows(start, 6))
        joints, rows = joints.copy(), start.reshape(-1, 6).copy()
        return self._batch(
            forward_kinematics_batch, joints, (6,), rows, self.layout, self.L, self.home
        )

    def rotation(self, pose: FloatArray) -> FloatArray:
        """Return the platform's axes as the columns of (..., 3, 3)."""
        from scipy.spatial.transform import Rotation

        rows = as_rows(pose, 6)
        turned = Rotation.from_euler("XYZ", rows[..., 3:].reshape(-1, 3)).as_matrix()
        return np.asarray(turned).reshape(*rows.shape[:-1], 3, 3)

    # Velocities, accelerations and forces ---------------------------------------------------------

    def jacobian(self, pose: FloatArray) -> FloatArray:
        """Return G (..., 6, 6): twist = G @ slider rates, angular rows first (rad/m)."""
        return self._batch(first_order_batch, pose, (6, 6), self.layout, self.L)

    def inverse_jacobian(self, pose: FloatArray) -> FloatArray:
        """Return G^-1 (..., 6, 6): slider rates = G^-1 @ twist."""
        return self._batch(inverse_batch, pose, (6, 6), self.layout, self.L)

    def hessian(self, pose: FloatArray, convention: str = "influence") -> FloatArray:
        """Return H (..., 6, 6, 6): acceleration = G q'' + q'^T H q', slices rad/m^2 and 1/m.

        ``convention``: "influence", of limb screws, as the paper's numbers need it, whose angular
        slices hold a skew part that does no work; or "symmetric", the Hessian of the motion.
        """
        check_known("convention", [convention], CONVENTIONS)
        skew = 1.0 if convention == "influence" else 0.0
        return self._batch(second_order_batch, pose, (6, 6, 6), self.layout, self.L, skew)

    def acceleration(
        self, pose: FloatArray, rates: FloatArray, accelerations: FloatArray
    ) -> FloatArray:
        """Return the twist's rate (..., 6) at slider rates and accelerations (..., 6)."""
        steady = np.einsum("...i,...kij,...j->...k", rates, self.hessian(pose, "symmetric"), rates)
        return steady + np.einsum("...ki,...i->...k", self.jacobian(pose), accelerations)

    def twist(self, pose: FloatArray, pose_rate: FloatArray) -> FloatArray:
        """Return (omega, v) (..., 6) of a pose that changes at ``pose_rate`` (..., 6)."""
        pose, rate = np.broadcast_arrays(as_rows(pose, 6), as_rows(pose_rate, 6))
        alpha, beta = pose[..., 3], pose[..., 4]
        x, y, z, a, b, g = np.moveaxis(rate, -1, 0)
        omega = (
            a + g * np.sin(beta),
            b * np.cos(alpha) - g * np.sin(alpha) * np.cos(beta),
            b * np.sin(alpha) + g * np.cos(alpha) * np.cos(beta),
        )
        return np.stack([*omega, x, y, z], axis=-1)

    def slider_forces(self, pose: FloatArray, wrench: FloatArray) -> FloatArray:
        """Return the forces (..., 6), N, of the sliders for a wrench (moment, force) (..., 6).

        That the platform exerts on its surroundings at the tool's tip: tau = G^T W.
        """
        wrench = np.asarray(wrench, dtype=float)
        return np.einsum("...ki,...k->...i", self.jacobian(pose), wrench)

    def force_matrix(self, pose: FloatArray) -> FloatArray:
        """Return G^F (..., 6, 6): wrench = G^F @ slider forces, G^F = G^-T."""
        return np.swapaxes(self.inverse_jacobian(pose), -1, -2)

    # Local indices --------------------------------------------------------------------------------

    def local_indices(
        self,
        pose: FloatArray,
        characteristic_length: float | None = None,
        convention: str = "influence",
    ) -> dict[str, FloatArray]:
        """Return 1/K of the six indices (...) at poses (..., 6), and det G^-1 (m^3) as "det".

        ``characteristic_length``, m: the machine's if not given.
        """
        check_known("convention", [convention], CONVENTIONS)
        skew = 1.0 if convention == "influence" else 0.0
        rows = as_rows(pose, 6)
        flat = np.ascontiguousarray(rows.reshape(-1, 6)[:, [0, 1, 3, 4, 5]])
        states = states_of(flat)
        tables = np.empty((1, len(states), LOCAL * BLOCK))
        unit = characteristic_length or self.characteristic_length
        square, length = np.array([self.L**2]), np.array([float(unit)])
        tabulate(
            POSE_WORK * len(flat), states[None], self.layout[None], square, length, skew, tables
        )
        table = tables.reshape(-1, LOCAL, BLOCK).swapaxes(0, 1).reshape(LOCAL, -1)[:, : len(flat)]
        return {
            name: values.reshape(rows.shape[:-1])
            for name, values in zip((*NAMES, "det"), table, strict=True)
        }

    def local_limits(self, pose: FloatArray) -> dict[str, FloatArray]:
        """Return rod tilt and S joint angle (rad), clearance (m) and aspect (...) at poses."""
        table = self._batch(limits_batch, pose, (PER_NODE,), self.layout, self.L)
        flat, _, _, cosine, near, aspect = np.moveaxis(table, -1, 0)
        inside = flat < self.L**2
        return {
            "rod_tilt": np.arcsin(np.where(inside, np.sqrt(flat) / self.L, np.nan)),
            "s_cone": np.arccos(np.minimum(1.0, np.where(inside, cosine, np.nan) / self.L**2)),
            "clearance": np.sqrt(np.where(inside, near, np.nan)),
            "aspect": np.where(inside, aspect, np.nan),
        }

    def index_maps(self, pose: FloatArray) -> dict[str, IndexMap]:
        """Return the local indices at poses (..., 6), by the name of the design's index."""
        return self.chosen_maps(pose, "influence")

    def chosen_maps(self, pose: FloatArray, convention: str) -> dict[str, IndexMap]:
        """Return the same with a convention."""
        units = {"rod_tilt": "rad", "s_cone": "rad", "clearance": "m", "aspect": ""}
        most = ("rod_tilt", "s_cone")
        local = self.local_indices(pose, convention=convention)
        means = {name: IndexMap(name, "", "mean", local[name], doc=WORDS[name]) for name in NAMES}
        limits = {  # their extremes stand at the box's corners: a picture shows one orientation
            name: IndexMap(name, units[name], "max" if name in most else "min", values, drawn=False)
            for name, values in self.local_limits(pose).items()
        }
        return means | limits

    def symmetries(self) -> tuple[Symmetry, ...]:
        """Return the mirror x -> -x, which exchanges the legs 1 and 2, 3 and 6, 4 and 5."""
        signs = np.array([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])
        return (
            Symmetry(
                "mirror image in x",
                lambda pose: np.asarray(pose, dtype=float) * signs,
                lambda joints: np.asarray(joints, dtype=float)[..., [1, 0, 5, 4, 3, 2]],
            ),
        )

    # Its box, and how it is drawn -----------------------------------------------------------------

    def in_box(self, unit: FloatArray) -> FloatArray:
        """Return poses (..., 6) of the box at shares (..., 6) of its half widths, -1 to 1."""
        half = (self.xy, self.xy, self.z, self.tilt, self.tilt, self.spin)
        return np.asarray(unit, dtype=float) * half

    def search_poses(self) -> FloatArray:
        """Return the nodes (n, 6) that the limits are looked for at, on both sides."""
        grid = np.meshgrid(LEVELS, LEVELS, (0.0,), LEVELS, LEVELS, LEVELS, indexing="ij")
        return self.in_box(np.stack(grid, axis=-1).reshape(-1, 6))

    def sample_poses(self) -> FloatArray:
        """Return home and two corners of the box (3, 6)."""
        return self.in_box(np.array([[0.0] * 6, [1, -1, 1, 1, 1, -1], [-1, 1, -1, -1, -1, 1]]))

    def workspace(self) -> FloatArray:
        """Return the box's outline (n, 2) from above, m."""
        corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)])
        return self.xy * corners

    def workspace_grid(self, columns: int, rows: int) -> FloatArray:
        """Return poses (rows, columns, 6) over x and y, half tilted and half turned."""
        x, y = np.meshgrid(np.linspace(-1, 1, columns), np.linspace(-1, 1, rows))
        half = np.full_like(x, 0.5)
        return self.in_box(np.stack([x, y, np.zeros_like(x), half, half, half], axis=-1))

    def points(self, pose: FloatArray) -> dict[str, FloatArray]:
        """Return sliders A and S joints C (..., 6, 3), m, over the tool's tip at home."""
        rows = as_rows(pose, 6)
        legs = self._batch(legs_batch, rows, (6, 6), self.layout, self.L)
        joints = rows[..., None, :3] + legs[..., :3]
        return {"A": joints - legs[..., 3:], "C": joints}

    def links(self, pose: FloatArray) -> tuple[Link, ...]:
        """Return screws, sliders, rods, platform and tool; the screws' length is ours."""
        at = self.points(np.asarray(pose, dtype=float))
        tip = np.asarray(pose, dtype=float)[:3]
        centre = at["C"].mean(axis=0)
        low, high = self.home - 0.2, self.home + 0.2
        stand = self.layout.reshape(6, PER_LEG)[:, 3:]
        screws = [Link("base", np.array([[x, y, low], [x, y, high]])) for x, y in stand]
        rods = [Link("rod", np.stack([a, c])) for a, c in zip(at["A"], at["C"], strict=True)]
        ring = np.concatenate([at["C"], at["C"][:1]])
        tool = [Link("platform", np.stack([centre, tip]))] if self.tool > 0.0 else []
        return (*screws, *rods, Link("platform", ring), *tool)
