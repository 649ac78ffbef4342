"""Settings: the hyperparameters of a surrogate's training."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

NEAREST = 1e-3  # from an optimum, of samples; a share of the range
LEAST = {"updates": 1, "batch_size": 2, "width": 1, "pieces": 1, "splits": 0, "tasks": 0}


@dataclass(frozen=True)
class Settings:
    """The hyperparameters of a surrogate's training.

    Attributes:
        updates: steps of Adam.
        batch_size: samples in each, two of every task.
        learning_rate: its highest and its last value.
        slopes: weight of the slope between the two samples of a task.
        width: of the two hidden layers.
        pieces: of each constraint.
        splits: how often a piece that speaks alone is split, in the first part of the updates.
        tasks: from which the samples are: so many that are drawn from the Family, each sampled near
            the optimum of a solved task nearby; 0: the solved ones themselves. With drawn ones the
            designer begins in the best basin that the surrogate sees, else where ``starts`` says.
        farthest: how far from the optimum samples are, at most, a share of the range.
    """

    updates: int = 20_000
    batch_size: int = 2048
    learning_rate: Sequence[float] = (4e-3, 4e-6)
    slopes: float = 0.03
    width: int = 64
    pieces: int = 4
    splits: int = 30
    tasks: int = 0
    farthest: float = 6e-2

    def __post_init__(self) -> None:
        """Refuse illegal settings."""
        for name, least in LEAST.items():
            value = getattr(self, name)
            if not (isinstance(value, int) and not isinstance(value, bool) and value >= least):
                raise ValueError(f"{name} is {value!r}: it must be a whole number from {least} on")
        rates = self.learning_rate
        pair = isinstance(rates, Sequence) and [type(rate) for rate in rates] == [float, float]
        if not (pair and rates[0] >= rates[1] > 0.0):
            raise ValueError(
                f"learning_rate is {rates!r}: it must be two numbers, the highest and the last"
            )
        if not (isinstance(self.slopes, int | float) and self.slopes >= 0.0):
            raise ValueError(f"slopes is {self.slopes!r}: it must be a number from 0 on")
        if not (isinstance(self.farthest, float) and NEAREST < self.farthest <= 1.0):
            raise ValueError(
                f"farthest is {self.farthest!r}: it must be a number above {NEAREST:g}, to 1"
            )
