"""What a machine's cycle asks of motors and gears, and the smallest that carry it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from pkm_gym.core.drives import Drives
from pkm_gym.core.motors import DIRECT, Gear, Motor, MotorTable
from pkm_gym.core.types import FloatArray


class Demand(NamedTuple):
    """What is asked of a part over the cycle, and what it can give, in one unit."""

    what: str
    asked: float
    given: float
    unit: str

    @property
    def share(self) -> float:
        """Asked over given: it holds up to 1."""
        return self.asked / self.given


class Fit(NamedTuple):
    """A motor with a gear, and what the cycle asks of them at the worst drive."""

    motor: Motor
    gear: Gear
    demands: tuple[Demand, ...]

    @property
    def load(self) -> float:
        """The largest share of what motor and gear can give: they carry the cycle up to 1."""
        return max(demand.share for demand in self.demands)

    @property
    def carries(self) -> bool:
        """Whether they carry the cycle."""
        return self.load <= 1.0

    @property
    def inertia(self) -> float:
        """Of rotor and gear about the drive's axis, kg m^2."""
        return self.gear.ratio**2 * (self.motor.inertia + self.gear.inertia)


def motor_torques(drives: Drives, motor: Motor, gear: Gear) -> FloatArray:
    """Return the torques (n, joints) of a motor that drives a machine through a gear, N m.

    T = (J_m + J_g) n theta'' + tau / (n eta), and eta tau / n where the machine drives the motor: a
    gear loses either way.
    """
    driving = drives.torques * drives.rates >= 0.0
    share = np.where(driving, 1.0 / gear.efficiency, gear.efficiency)
    spun = (motor.inertia + gear.inertia) * gear.ratio * drives.accelerations
    return np.asarray(spun + share * drives.torques / gear.ratio)


def fit(drives: Drives, motor: Motor, gear: Gear) -> Fit:
    """Return what a cycle, repeated without a rest, asks of a motor with a gear."""
    torques = motor_torques(drives, motor, gear)
    fastest = gear.ratio * float(np.abs(drives.rates).max())
    return Fit(motor, gear, (
        Demand("peak torque", float(np.abs(torques).max()), motor.torque_peak, "N m"),
        Demand("rms torque", float(drives.rms(torques).max()), motor.torque, "N m"),
        Demand("speed", fastest, motor.speed, "rad/s"),
        Demand("gear torque", float(np.abs(drives.torques).max()), gear.torque_peak, "N m"),
        Demand("gear speed", fastest, gear.speed, "rad/s"),
    ))  # fmt: skip


def fits(drives: Drives, table: MotorTable) -> tuple[Fit, ...]:
    """Return the best that each motor can do, from the lightest motor on.

    That is with the lightest gear that carries the cycle, the ratio of which leaves the most in
    reserve; of a motor that carries it with none, with the gear that comes closest.
    """
    return tuple(
        _best(fit(drives, motor, gear) for gear in (DIRECT, *table.gears)) for motor in table.motors
    )


def _best(candidates: Iterable[Fit]) -> Fit:
    def rank(one: Fit) -> tuple[bool, float, float]:
        return not one.carries, one.gear.mass if one.carries else 0.0, one.load

    return min(candidates, key=rank)


def pick(candidates: Iterable[Fit]) -> Fit | None:
    """Return the first that carries the cycle, of fits from the lightest motor on; None if none."""
    return next((one for one in candidates if one.carries), None)
