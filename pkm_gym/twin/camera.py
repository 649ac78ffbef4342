"""Pictures of twins: still ones, and the frames of a movie along its path."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.types import FloatArray
from pkm_gym.twin.model import Twin

Pixels = npt.NDArray[np.uint8]

GEOMS = 200  # that a scene may hold, beside a line
FINE = 4  # points of an engraved line a frame of a movie
WHOLE = 100  # frames' worth of points of a line in a still picture
LINE = 0.0016  # m, wide
BRIGHT = (0.98, 0.93, 0.80, 1.0)  # of a line
NO_GL = (
    "MuJoCo can't draw here: there is no OpenGL; without a screen install EGL (on Debian and "
    "Ubuntu: apt-get install libegl1) and set MUJOCO_GL=egl before Python starts"
)


class Camera:
    """Draws any number of twins; OpenGL starts with the first picture.

    Args:
        width: pixels.
        height: pixels.
    """

    def __init__(self, width: int = 1280, height: int = 960) -> None:
        self.width, self.height = width, height
        self._gl: Any = None
        self._context: Any = None

    def shot(self, twin: Twin, lines: Sequence[FloatArray] = ()) -> Pixels:
        """Return a picture (height, width, 3) of a twin as it stands.

        ``lines`` are drawn through points (n, 3), m, in the mechanism's frame.

        Raises:
            OSError: where MuJoCo can't draw.
        """
        model, data = twin.model, twin.data
        if self._context is None:
            self._open(model)
        self._gl.make_current()
        self._adjust(model)
        scene = mujoco.MjvScene(model, GEOMS + sum(map(len, lines)))
        camera = mujoco.MjvCamera()
        camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        camera.fixedcamid = model.camera("picture").id
        everything = mujoco.mjtCatBit.mjCAT_ALL
        option = mujoco.MjvOption()
        mujoco.mjv_updateScene(model, data, option, None, camera, everything, scene)
        for line in lines:
            _draw(scene, twin.in_world(line))
        view = mujoco.MjrRect(0, 0, self.width, self.height)
        pixels = np.empty((self.height, self.width, 3), dtype=np.uint8)
        mujoco.mjr_render(view, scene, self._context)
        mujoco.mjr_readPixels(pixels, None, view, self._context)
        return pixels[::-1].copy()

    def close(self) -> None:
        """Give OpenGL back; the next picture starts it again."""
        if self._context is not None:
            self._gl.make_current()
            self._context.free()
            self._gl.free()
            self._gl = self._context = None

    def __enter__(self) -> Camera:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __getstate__(self) -> dict[str, Any]:
        """Leave OpenGL where it was started."""
        return {"width": self.width, "height": self.height, "_gl": None, "_context": None}

    def _open(self, model: mujoco.MjModel) -> None:
        """Start OpenGL; the twins share textures, so that one context draws them all."""
        visual = model.vis.global_
        visual.offwidth, visual.offheight = self.width, self.height
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # glfw's, before it fails
                self._gl = mujoco.GLContext(self.width, self.height)
                self._gl.make_current()
                self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        except Exception as error:  # each platform's library raises its own
            self._gl = None
            raise OSError(NO_GL) from error
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)

    def _adjust(self, model: mujoco.MjModel) -> None:
        """Set what a context takes from the size of the model that it was made for."""
        context, extent, scale = self._context, model.stat.extent, model.vis.map
        context.shadowClip, context.shadowScale = extent * scale.shadowclip, scale.shadowscale
        context.fogStart, context.fogEnd = extent * scale.fogstart, extent * scale.fogend


def first_pose(mechanism: Mechanism) -> FloatArray:
    """Return the pose (k,) that stands for a machine: the first within reach.

    Raises:
        ValueError: where the machine reaches nothing of its workspace.
    """
    grid = mechanism.workspace_grid(9, 5).reshape(-1, len(mechanism.pose_names))
    poses = np.concatenate([mechanism.sample_poses(), grid])
    reached = np.isfinite(mechanism.inverse_kinematics(poses)).all(axis=1)
    if not reached.any():
        raise ValueError("there is nothing to draw: the machine reaches no pose of its workspace")
    return np.asarray(poses[np.argmax(reached)])


def picture(mechanism: Mechanism, camera: Camera, pose: FloatArray | None = None) -> Pixels:
    """Return a picture (height, width, 3) of a machine at a pose (k,), or where it stands best.

    What the machine engraves is done.

    Raises:
        ValueError: for a pose out of reach, or a machine that reaches nothing.
        OSError: where MuJoCo can't draw.
    """
    twin = Twin(mechanism, first_pose(mechanism) if pose is None else pose)
    points, cuts = _engraved(twin, WHOLE)
    return camera.shot(twin, [points[cuts]])


def movie(mechanism: Mechanism, camera: Camera, frames: int) -> Iterator[Pixels]:
    """Yield pictures of the machine on its path at equal time steps.

    Once around a path that ends where it began, there and back on another.

    Raises:
        ValueError: for a machine that can't follow the path.
        OSError: where MuJoCo can't draw.
    """
    twin = Twin(mechanism, first_pose(mechanism))
    course = twin.module.course
    poses = course(mechanism, frames // 2 + 1).poses
    if np.allclose(poses[0], poses[-1]):
        poses = course(mechanism, frames + 1).poses[:-1]
    else:
        poses = np.concatenate([poses, poses[-2:0:-1]])
    if not np.isfinite(mechanism.inverse_kinematics(poses)).all():
        raise ValueError("its path leaves the reach of this machine: choose another design")
    points, cuts = _engraved(twin, frames)
    for k, row in enumerate(twin.coordinates(poses)):
        twin.place(row)
        done = slice(0, FINE * k + 1)
        yield camera.shot(twin, [points[done][cuts[done]]])


def _engraved(twin: Twin, frames: int) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Return the tool's positions (n, 3), m, once along its path, and where it leaves a line (n,).

    No positions of a machine that leaves none.
    """
    module: Any = twin.module
    if not hasattr(module, "engraves"):
        return np.empty((0, 3)), np.empty(0, dtype=bool)
    poses = module.course(twin.mechanism, FINE * frames + 1).poses
    return module.frames(twin.mechanism, poses)[..., 3], module.engraves(twin.mechanism, poses)


def _draw(scene: mujoco.MjvScene, points: FloatArray) -> None:
    """Add a line through points (n, 3), m, of the world to a scene."""
    for one, other in pairwise(points):
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(
            geom, mujoco.mjtGeom.mjGEOM_CAPSULE, np.zeros(3), np.zeros(3), np.zeros(9),
            np.array(BRIGHT, dtype=np.float32),
        )  # fmt: skip
        mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_CAPSULE, 0.5 * LINE, one, other)
        scene.ngeom += 1
