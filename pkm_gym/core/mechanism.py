"""Mechanism: a machine with given dimensions that answers kinematic questions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import Field, dataclass, field, fields
from math import isfinite
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple, Self

import numpy as np

from pkm_gym.core.types import FloatArray

if TYPE_CHECKING:
    from pkm_gym.core.compile import BatchKernel


class Link(NamedTuple):
    """A body of the machine as it is drawn: points (n, 2) in its plane or (n, 3) in space, m.

    An arm of more than two points is a plate; a cylinder's are the barrel's ends and the rod's tip.
    """

    role: Literal["base", "arm", "rod", "cylinder", "platform"]
    points: FloatArray


class IndexMap(NamedTuple):
    """A local index over poses; the design's index is its extreme or mean over the workspace.

    ``drawn`` is False where the extreme may lie outside of what pictures show of the workspace;
    ``doc`` says what it is at one pose, in a few words: a picture's title.
    """

    name: str
    unit: str
    kind: Literal["max", "min", "mean"]
    values: FloatArray
    drawn: bool = True
    doc: str = ""

    def worst(self) -> int | None:
        """Return where, among the flattened values, the extreme is; None for a mean."""
        if self.kind == "mean":
            return None
        return int(np.nanargmax(self.values) if self.kind == "max" else np.nanargmin(self.values))


class Symmetry(NamedTuple):
    """Poses at which a machine is its own image, so that its local indices are the same.

    ``pose`` maps poses (..., k) to their images, ``joints`` their joint coordinates (..., k).
    """

    words: str
    pose: Callable[[FloatArray], FloatArray]
    joints: Callable[[FloatArray], FloatArray]


def dimension(unit: str, doc: str, *, low: float = 0.0, high: float = 1e6, **options: Any) -> Any:
    """Declare a field of a Mechanism: its unit, what it is, and the open range it must lie in."""
    return field(metadata={"unit": unit, "doc": doc, "low": low, "high": high}, **options)


@dataclass(frozen=True, slots=True)
class Mechanism(ABC):
    """Dimensions in SI units and the kinematic verbs, all of them broadcasting.

    ``pose``, ``twist`` and ``joints`` are arrays of shape (..., k), k and the meaning of each entry
    given by ``pose_names``, ``twist_names`` and ``joint_names``. A pose out of reach gives NaN.
    Angular velocities lead the twist, under names that begin with w.
    """

    pose_names: ClassVar[tuple[str, ...]]
    twist_names: ClassVar[tuple[str, ...]]
    joint_names: ClassVar[tuple[str, ...]]
    joint_unit: ClassVar[Literal["m", "rad", ""]] = ""  # of a slider or of a hinge
    drawn_axes: ClassVar[tuple[str, str]] = ("x", "y")  # of the drawing plane
    twin_module: ClassVar[str] = ""  # the module that builds its MuJoCo twin, none if empty
    work: ClassVar[float] = 0.2  # microseconds that a kernel takes for a pose, about

    def __post_init__(self) -> None:
        """Refuse impossible dimensions.

        Raises:
            ValueError: naming the field, its value and the allowed range.
        """
        for item in fields(self):
            check_dimension(item, getattr(self, item.name))

    @abstractmethod
    def inverse_kinematics(self, pose: FloatArray) -> FloatArray:
        """Return the joint coordinates (..., k) of a pose (..., k)."""

    @abstractmethod
    def forward_kinematics(self, joints: FloatArray, near: FloatArray | None = None) -> FloatArray:
        """Return the pose (..., k) of joint coordinates (..., k)."""

    @abstractmethod
    def inverse_jacobian(self, pose: FloatArray) -> FloatArray:
        """Return Ji (..., joints, twist) with joint rates = Ji @ twist."""

    @abstractmethod
    def jacobian(self, pose: FloatArray) -> FloatArray:
        """Return J (..., twist, joints) with twist = J @ joint rates."""

    @abstractmethod
    def twist(self, pose: FloatArray, pose_rate: FloatArray) -> FloatArray:
        """Return the twist (..., k) of a pose that changes at ``pose_rate`` (..., k)."""

    def real(self) -> Self:
        """Return the machine that a twin is built of: itself, unless it is idealised."""
        return self

    @property
    def turning(self) -> int:
        """How many entries of a twist, the first ones, are angular velocities."""
        return sum(name.startswith("w") for name in self.twist_names)

    def units(self) -> dict[str, str]:
        """Return the unit of each dimension, by name."""
        return {item.name: item.metadata["unit"] for item in fields(self)}

    def _batch(
        self,
        kernel: BatchKernel,
        rows: FloatArray,
        shape: tuple[int, ...],
        *arguments: Any,
        length: int | None = None,
    ) -> FloatArray:
        """Return what a kernel fills, called with rows, ``arguments`` and the result: (..., shape).

        Args:
            kernel: of a loop over rows (n, length).
            rows: array (..., length).
            shape: of the result of a row.
            arguments: of the kernel, between rows and result.
            length: of a row; that of a pose if not given.

        Raises:
            ValueError: for an array of another shape.
        """
        length = len(self.pose_names) if length is None else length
        rows = as_rows(rows, length)
        flat = np.ascontiguousarray(rows.reshape(-1, length))
        found = np.empty((len(flat), *shape))
        kernel(self.work * len(flat), flat, *arguments, found)
        return found.reshape(rows.shape[:-1] + shape)

    def symmetries(self) -> tuple[Symmetry, ...]:
        """Return what maps the machine to itself; what they do one after the other follows."""
        return ()

    def passive_lengths(self, pose: FloatArray) -> FloatArray:
        """Return the lengths (..., k), m, of the limbs without a motor; none if not overridden."""
        return np.empty((*np.shape(pose)[:-1], 0))

    # Where limits are looked for ------------------------------------------------------------------

    @abstractmethod
    def search_poses(self) -> FloatArray:
        """Return poses (n, k) all over the workspace, dense enough to find what is worst where."""

    def place(self, pose: FloatArray) -> str:
        """Return in words where a pose (k,) is; x, y and z are taken for metres, others for rad."""
        lengths = ("x", "y", "z")
        named = zip(self.pose_names, np.asarray(pose, dtype=float).tolist(), strict=True)
        words = [
            f"{name} = {1e3 * value:.0f} mm"
            if name in lengths
            else f"{name} = {np.degrees(value):.1f} deg"
            for name, value in named
        ]
        return "at " + ", ".join(words)

    @abstractmethod
    def index_maps(self, pose: FloatArray) -> dict[str, IndexMap]:
        """Return the local indices at poses (..., k), by the name of the design's index."""

    # How a picture is drawn -----------------------------------------------------------------------

    @abstractmethod
    def links(self, pose: FloatArray) -> tuple[Link, ...]:
        """Return the bodies at a pose (k,), NaN where it is out of reach; a base never moves."""

    @abstractmethod
    def workspace(self) -> FloatArray:
        """Return the workspace's outline as a closed polygon (n, 2) in the drawing plane, m."""

    @abstractmethod
    def workspace_grid(self, columns: int, rows: int) -> FloatArray:
        """Return poses (rows, columns, k) over the workspace, or over its section as drawn."""

    def drawn(self, pose: FloatArray) -> FloatArray:
        """Return where poses (..., k) stand in the drawing plane: (..., 2), metres."""
        return np.asarray(pose, dtype=float)[..., :2]

    @abstractmethod
    def sample_poses(self) -> FloatArray:
        """Return two or three telling poses (n, k), the one that stands for the machine first."""


def as_rows(array: FloatArray, length: int) -> FloatArray:
    """Return an array (..., length) of floats.

    Raises:
        ValueError: for one of another shape.
    """
    rows = np.asarray(array, dtype=float)
    if rows.ndim == 0 or rows.shape[-1] != length:
        raise ValueError(f"expected an array of shape (..., {length}), got {rows.shape}")
    return rows


def check_dimension(item: Field[Any], value: float) -> None:
    """Refuse a value outside the open range that the field declares."""
    low, high, unit = (item.metadata[key] for key in ("low", "high", "unit"))
    if not (isfinite(value) and low < value < high):
        allowed = f"greater than {low:g}" + ("" if high >= 1e6 else f" and less than {high:g}")
        raise ValueError(f"{item.name} is {value!r} {unit}: it must be finite and {allowed}")
