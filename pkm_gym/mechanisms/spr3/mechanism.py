"""The 3-SPR as a Mechanism: dimensions in SI and the kinematic verbs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pkm_gym.core.mechanism import IndexMap, Link, Mechanism, Symmetry, as_rows, dimension
from pkm_gym.core.names import check_known
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.mechanisms.spr3.assembly import AssemblyModes, all_assembly_modes
from pkm_gym.mechanisms.spr3.declared import JACOBIANS
from pkm_gym.mechanisms.spr3.drawing import AROUND, closed, drawn_links, section_outline
from pkm_gym.mechanisms.spr3.indices import (
    LOCAL,
    homogeneous,
    joint_angles_batch,
    local_indices_batch,
)
from pkm_gym.mechanisms.spr3.kinematics import (
    COS,
    SIN,
    forward_kinematics_batch,
    frames_batch,
    leg_lengths_batch,
    level,
    poses_at_batch,
)
from pkm_gym.mechanisms.spr3.velocity import twist_batch, velocity_batch
from pkm_gym.mechanisms.spr3.words import legs

LEVELS = 9  # leg lengths that are searched, from the shortest to the longest

LCI = "local conditioning index"  # at a pose


@dataclass(frozen=True, slots=True)
class Spr3(Mechanism):
    """A 3-SPR with the range of its legs.

    Pose: (hx, hy, s), see ``kinematics``; hx and hy are the tangent of half the tilt times the
    direction in which the platform's normal leans, s (m) is the distance of the fixed platform's
    centre from the moving platform's plane. Twist: the velocity of the moving platform's centre
    O_A in the fixed frame, m/s; it determines the angular velocity. Joints: the legs' lengths, m.

    A pose is within reach if its legs are within their range and it lies on the home side: in front
    of the fixed platform and of the fold, so that its position has one tilt. Jacobians need the
    second alone.
    """

    a: float = dimension("m", "radius of the revolute joints on the moving platform")
    b: float = dimension("m", "radius of the spherical joints on the fixed platform")
    q_min: float = dimension("m", "shortest leg")
    q_max: float = dimension("m", "longest leg")

    pose_names = ("hx", "hy", "s")
    twist_names = ("vx", "vy", "vz")
    joint_names = ("q_1", "q_2", "q_3")
    joint_unit = "m"
    drawn_axes = ("x", "z")
    twin_module = "pkm_gym.mechanisms.spr3.twin"
    range_slack: ClassVar[float] = 1e-9  # a leg this share beyond its range still counts as within

    def __post_init__(self) -> None:
        """Refuse impossible dimensions.

        Raises:
            ValueError: naming the field, its value and the allowed range.
        """
        Mechanism.__post_init__(self)
        if not self.q_min < self.q_max:
            raise ValueError(
                f"q_max is {self.q_max!r} m: it must be finite and greater than q_min, "
                f"{self.q_min:g} m"
            )

    @property
    def q_c(self) -> float:
        """The length of the legs at home, m."""
        return 0.5 * (self.q_min + self.q_max)

    @property
    def D(self) -> float:  # noqa: N802 (symbol of the page)
        """The characteristic length (a + b + q_c) / 3, m."""
        return (self.a + self.b + self.q_c) / 3.0

    @property
    def r2(self) -> float:
        """B over D."""
        return self.b / self.D

    @property
    def home(self) -> FloatArray:
        """The level pose (3,) with the legs at q_c; NaN where they do not reach."""
        return np.array([0.0, 0.0, level(self.q_c, self.a, self.b)])

    # Positions ------------------------------------------------------------------------------------

    def inverse_kinematics(self, pose: FloatArray) -> FloatArray:
        """Return the legs' lengths (..., 3), m; NaN out of reach. Eq. (7), corrected."""
        return self._within_reach(pose, self.leg_lengths(pose))

    def leg_lengths(self, pose: FloatArray) -> FloatArray:
        """Return the lengths (..., 3), m, that poses (..., 3) ask for, whatever the legs' range."""
        return self._batch(leg_lengths_batch, pose, (3,), self.a, self.b)

    def forward_kinematics(self, joints: FloatArray, near: FloatArray | None = None) -> FloatArray:
        """Return the pose (..., 3) of legs (..., 3), on the branch of ``near`` or of home.

        Follows the straight path in the legs' lengths from ``near`` (..., 3); NaN where a parallel
        singularity bars it. The range of the legs does not matter.
        """
        start = self.home if near is None else near
        joints, start = np.broadcast_arrays(np.asarray(joints, float), np.asarray(start, float))
        near_rows = np.ascontiguousarray(start.reshape(-1, start.shape[-1]))
        return self._batch(forward_kinematics_batch, joints, (3,), near_rows, self.a, self.b)

    def all_assembly_modes(self, joints: FloatArray) -> AssemblyModes:
        """Return every real pose with legs (3,), in both operation modes: none to sixteen."""
        return all_assembly_modes(joints, self.a, self.b)

    def position(self, pose: FloatArray) -> FloatArray:
        """Return O_A (..., 3) in the fixed frame, m. Eq. (6), corrected."""
        return self._batch(frames_batch, pose, (3, 4), self.b)[..., 3]

    def rotation(self, pose: FloatArray) -> FloatArray:
        """Return the platform's axes u, v, w as the columns of (..., 3, 3)."""
        return self._batch(frames_batch, pose, (3, 4), self.b)[..., :3]

    def pose_at(self, position: FloatArray) -> FloatArray:
        """Return the pose (..., 3) with O_A at positions (..., 3), m.

        On the branch of the level pose, by the straight line from the axis; NaN beyond the fold.
        """
        return self._batch(poses_at_batch, position, (3,), self.b)

    def angles(self, pose: FloatArray) -> FloatArray:
        """Return the paper's psi, theta (rad) and z0 (m), (..., 3); psi is 0 where theta is."""
        hx, hy, _ = np.moveaxis(as_rows(pose, 3), -1, 0)
        tilt = np.hypot(hx, hy)
        psi = np.where(tilt > 0.0, np.arctan2(hy, hx) + 0.5 * np.pi, 0.0)
        return np.stack([psi, 2.0 * np.arctan(tilt), self.position(pose)[..., 2]], axis=-1)

    def pose_from_angles(self, angles: FloatArray) -> FloatArray:
        """Return the pose (..., 3) of the paper's psi, theta (rad), z0 (m), (..., 3)."""
        psi, theta, z = np.moveaxis(as_rows(angles, 3), -1, 0)
        h = np.tan(0.5 * theta) * np.exp(1j * (psi - 0.5 * np.pi))
        m = 1.0 + np.abs(h) ** 2
        s = (z * m + 2.0 * self.b * (h**3).real / m) / (2.0 - m)
        return np.stack([h.real, h.imag, s], axis=-1)

    def joint_angles(self, pose: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the angles (..., 3), rad, of the S joints and of the R joints, limb by limb.

        S: from the fixed platform's normal to the leg. R: from the moving platform's plane to it.
        """
        angles = self._batch(joint_angles_batch, pose, (2, 3), self.a, self.b)
        return angles[..., 0, :], angles[..., 1, :]

    # Velocities and forces ------------------------------------------------------------------------

    def inverse_jacobian(self, pose: FloatArray) -> FloatArray:
        """Return J (..., 3, 3), dimensionless: leg rates = J @ velocity of O_A. Eq. (14)."""
        return self._velocity(pose)[..., 0, :, :]

    def jacobian(self, pose: FloatArray) -> FloatArray:
        """Return (..., 3, 3): velocity of O_A = jacobian @ leg rates."""
        one, two, three = np.moveaxis(self.inverse_jacobian(pose), -2, 0)
        adjugate = np.stack(
            [np.cross(two, three), np.cross(three, one), np.cross(one, two)], axis=-1
        )
        determinant = (one * adjugate[..., 0]).sum(axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(adjugate / determinant[..., None, None])

    def angular_jacobian(self, pose: FloatArray) -> FloatArray:
        """Return J_c (..., 3, 3), 1/m: the platform's omega = J_c @ velocity of O_A. Eq. (12)."""
        return self._velocity(pose)[..., 1, :, :]

    def limb_jacobians(self, pose: FloatArray) -> FloatArray:
        """Return J_di (..., limb, 3, 3), 1/m: a limb's omega = J_di @ velocity of O_A.

        With the limb's spin about itself, which it shares with the platform. Eq. (20), corrected.
        """
        return self._velocity(pose)[..., 2:, :, :]

    def limb_turning(self, pose: FloatArray, velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how limbs turn, rad/s, at velocities (..., 3) of O_A: swing and spin.

        Swing (..., limb, 3): the part of the angular velocity across the leg, eq. (16). Spin
        (..., limb): the part about the leg, from B_i to A_i, which the platform shares, eq. (19).
        """
        moving = self.a * AROUND @ np.swapaxes(self.rotation(pose), -1, -2)
        legs = self.position(pose)[..., None, :] + moving - self.b * AROUND
        legs /= np.linalg.norm(legs, axis=-1, keepdims=True)
        omega = np.einsum("...kij,...j->...ki", self.limb_jacobians(pose), velocity)
        spin = (omega * legs).sum(axis=-1)
        return omega - spin[..., None] * legs, spin

    def twist(self, pose: FloatArray, pose_rate: FloatArray) -> FloatArray:
        """Return the velocity of O_A (..., 3), m/s, of a pose that changes at ``pose_rate``."""
        pose, rate = np.broadcast_arrays(np.asarray(pose, float), np.asarray(pose_rate, float))
        rates = np.ascontiguousarray(as_rows(rate, 3).reshape(-1, 3))
        return self._batch(twist_batch, pose, (3,), rates, self.b)

    def symmetries(self) -> tuple[Symmetry, ...]:
        """Return the mirror plane of leg 3, and the turn from each leg to the next."""
        turn = np.eye(3)
        turn[:2, :2] = [[COS[0], -SIN[0]], [SIN[0], COS[0]]]  # from leg 3 to leg 1
        return (
            Symmetry(
                "mirrored in the plane of leg 3",
                lambda pose: np.asarray(pose, dtype=float) * [1.0, -1.0, 1.0],
                lambda joints: np.asarray(joints, dtype=float)[..., [1, 0, 2]],
            ),
            Symmetry(
                "turned by a third",
                lambda pose: np.asarray(pose, dtype=float) @ turn.T,
                lambda joints: np.roll(np.asarray(joints, dtype=float), 1, axis=-1),
            ),
        )

    def actuator_forces(
        self, pose: FloatArray, force: FloatArray, moment: FloatArray | float = 0.0
    ) -> FloatArray:
        """Return the legs' forces (..., 3), N, > 0 pushing, that hold a load on the platform.

        Args:
            pose: array (..., 3).
            force: the load's force (..., 3) in the fixed frame, N, acting at O_A.
            moment: its moment (..., 3) about O_A, N m.
        """
        spun = np.einsum("...ij,...i->...j", self.angular_jacobian(pose), _spread(moment))
        load = np.asarray(force, dtype=float) + spun
        return -np.einsum("...ij,...i->...j", self.jacobian(pose), load)

    # Indices --------------------------------------------------------------------------------------

    def local_indices(self, pose: FloatArray, jacobian: str = "velocity") -> dict[str, FloatArray]:
        """Return the indices at poses (..., 3): name -> (...).

        ``lci`` (smallest over largest singular value of the named homogeneous Jacobian), ``det`` of
        J and ``fold`` (both > 0 on the home sheet), ``parasitic`` (m), ``tilt``, ``s_angle`` and
        ``r_angle`` (rad) of the worst limb.

        Raises:
            ValueError: for an unknown Jacobian, with its closest match.
        """
        check_known("jacobian", [jacobian], JACOBIANS)
        metric = homogeneous(JACOBIANS.index(jacobian), self.a, self.b, self.D)
        table = self._batch(local_indices_batch, pose, (len(LOCAL),), self.a, self.b, *metric)
        return {name: table[..., k] for k, name in enumerate(LOCAL)}

    # How a picture is drawn -----------------------------------------------------------------------

    def links(self, pose: FloatArray) -> tuple[Link, ...]:
        """Return the platforms, cylinders and rods in space at a pose (3,), m."""
        center = self._within_reach(pose, self.position(pose))
        return drawn_links(center, self.rotation(pose), self.a, self.b, self.q_min)

    def drawn(self, pose: FloatArray) -> FloatArray:
        """Return x and z (..., 2) of O_A, m: the drawing plane is the mirror plane of leg 3."""
        return self.position(pose)[..., [0, 2]]

    def workspace(self) -> FloatArray:
        """Return the outline (n, 2) of the workspace's section by the mirror plane of leg 3, m.

        What a singularity cuts off is left out; where nothing is reached, it is one point.
        """
        joints = section_outline(self.q_min, self.q_max)
        return closed(self.drawn(self.forward_kinematics(joints)), self.q_c)

    def workspace_grid(self, columns: int, rows: int) -> FloatArray:
        """Return poses (rows, columns, 3) over that section: leg 3 along the rows, its twins along.

        The corners of the joint box, where most indices have their extremes, lie in it.
        """
        twins, third = np.meshgrid(
            np.linspace(self.q_min, self.q_max, columns), np.linspace(self.q_min, self.q_max, rows)
        )
        return self.forward_kinematics(np.stack([twins, twins, third], axis=-1))

    def joint_box(self) -> FloatArray:
        """Return leg lengths (n, 3), m, over the joint box; by symmetry q_1 <= q_2 <= q_3."""
        rise = np.linspace(self.q_min, self.q_max, LEVELS)
        box = np.stack(np.meshgrid(rise, rise, rise, indexing="ij"), axis=-1).reshape(-1, 3)
        ordered: FloatArray = box[(np.diff(box, axis=1) >= 0.0).all(axis=1)]
        return ordered

    def search_poses(self) -> FloatArray:
        """Return poses (n, 3) all over the workspace, NaN where a singularity bars the way."""
        return self.forward_kinematics(self.joint_box())

    def place(self, pose: FloatArray) -> str:
        """Return in words the legs of a pose (3,)."""
        return f"with {legs(self.leg_lengths(pose))}"

    def sample_poses(self) -> FloatArray:
        """Return home and the two most tilted corners of the joint box (3, 3)."""
        low, high = self.q_min, self.q_max
        tilted = self.forward_kinematics(np.array([[low, low, high], [high, high, low]]))
        return np.concatenate([self.home[None], tilted])

    def index_maps(self, pose: FloatArray, jacobian: str = "velocity") -> dict[str, IndexMap]:
        """Return the local indices at poses (..., 3), NaN out of reach.

        The R joints' smallest angle may lie outside the section that is drawn.
        """
        local = self._local_within_reach(pose, jacobian)
        return {
            "lci_min": IndexMap("lci", "", "min", local["lci"], doc=LCI),
            "parasitic": IndexMap(
                "parasitic", "m", "max", local["parasitic"], doc="parasitic offset"
            ),
            "s_angle": IndexMap(
                "s_angle",
                "rad",
                "max",
                local["s_angle"],
                doc="largest of the three S joints' angles, from the base's normal to the leg",
            ),
            "r_angle": IndexMap("r_angle", "rad", "min", local["r_angle"], drawn=False),
            "det": IndexMap("det", "", "min", local["det"], drawn=False),
            "fold": IndexMap("fold", "", "min", local["fold"], drawn=False),
        }

    def _local_within_reach(self, pose: FloatArray, jacobian: str) -> dict[str, FloatArray]:
        local = self.local_indices(pose, jacobian)
        return {name: self._within_reach(pose, values) for name, values in local.items()}

    def _velocity(self, pose: FloatArray) -> FloatArray:
        matrices = self._batch(velocity_batch, pose, (5, 3, 3), self.a, self.b)
        return np.where(self._at_home_side(pose)[..., None, None, None], matrices, np.nan)

    def _at_home_side(self, pose: FloatArray) -> BoolArray:
        return (self.local_indices(pose)["fold"] > 0.0) & (np.asarray(pose)[..., 2] > 0.0)

    def _within_reach(self, pose: FloatArray, values: FloatArray) -> FloatArray:
        """Return ``values`` (..., more axes), NaN for the poses that are out of reach."""
        low, high = self.q_min * (1.0 - self.range_slack), self.q_max * (1.0 + self.range_slack)
        lengths = self.leg_lengths(pose)
        inside = ((lengths >= low) & (lengths <= high)).all(axis=-1) & self._at_home_side(pose)
        more = (1,) * (values.ndim - inside.ndim)
        return np.where(inside.reshape(inside.shape + more), values, np.nan)


def _spread(vector: FloatArray | float) -> FloatArray:
    return np.broadcast_to(vector, np.broadcast_shapes(np.shape(vector), (3,)))
