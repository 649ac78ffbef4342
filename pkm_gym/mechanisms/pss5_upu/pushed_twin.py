"""The 5-PSS/UPU's twin under a force on its platform: where it comes to rest, by simulation."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from pkm_gym.core.types import FloatArray

STEP = 1e-4  # s: the loops are stiffer than the stiffest servos
STEPS = 100  # between two looks at a twin that comes to rest
LOOKS = 2000
STILL = 1e-9  # m/s or rad/s
INERT = 4.0  # of a slider, over the least that the time step bears with its servo


class Pushed(NamedTuple):
    """Where the twin rests under n forces.

    MuJoCo's coordinates (n, nq), the platform's axes and centre as columns (n, 3, 4), and how far
    the sliders have given way (n, 5), m.
    """

    coordinates: FloatArray
    frames: FloatArray
    deflections: FloatArray


def rest_under(
    spec: mujoco.MjSpec, joints: tuple[str, ...], stiffness: float, forces: FloatArray
) -> Pushed:
    """Let a weightless twin come to rest under forces (n, 3), N, on its platform's centre.

    One after the other. The servos hold the pose that it was built at. At rest neither masses nor
    damping count: the sliders are as inert as a stiff servo needs, and the twin is stopped in the
    middle of each swing.

    Args:
        spec: the twin.
        joints: that are driven.
        stiffness: of the servos, N/m.
        forces: in the mechanism's axes.

    Raises:
        RuntimeError: where it does not come to rest.
    """
    model = spec.compile()
    model.opt.gravity[:], model.opt.timestep = 0.0, STEP
    model.eq_solref[:] = 2.0 * STEP, 1.0
    driven = [model.joint(name) for name in joints]
    values, rates = ([int(x[0]) for x in at] for at in zip(
        *((joint.qposadr, joint.dofadr) for joint in driven), strict=True
    ))  # fmt: skip
    inertia = INERT * stiffness * STEP**2
    model.dof_armature[rates] = inertia
    home = model.qpos0[values]
    for name, value in zip(joints, home, strict=True):
        servo = model.actuator(f"servo_{name}").id
        damping = 2.0 * np.sqrt(inertia * stiffness)
        model.actuator_gainprm[servo, 0] = stiffness
        model.actuator_biasprm[servo, :3] = stiffness * value, -stiffness, -damping
    data = mujoco.MjData(model)
    found = [_rest(model, data, force) for force in forces]
    coordinates = np.array([row for row, _ in found])
    frames = np.array([frame for _, frame in found])
    return Pushed(coordinates, frames, coordinates[:, values] - home)


def _rest(
    model: mujoco.MjModel, data: mujoco.MjData, force: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the coordinates and the platform's frame where the twin rests under a force (3,)."""
    tool, body = model.site("tcp").id, model.body("platform").id
    origin = model.site("origin").id
    speed = 0.0
    for _ in range(LOOKS):
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        axes = data.site_xmat[origin].reshape(3, 3)
        data.qfrc_applied[:] = 0.0
        mujoco.mj_applyFT(
            model, data, axes @ force, np.zeros(3), data.site_xpos[tool], body, data.qfrc_applied
        )
        mujoco.mj_step(model, data, STEPS)
        before, speed = speed, float(np.abs(data.qvel).max())
        if speed < STILL:
            break
        if speed < before:
            data.qvel[:] = speed = 0.0
    else:
        raise RuntimeError(f"the twin doesn't come to rest under {force} N")
    mujoco.mj_forward(model, data)
    moved = axes.T @ (data.site_xpos[tool] - data.site_xpos[origin])
    rotation = axes.T @ data.site_xmat[tool].reshape(3, 3)
    return data.qpos.copy(), np.column_stack([rotation, moved])
