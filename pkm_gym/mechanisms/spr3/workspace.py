"""The workspace of the 3-SPR's centre: its six surfaces, its volume three ways, its envelope.

The joint box is mapped one-to-one onto the workspace where det J > 0 on it and each position has
one tilt, as on the printed machine. So the paper's limb-length method takes the six faces of the
box to the six families of surfaces W1 ... W6 that enclose it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from pkm_gym.core.files import whole_file
from pkm_gym.core.sampling import symmetric_cube
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.box import box_means
from pkm_gym.mechanisms.spr3.lockstep import lanes_for

if TYPE_CHECKING:
    import trimesh

    from pkm_gym.mechanisms.spr3.mechanism import Spr3

STEP = 0.005  # m, of the legs along a surface
ALONG = 51  # points of a border curve
CURVES = ((0, 1, 2), (1, 0, 2), (2, 1, 0))  # legs that are held, stepped and running
NODES = 8  # Gauss nodes in each of three directions: 1e-10 of the printed machine's volume
VOXELS = 60  # along each side of the workspace's bounding box


@dataclass(frozen=True)
class Envelope:
    """The closed surface of a workspace.

    Attributes:
        vertices: array (n, 3), m.
        faces: array (k, 3) of vertices, counter-clockwise seen from outside.
        family: array (k,), the surface family 1 ... 6 of each face.
        tilt: array (n,), rad, of the platform at each vertex.
    """

    vertices: FloatArray
    faces: npt.NDArray[np.intp]
    family: npt.NDArray[np.intp]
    tilt: FloatArray

    @property
    def volume(self) -> float:
        """What it encloses, m^3: the divergence theorem."""
        one, two, three = np.moveaxis(self.vertices[self.faces], 1, 0)
        return float((one * np.cross(two, three)).sum() / 6.0)

    @property
    def radius(self) -> float:
        """The largest distance from the axis, m."""
        return float(np.hypot(self.vertices[:, 0], self.vertices[:, 1]).max())

    @property
    def heights(self) -> tuple[float, float]:
        """The smallest and largest z, m."""
        return float(self.vertices[:, 2].min()), float(self.vertices[:, 2].max())

    def write(self, path: str | Path) -> Path:
        """Write the surface whole or not at all, to a .stl, .ply, .obj or .glb file, in metres.

        Raises:
            ValueError: for another extension.
            OSError: where the file can't be written.
        """
        path = Path(path)
        if path.suffix[1:] not in FORMATS:
            raise ValueError(
                f"can't write {str(path)!r}: an envelope's name ends in {', '.join(FORMATS)}"
            )
        with whole_file(path) as part:
            self.mesh().export(part)
        return path

    def mesh(self) -> trimesh.Trimesh:
        """Return the surface for trimesh, in metres."""
        from trimesh import Trimesh

        return Trimesh(vertices=self.vertices, faces=self.faces, process=False)


FORMATS = ("stl", "ply", "obj", "glb")


def envelope(machine: Spr3, step: float = STEP) -> Envelope:
    """Return the envelope of the workspace, the legs in equal steps of at most ``step`` metres.

    Family 2 i - 1 has leg i at its shortest, family 2 i at its longest.

    Raises:
        ValueError: where a parallel singularity cuts the joint box off from home.
    """
    count = int(np.ceil((machine.q_max - machine.q_min) / step - 1e-9))
    lattice, faces, family = _box_surface(count)
    joints = machine.q_min + (machine.q_max - machine.q_min) * lattice / count
    poses = machine.forward_kinematics(joints)
    if not np.isfinite(poses).all():
        raise ValueError(
            "the workspace has no envelope: a parallel singularity cuts through the legs' range"
        )
    tilt = machine.local_indices(poses)["tilt"]
    return Envelope(machine.position(poses), faces, family, tilt)


def border_curves(machine: Spr3, step: float) -> FloatArray:
    """Return the curves (6, k, n, 3), m, of the paper's families W1 ... W6, section 3.

    Of a family, a leg is at an end of its range, a second one has steps of at most ``step`` metres,
    and the third one runs: q_2 and q_3 in W1 and W2, q_1 and q_3 in W3 and W4, q_2 and q_1 in W5
    and W6.
    """
    low, high = machine.q_min, machine.q_max
    stepped = np.linspace(low, high, int(np.ceil((high - low) / step - 1e-9)) + 1)
    running = np.linspace(low, high, ALONG)
    joints = np.empty((6, len(stepped), ALONG, 3))
    for family, (held, moved, run) in enumerate(np.repeat(CURVES, 2, axis=0)):
        joints[family, ..., held] = (low, high)[family % 2]
        joints[family, ..., moved] = stepped[:, None]
        joints[family, ..., run] = running
    return machine.position(machine.forward_kinematics(joints))


def _box_surface(
    count: int,
) -> tuple[FloatArray, npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return lattice points (n, 3) on a cube's faces, triangles (k, 3) and their family (k,)."""
    side = count + 1
    i, j = (axis.ravel() for axis in np.meshgrid(range(count), range(count), indexing="ij"))
    triangles = []
    for leg in range(3):
        for level in (0, count):
            strides = np.roll([side * side, side, 1], -leg)  # of the leg and the two that follow
            corner = level * strides[0] + i * strides[1] + j * strides[2]
            quad = [
                corner,
                corner + strides[1],
                corner + strides[1] + strides[2],
                corner + strides[2],
            ]
            if level == 0:
                quad.reverse()
            one, two, three, four = quad
            triangles += [np.stack([one, two, three], -1), np.stack([one, three, four], -1)]
    numbers, faces = np.unique(np.concatenate(triangles), return_inverse=True)
    lattice = np.stack(np.unravel_index(numbers, (side, side, side)), axis=-1)
    family = np.repeat(np.arange(1, 7), 2 * count * count)
    return lattice.astype(float), faces.reshape(-1, 3), family


def volume_by_surfaces(machine: Spr3, step: float = STEP) -> float:
    """Return the volume that the six surfaces enclose, m^3."""
    return envelope(machine, step).volume


def volume_by_quadrature(machine: Spr3, nodes: int = NODES) -> float:
    """Return the integral of 1 / det J over the joint box, m^3; NaN where det J isn't > 0."""
    lam = (machine.q_max - machine.q_min) / (machine.q_max + machine.q_min)
    cube, weights = symmetric_cube(nodes)
    share, det, volume, _ = box_means(
        machine.a, machine.b, machine.q_c, lam, 0.0, 1.0, cube, weights, lanes_for(len(cube))
    )
    return volume if share == 1.0 and det > 0.0 else float("nan")


def volume_by_voxels(machine: Spr3, count: int = VOXELS) -> float:
    """Return the volume of the voxels whose centres are in reach, m^3; ``count`` along a side."""
    vertices = envelope(machine).vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    steps = (np.arange(count) + 0.5) / count
    axes = [start + (end - start) * steps for start, end in zip(low, high, strict=True)]
    centres = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = np.isfinite(machine.inverse_kinematics(machine.pose_at(centres))).all(axis=1)
    return float(inside.mean() * np.prod(high - low))
