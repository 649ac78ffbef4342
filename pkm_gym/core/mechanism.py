"""Mechanism: a machine with given dimensions that answers kinematic questions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import Field, dataclass, field, fields
from math import isfinite
from typing import Any, ClassVar

from pkm_gym.core.types import FloatArray


def dimension(unit: str, doc: str, *, low: float = 0.0, high: float = 1e6, **options: Any) -> Any:
    """Declare a field of a Mechanism: its unit, what it is, and the open range it must lie in."""
    return field(metadata={"unit": unit, "doc": doc, "low": low, "high": high}, **options)


@dataclass(frozen=True, slots=True)
class Mechanism(ABC):
    """Dimensions in SI units and the kinematic verbs, all of them broadcasting.

    ``pose``, ``twist`` and ``joints`` are arrays of shape (..., k), k and the meaning of each entry
    given by ``pose_names``, ``twist_names`` and ``joint_names``. A pose out of reach gives NaN.
    """

    pose_names: ClassVar[tuple[str, ...]]
    twist_names: ClassVar[tuple[str, ...]]
    joint_names: ClassVar[tuple[str, ...]]

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


def check_dimension(item: Field[Any], value: float) -> None:
    """Refuse a value outside the open range that the field declares."""
    low, high, unit = (item.metadata[key] for key in ("low", "high", "unit"))
    if not (isfinite(value) and low < value < high):
        allowed = f"greater than {low:g}" + ("" if high >= 1e6 else f" and less than {high:g}")
        raise ValueError(f"{item.name} is {value!r} {unit}: it must be finite and {allowed}")
