"""The 5-PSS/UPU as a Mechanism: dimensions in SI, the kinematic verbs, and the box it works in."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from pkm_gym.core.compile import BatchKernel
from pkm_gym.core.mechanism import IndexMap, Link, Mechanism, Symmetry, as_rows, dimension
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.batches import (
    PER_LIMB_FOUND,
    inverse_batch,
    limbs_batch,
    local_batch,
    rates_batch,
    transmission_batch,
    twists_batch,
    yaw_batch,
)
from pkm_gym.mechanisms.pss5_upu.clearances import clearances_batch
from pkm_gym.mechanisms.pss5_upu.conditioning import systems_batch
from pkm_gym.mechanisms.pss5_upu.declared import RAIL_SHARE
from pkm_gym.mechanisms.pss5_upu.extremes import nodes
from pkm_gym.mechanisms.pss5_upu.forward import forward_kinematics_batch
from pkm_gym.mechanisms.pss5_upu.kinematics import LIMBS, PER_LIMB, home_height, lay_out

SQUARE = math.pi / 2.0
LOCAL_NAMES = ("K_v", "K_w", "K_lambda", "K_eta")
WORDS = {  # what they are at a pose
    "K_v": "s3 / s1 of J_v",
    "K_w": "s2 / s1 of J_w",
    "K_lambda": "least input transmission of a limb",
    "K_eta": "least output transmission of a limb",
    "gti": "least transmission of a limb, in or out",
}


def singular_values(matrices: FloatArray) -> FloatArray:
    """Return the singular values (..., k) of matrices (..., m, n), NaN where one isn't finite."""
    finite = np.asarray(np.isfinite(matrices).all(axis=(-1, -2), keepdims=True))
    values = np.linalg.svd(np.where(finite, matrices, 0.0), compute_uv=False)
    return np.where(finite[..., 0], values, np.nan)


@dataclass(frozen=True, slots=True)
class Pss5Upu(Mechanism):
    """A 5-PSS/UPU with the box that its platform works in.

    Pose: (x, y, z, beta, gamma), m and rad: the platform's centre over the plane of the rails'
    feet, and the rotation Rz(alpha) Ry(beta) Rx(gamma), alpha given by the yaw. Twist: (omega, v),
    rad/s and m/s, of which five numbers are free: not the rate of the pose. The rates of the
    paper's Jacobian, ``rate_jacobian``, are (vx, vy, vz, gamma', beta'). Joints: the sliders' ways
    from the feet of their rails, m.
    """

    r: float = dimension("m", "radius of the S joints on the platform")
    R: float = dimension("m", "radius of the rails' feet")
    L: float = dimension("m", "length of the rods")
    theta: float = dimension(
        "rad", "inclination of the rails", high=SQUARE, default=math.radians(30.0)
    )
    lam0: float = dimension("", "cosine that gives the height of home", high=1.0, default=0.8)
    a2: float = dimension(
        "rad", "azimuth of the S joint 2 from 72 deg", low=-math.pi, high=math.pi, default=0.0
    )
    a3: float = dimension(
        "rad", "azimuth of the S joint 3 from 144 deg", low=-math.pi, high=math.pi, default=0.0
    )
    b2: float = dimension(
        "rad", "azimuth of the foot 2 from 72 deg", low=-math.pi, high=math.pi, default=0.0
    )
    b3: float = dimension(
        "rad", "azimuth of the foot 3 from 144 deg", low=-math.pi, high=math.pi, default=0.0
    )
    upu: float = dimension(
        "", "1: alpha as a UPU limb has it, 0: none", low=-1e-12, high=1.0 + 1e-12, default=1.0
    )
    x0: float = dimension("m", "x of the box's centre", low=-1e6, default=0.0)
    x: float = dimension("m", "half the box's width in x", default=0.075)
    y: float = dimension("m", "half the box's width in y", default=0.075)
    z: float = dimension("m", "half the box's height", default=0.05)
    beta: float = dimension("rad", "largest beta", high=SQUARE, default=math.radians(20.0))
    gamma: float = dimension("rad", "largest gamma", high=SQUARE, default=math.radians(20.0))
    rail: float = dimension("m", "length of the rails", default=1e3)

    pose_names = ("x", "y", "z", "beta", "gamma")
    twist_names = ("wx", "wy", "wz", "vx", "vy", "vz")
    joint_names = ("l_1", "l_2", "l_3", "l_4", "l_5")
    rate_names: ClassVar = ("vx", "vy", "vz", "gamma_rate", "beta_rate")
    twin_module = "pkm_gym.mechanisms.pss5_upu.twin"
    work: ClassVar[float] = 1.0

    @property
    def layout(self) -> FloatArray:
        """What the kernels take (35,): of each limb S joint (2), foot (2) and rail (3)."""
        layout = np.empty(LIMBS * PER_LIMB)
        lay_out(layout, self.r, self.R, self.theta, self.a2, self.a3, self.b2, self.b3)
        return layout

    @property
    def n(self) -> float:
        """The mean of r, R and L, m."""
        return (self.r + self.R + self.L) / 3.0

    @property
    def z0(self) -> float:
        """The height of home, m."""
        return float(home_height(self.r, self.R, self.L, self.theta, self.lam0))

    @property
    def rail_end(self) -> float:
        """The way that a slider has, m: the rails' length, or short of where they would meet."""
        return min(self.rail, RAIL_SHARE * self.R / math.cos(self.theta))

    @property
    def home(self) -> FloatArray:
        """The pose (5,) of home, whatever the box."""
        return np.array([0.0, 0.0, self.z0, 0.0, 0.0])

    def _at(self, kernel: BatchKernel, pose: FloatArray, shape: tuple[int, ...]) -> FloatArray:
        return self._batch(kernel, pose, shape, self.layout, self.L, self.upu)

    def real(self) -> Pss5Upu:
        """Return the machine with the yaw that its UPU limb gives: alpha = 0 can't be built."""
        return replace(self, upu=1.0)

    # Positions ------------------------------------------------------------------------------------

    def inverse_kinematics(self, pose: FloatArray) -> FloatArray:
        """Return the sliders (..., 5), m, each behind its rod; NaN out of the rods' reach."""
        sliders = self.limbs(pose)[..., 7]
        reached = np.isfinite(sliders).all(axis=-1, keepdims=True)
        return np.where(reached, sliders, np.nan)

    def forward_kinematics(self, joints: FloatArray, near: FloatArray | None = None) -> FloatArray:
        """Return the pose (..., 5) of sliders (..., 5), on the branch of ``near`` or the centre.

        Follows the straight path of the sliders from ``near`` (..., 5); NaN where a direct
        singularity bars it.
        """
        start = self.in_box(np.zeros(5)) if near is None else near
        joints, start = np.broadcast_arrays(as_rows(joints, 5), as_rows(start, 5))
        joints, rows = joints.copy(), start.reshape(-1, 5).copy()
        return self._batch(
            forward_kinematics_batch, joints, (5,), rows, self.layout, self.L, self.upu
        )

    def limbs(self, pose: FloatArray) -> FloatArray:
        """Return of each limb (..., 5, 8): arm R a_i (m), unit rod f_i, lambda_i and slider (m)."""
        return self._at(limbs_batch, pose, (LIMBS, PER_LIMB_FOUND))

    def alpha(self, pose: FloatArray) -> FloatArray:
        """Return the yaw (...), rad: sin alpha = -(y/z) tan beta, or 0."""
        return self._batch(yaw_batch, pose, (4,), self.upu)[..., 0]

    def rotation(self, pose: FloatArray) -> FloatArray:
        """Return the platform's axes as the columns of (..., 3, 3)."""
        from scipy.spatial.transform import Rotation

        rows = as_rows(pose, 5)
        angles = np.stack([self.alpha(rows), rows[..., 3], rows[..., 4]], axis=-1)
        turned = Rotation.from_euler("ZYX", angles.reshape(-1, 3)).as_matrix()
        return np.asarray(turned).reshape(*rows.shape[:-1], 3, 3)

    def upu_length(self, pose: FloatArray) -> FloatArray:
        """Return l_0 = |p| (...), m, of the passive limb."""
        return np.linalg.norm(as_rows(pose, 5)[..., :3], axis=-1)

    def passive_lengths(self, pose: FloatArray) -> FloatArray:
        """Return the length (..., 1), m, of the passive limb."""
        return self.upu_length(pose)[..., None]

    def upu_rate(self, pose: FloatArray, rates: FloatArray) -> FloatArray:
        """Return l'_0 = p . v / |p| (...), m/s, at rates (..., 5): it isn't an input."""
        p = as_rows(pose, 5)[..., :3]
        along = np.einsum("...k,...k->...", p, as_rows(rates, 5)[..., :3])
        return np.asarray(along / np.linalg.norm(p, axis=-1))

    # Velocities and forces ------------------------------------------------------------------------

    def jacobian(self, pose: FloatArray) -> FloatArray:
        """Return J (..., 6, 5): (omega, v) = J @ slider rates; infinite at a singular pose."""
        return self._at(twists_batch, pose, (6, LIMBS))

    def inverse_jacobian(self, pose: FloatArray) -> FloatArray:
        """Return (..., 5, 6): slider rates = it @ (omega, v), of a twist that the limb allows."""
        return self._at(inverse_batch, pose, (LIMBS, 6))

    def rate_jacobian(self, pose: FloatArray) -> FloatArray:
        """Return J (..., 5, 5): (vx, vy, vz, gamma', beta') = J @ slider rates.

        The paper's five-input Jacobian: J_v are its first three rows, J_w its last two. Infinite at
        a singular pose.
        """
        return self._at(rates_batch, pose, (LIMBS, LIMBS))

    def twist(self, pose: FloatArray, pose_rate: FloatArray) -> FloatArray:
        """Return (omega, v) (..., 6) of a pose that changes at ``pose_rate`` (..., 5)."""
        pose, rate = np.broadcast_arrays(as_rows(pose, 5), as_rows(pose_rate, 5))
        yaw = np.moveaxis(self._batch(yaw_batch, pose, (4,), self.upu), -1, 0)
        x, y, z, b, g = np.moveaxis(rate, -1, 0)
        sin, cos, beta = np.sin(yaw[0]), np.cos(yaw[0]), pose[..., 3]
        omega = (
            g * cos * np.cos(beta) - b * sin,
            g * sin * np.cos(beta) + b * cos,
            yaw[1] * y + yaw[2] * z + yaw[3] * b - g * np.sin(beta),
        )
        return np.stack([*omega, x, y, z], axis=-1)

    def slider_forces(self, pose: FloatArray, wrench: FloatArray) -> FloatArray:
        """Return the forces (..., 5), N, of the sliders for a wrench (moment, force) (..., 6).

        That the platform exerts on its surroundings at its centre: tau = J^T W. NaN at a singular
        pose.
        """
        J = self.jacobian(pose)
        J = np.where(np.isfinite(J), J, np.nan)
        return np.einsum("...ki,...k->...i", J, np.asarray(wrench, dtype=float))

    def ellipsoids(self, pose: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the half axes of the velocity ellipsoids of J_v (..., 3), J_w (..., 2).

        NaN at a singular pose, where they don't exist.
        """
        J = self.rate_jacobian(pose)
        return singular_values(J[..., :3, :]), singular_values(J[..., 3:, :])

    # Local indices --------------------------------------------------------------------------------

    def local_indices(self, pose: FloatArray) -> dict[str, FloatArray]:
        """Return K_v, K_w, K_lambda and K_eta (...) at poses (..., 5)."""
        table = self._at(local_batch, pose, (len(LOCAL_NAMES),))
        return dict(zip(LOCAL_NAMES, np.moveaxis(table, -1, 0), strict=True))

    def transmission(self, pose: FloatArray) -> FloatArray:
        """Return lambda_i and eta_i (..., 5, 2) of the limbs; eta_i = 0 at a singular pose."""
        return self._at(transmission_batch, pose, (LIMBS, 2))

    def system(self, pose: FloatArray) -> FloatArray:
        """Return the limbs' system (..., 6, 6) of (v, r omega): see ``conditioning``."""
        return self._batch(systems_batch, pose, (6, 6), self.layout, self.L, self.r, self.upu)

    def rcond(self, pose: FloatArray) -> FloatArray:
        """Return s6 / s1 (...) of the limbs' system, NaN out of reach."""
        values = singular_values(self.system(pose))
        return np.asarray(values[..., 5] / values[..., 0])

    def rank(self, pose: FloatArray, tolerance: float = 1e-9) -> FloatArray:
        """Return how many singular values (...) of the limbs' system are above a share of s1."""
        values = singular_values(self.system(pose))
        found = (values > tolerance * values[..., :1]).sum(axis=-1)
        return np.where(np.isfinite(values).all(axis=-1), found, np.nan)

    def clearances(self, pose: FloatArray) -> FloatArray:
        """Return the least distances (..., 3), m: of rods, rods and others' rails, rods and UPU."""
        return self._batch(
            clearances_batch, pose, (3,), self.layout, self.L, self.rail_end, self.upu
        )

    def swings(self, pose: FloatArray) -> FloatArray:
        """Return each rod's angle (..., 5), rad, from the box's centre, in base or platform."""
        rods = self.limbs(pose)[..., 3:6]
        centre = self.limbs(self.in_box(np.zeros(5)))[..., 3:6]
        seen = np.einsum("...kj,...ik->...ij", self.rotation(pose), rods)
        cosines = [np.einsum("...ij,ij->...i", f, centre) for f in (rods, seen)]
        return np.asarray(np.arccos(np.clip(np.minimum(*cosines), -1.0, 1.0)))

    def index_maps(self, pose: FloatArray) -> dict[str, IndexMap]:
        """Return the local indices at poses (..., 5), by the name of the design's index."""
        local = self.local_indices(pose)
        lti = np.minimum(local["K_lambda"], local["K_eta"])
        least = np.moveaxis(self.clearances(pose), -1, 0)
        sliders = self.inverse_kinematics(pose)
        means = {name: IndexMap(name, "", "mean", local[name], doc=WORDS[name]) for name in local}
        extremes: Mapping[str, tuple[str, str, FloatArray]] = {
            "lti_min": ("", "min", lti),
            "rcond": ("", "min", self.rcond(pose)),
            "transmission": ("", "min", local["K_lambda"]),
            "slider_low": ("m", "min", sliders.min(axis=-1)),
            "slider_high": ("m", "max", sliders.max(axis=-1)),
            "rail_start": ("", "min", sliders.min(axis=-1) / self.n),
            "rail_end": ("", "max", sliders.max(axis=-1) / self.rail_end),
            "rod_rod": ("m", "min", least[0]),
            "rod_rail": ("m", "min", least[1]),
            "rod_upu": ("m", "min", least[2]),
            "clearance": ("m", "min", least.min(axis=0)),
            "swing": ("rad", "max", self.swings(pose).max(axis=-1)),
            "force": ("", "max", self.vertical_force(pose)),
        }
        limits = {  # their extremes stand at the box's corners: a picture shows one section
            name: IndexMap(name, unit, kind, values, drawn=False)  # type: ignore[arg-type]
            for name, (unit, kind, values) in extremes.items()
        }
        return {**means, "gti": IndexMap("gti", "", "mean", lti, doc=WORDS["gti"]), **limits}

    def vertical_force(self, pose: FloatArray) -> FloatArray:
        """Return the largest force (...) of a slider per vertical load on the platform's centre.

        Infinite at a singular pose.
        """
        return np.asarray(np.abs(self.jacobian(pose)[..., 5, :]).max(axis=-1))

    def symmetries(self) -> tuple[Symmetry, ...]:
        """Return the mirror y -> -y, which exchanges the limbs 2 and 5, 3 and 4."""
        signs = np.array([1.0, -1.0, 1.0, 1.0, -1.0])
        return (
            Symmetry(
                "mirror image in y",
                lambda pose: np.asarray(pose, dtype=float) * signs,
                lambda joints: np.asarray(joints, dtype=float)[..., [0, 4, 3, 2, 1]],
            ),
        )

    # Its box, and how it is drawn -----------------------------------------------------------------

    def in_box(self, unit: FloatArray) -> FloatArray:
        """Return poses (..., 5) of the box at shares (..., 5) of its half widths, -1 to 1."""
        half = (self.x, self.y, self.z, self.beta, self.gamma)
        centre = np.array([self.x0, 0.0, self.z0, 0.0, 0.0])
        return np.asarray(centre + np.asarray(unit, dtype=float) * half)

    def search_poses(self) -> FloatArray:
        """Return the nodes (n, 5) that the limits are looked for at."""
        return self.in_box(nodes())

    def sample_poses(self) -> FloatArray:
        """Return a pose off the centre and two corners of the box (3, 5).

        The paper's layout can't be built at its centre, where it is singular.
        """
        unit = [[0.4, 0.3, 0.2, -0.3, 0.5], [1, -1, 1, 1, -1], [-1, 1, -1, -1, 1]]
        return self.in_box(np.array(unit))

    def workspace(self) -> FloatArray:
        """Return the box's outline (n, 2) from above, m."""
        corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)])
        return np.array([self.x0, 0.0]) + corners * (self.x, self.y)

    def workspace_grid(self, columns: int, rows: int) -> FloatArray:
        """Return poses (rows, columns, 5) over x and y at the box's middle height, level."""
        x, y = np.meshgrid(np.linspace(-1, 1, columns), np.linspace(-1, 1, rows))
        none = np.zeros_like(x)
        return self.in_box(np.stack([x, y, none, none, none], axis=-1))

    def points(self, pose: FloatArray) -> dict[str, FloatArray]:
        """Return feet B, sliders b and S joints a (..., 5, 3), m."""
        rows = as_rows(pose, 5)
        found = self.limbs(rows)
        table = self.layout.reshape(LIMBS, PER_LIMB)
        feet = np.pad(table[:, 2:4], ((0, 0), (0, 1)))
        joints = rows[..., None, :3] + found[..., :3]
        return {
            "B": np.broadcast_to(feet, joints.shape),
            "b": joints - self.L * found[..., 3:6],
            "a": joints,
        }

    def rails(self) -> FloatArray:
        """Return the ends (5, 2, 3) of the rails, m."""
        table = self.layout.reshape(LIMBS, PER_LIMB)
        feet = np.pad(table[:, 2:4], ((0, 0), (0, 1)))
        return np.stack([feet, feet + self.rail_end * table[:, 4:]], axis=1)

    def links(self, pose: FloatArray) -> tuple[Link, ...]:
        """Return rails, rods, platform and the UPU limb."""
        at = self.points(np.asarray(pose, dtype=float))
        centre = np.asarray(pose, dtype=float)[:3]
        rails = [Link("base", ends) for ends in self.rails()]
        rods = [Link("rod", np.stack([b, a])) for b, a in zip(at["b"], at["a"], strict=True)]
        around = np.argsort(np.arctan2(*(at["a"] - centre)[:, 1::-1].T))
        ring = at["a"][np.append(around, around[0])]
        barrel = 0.6 * self.z0 * centre / np.linalg.norm(centre)
        upu = Link("cylinder", np.stack([np.zeros(3), barrel, centre]))
        return (*rails, *rods, Link("platform", ring), upu)
