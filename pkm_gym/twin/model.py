"""A twin that stands, moves and is measured: MuJoCo's model of a mechanism, and its state."""

from __future__ import annotations

from typing import Any, NamedTuple

import mujoco
import numpy as np

from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.trajectory import polynomial_345
from pkm_gym.core.twin import twin_module
from pkm_gym.core.types import FloatArray

RAMP, HOLD = 0.3, 4.0  # s: the servos' way to a pose, and the longest wait there
STILL = 1e-9  # m/s or rad/s, of every coordinate of a settled twin
CHUNK = 0.01  # s, between two looks at a twin that settles
CONTROLS = 60  # wanted values along the way


class Settled(NamedTuple):
    """Where the servos hold a twin: joints (k,), and the platform's frame (3, 4)."""

    joints: FloatArray
    frame: FloatArray


class Twin:
    """A mechanism's twin, built at a pose.

    Args:
        mechanism: the machine.
        home: array (k,), the pose at which it is assembled.
        lumped: build the variant that the mechanism's own dynamics describes.

    Attributes:
        servo_inertia: array (joints,), kg or kg m^2, what each servo is critically damped with.

    Raises:
        ValueError: for a pose out of reach, or a mechanism without a twin.
    """

    def __init__(self, mechanism: Mechanism, home: FloatArray, *, lumped: bool = False) -> None:
        self.mechanism = mechanism = mechanism.real()
        self.home = np.asarray(home, dtype=float)
        self.module = twin_module(mechanism)
        module: Any = self.module
        build = module.build_lumped if lumped else module.build
        self.model = build(mechanism, self.home).compile()
        self.data = mujoco.MjData(self.model)
        self.origin, self.tool = (self.model.site(name).id for name in ("origin", "tcp"))
        self.loops = np.stack([self.model.eq_obj1id, self.model.eq_obj2id], axis=-1)
        joints = [self.model.joint(name) for name in mechanism.joint_names]
        self.values = np.array([joint.qposadr[0] for joint in joints])
        self.rates = np.array([joint.dofadr[0] for joint in joints])
        self.passive = np.setdiff1d(np.arange(self.model.nv), self.rates)
        self.servos, self.motors = (
            np.array([self.model.actuator(f"{kind}_{name}").id for name in mechanism.joint_names])
            for kind in ("servo", "motor")
        )
        damping = self.model.actuator_biasprm[self.servos, 2]
        self.servo_inertia = 0.25 * damping**2 / self.model.actuator_gainprm[self.servos, 0]
        mujoco.mj_forward(self.model, self.data)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the module, which has a name, and the model, which MuJoCo keeps with data."""
        return {k: value for k, value in vars(self).items() if k not in ("module", "model")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self.module, self.model = twin_module(self.mechanism), self.data.model

    # Kinematics -----------------------------------------------------------------------------------

    def coordinates(self, poses: FloatArray) -> FloatArray:
        """Return MuJoCo's coordinates (n, nq) of analytic poses (n, k)."""
        rows = np.empty((len(poses), self.model.nq))
        for name, values in self.module.coordinates(self.mechanism, poses, self.home).items():
            start, size = self.model.joint(name).qposadr[0], self.model.joint(name).qpos0.size
            rows[:, start : start + size] = np.reshape(values, (len(poses), size))
        return rows

    def place(self, coordinates: FloatArray) -> None:
        """Put the twin, at rest, where its coordinates (nq,) say."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = coordinates
        mujoco.mj_forward(self.model, self.data)

    @property
    def gap(self) -> float:
        """How far the loops are open, m."""
        ends = self.data.site_xpos[self.loops]
        return float(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=-1).max())

    @property
    def frame(self) -> FloatArray:
        """The platform's axes and position as columns (3, 4), in the mechanism's frame."""
        axes = self._axes
        position = axes.T @ (self.data.site_xpos[self.tool] - self.data.site_xpos[self.origin])
        rotation = axes.T @ self.data.site_xmat[self.tool].reshape(3, 3)
        return np.column_stack([rotation, position])

    def in_world(self, points: FloatArray) -> FloatArray:
        """Return points (n, 3), m, of the mechanism's frame in MuJoCo's world."""
        return self.data.site_xpos[self.origin] + points @ self._axes.T

    def tool_state(self) -> tuple[FloatArray, FloatArray]:
        """Return the tool's position, as many coordinates as its velocity has, and its twist."""
        return self.position_of(self.frame), self.tool_velocity

    def position_of(self, frames: FloatArray) -> FloatArray:
        """Return the tool's coordinates (..., n) that a twist moves, in frames (..., 3, 4)."""
        linear = len(self.mechanism.twist_names) - self.mechanism.turning
        return frames[..., :linear, 3]

    @property
    def tool_velocity(self) -> FloatArray:
        """The tool's twist."""
        return self._tool_jacobian() @ self.data.qvel

    @property
    def jacobian(self) -> FloatArray:
        """The Jacobian (twist, joints) by virtual work: passive rates follow from the loops."""
        return self._tool_jacobian() @ self._followed()

    def velocities(self, twist: FloatArray) -> FloatArray:
        """Return the rates (nv,) of all coordinates that a twist asks for, the loops closed."""
        loops, tool = self._loop_jacobian(), self._tool_jacobian()
        wanted = np.concatenate([twist, np.zeros(len(loops))])
        return np.asarray(np.linalg.lstsq(np.concatenate([tool, loops]), wanted)[0])

    def acceleration(self, rates: FloatArray) -> FloatArray:
        """Return the twist's rate where the driven joints move at steady rates (joints,)."""
        model, data = self.model, self.data
        data.qvel[:] = self._followed() @ rates
        mujoco.mj_forward(model, data)
        loops, follow = self._loop_jacobian(), np.zeros(model.nv)
        drift = self._loop_drift() @ data.qvel
        follow[self.passive] = -np.linalg.lstsq(loops[:, self.passive], drift)[0]
        return np.asarray(self._tool_jacobian() @ follow + self._tool_drift() @ data.qvel)

    # Dynamics -------------------------------------------------------------------------------------

    def drive_forces(self, twist: FloatArray, acceleration: FloatArray) -> FloatArray:
        """Return the drives' forces (joints,), N or N m, of a state, by an exact KKT solve.

        Mass matrix, bias and loop Jacobian are MuJoCo's; the loops are closed in acceleration too,
        which its soft constraints do only nearly.
        """
        model, data = self.model, self.data
        data.qvel[:] = self.velocities(twist)
        mujoco.mj_forward(model, data)
        loops, tool = self._loop_jacobian(), self._tool_jacobian()
        wanted = np.concatenate([acceleration, np.zeros(len(loops))])
        drift = np.concatenate([self._tool_drift(), self._loop_drift()])
        rows = np.concatenate([tool, loops])
        accelerations = np.linalg.lstsq(rows, wanted - drift @ data.qvel)[0]
        mass = np.empty((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        forces = mass @ accelerations + data.qfrc_bias - data.qfrc_passive
        driven = np.eye(model.nv)[:, self.rates]
        solved = np.linalg.lstsq(np.concatenate([driven, loops.T], axis=1), forces)[0]
        return np.asarray(solved[: len(self.rates)])

    def bearing_forces(self) -> FloatArray:
        """Return the drives' forces (joints,), N or N m, against weight and velocity terms.

        By virtual work on MuJoCo's bias, as the twin stands and moves.
        """
        return self._followed().T @ (self.data.qfrc_bias - self.data.qfrc_passive)

    def settle(self, joints: FloatArray) -> Settled:
        """Let the servos take the twin from home to joints (k,) until it rests there.

        It is stopped in the middle of each swing, where it is fastest: it comes to the same rest.

        Raises:
            RuntimeError: where it does not come to rest.
        """
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        way = np.asarray(joints) - data.qpos[self.values]
        steps = max(1, round(RAMP / CONTROLS / model.opt.timestep))
        for k in range(CONTROLS):
            data.ctrl[self.servos] = polynomial_345((k + 1) / CONTROLS)[0] * way
            mujoco.mj_step(model, data, steps)
        speed = 0.0
        for _ in range(round(HOLD / CHUNK)):
            mujoco.mj_step(model, data, round(CHUNK / model.opt.timestep))
            before, speed = speed, float(np.abs(data.qvel).max())
            if speed < STILL:
                break
            if speed < before:
                data.qvel[:] = speed = 0.0
        else:
            raise RuntimeError(f"the twin has not come to rest {HOLD:g} s after its move")
        mujoco.mj_forward(model, data)
        return Settled(data.qpos[self.values].copy(), self.frame)

    def release(self) -> None:
        """Switch the servos off; the motors stay."""
        self.model.actuator_gainprm[self.servos] = 0.0
        self.model.actuator_biasprm[self.servos] = 0.0

    # What MuJoCo knows of a site ------------------------------------------------------------------

    @property
    def _axes(self) -> FloatArray:
        return self.data.site_xmat[self.origin].reshape(3, 3)

    def _site_jacobian(self, site: int) -> FloatArray:
        """Return the rows (2, 3, nv) of a site's angular and of its linear velocity."""
        rows = np.empty((2, 3, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, rows[1], rows[0], site)
        return rows

    def _site_drift(self, site: int) -> FloatArray:
        """Return the rates (2, 3, nv) of these rows."""
        rows = np.empty((2, 3, self.model.nv))
        body, point = self.model.site_bodyid[site], self.data.site_xpos[site]
        mujoco.mj_jacDot(self.model, self.data, rows[1], rows[0], point, body)
        return rows

    def _followed(self) -> FloatArray:
        """Return all rates (nv, joints) per rate of each driven joint, the loops closed."""
        loops, rates = self._loop_jacobian(), np.zeros((self.model.nv, len(self.rates)))
        rates[self.rates] = np.eye(len(self.rates))
        rates[self.passive] = -np.linalg.lstsq(loops[:, self.passive], loops[:, self.rates])[0]
        return rates

    def _tool_jacobian(self) -> FloatArray:
        return self._of_twist(self._site_jacobian(self.tool))

    def _tool_drift(self) -> FloatArray:
        return self._of_twist(self._site_drift(self.tool))

    def _of_twist(self, rows: FloatArray) -> FloatArray:
        """Return the twist's rows (twist, nv), in the mechanism's frame, of a site's (2, 3, nv)."""
        turning = self.mechanism.turning
        angular, linear = self._axes.T @ rows
        return np.concatenate([
            angular[:turning], linear[: len(self.mechanism.twist_names) - turning]
        ])  # fmt: skip

    def _loop_jacobian(self) -> FloatArray:
        return np.concatenate([
            (self._site_jacobian(one) - self._site_jacobian(two))[1] for one, two in self.loops
        ])  # fmt: skip

    def _loop_drift(self) -> FloatArray:
        return np.concatenate([
            (self._site_drift(one) - self._site_drift(two))[1] for one, two in self.loops
        ])  # fmt: skip
