"""Machines of the 5-PSS/UPU beside the second model, and poses that both reach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu

from .model import Model

FIVE = np.array([0.0, 72.0, 144.0, 216.0, 288.0])
BEST = {  # the page's, rounded
    "r": 0.358, "R": 0.633, "L": 0.509, "theta": 56.2, "lam0": 0.97,
    "q": (77.0, 170.0), "b": (114.0, 134.0),
}  # fmt: skip
GOOD = {
    "r": 0.290, "R": 0.595, "L": 0.615, "theta": 56.0, "lam0": 0.97,
    "q": (20.0, 142.0), "b": (100.0, 170.0),
}  # fmt: skip
PAPER = {
    "r": 0.303, "R": 0.646, "L": 0.551, "theta": 30.0, "lam0": 0.8,
    "q": (72.0, 144.0), "b": (72.0, 144.0),
}  # fmt: skip


@dataclass(frozen=True)
class Pair:
    """A machine and the model of the same dimensions."""

    machine: Pss5Upu
    model: Model

    def poses(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """Poses (n, 5) of the box."""
        return self.machine.in_box(rng.uniform(-1.0, 1.0, (n, 5)))


def around(pair: tuple[float, float]) -> np.ndarray:
    """The azimuths of five joints, degrees: limbs 5 and 4 mirror 2 and 3."""
    second, third = pair
    return np.array([0.0, second, third, -third, -second])


def made(of: dict, upu: bool) -> Pair:
    """Machine and model of dimensions as the page lists them."""
    offsets = np.radians([of["q"][0] - 72, of["q"][1] - 144, of["b"][0] - 72, of["b"][1] - 144])
    a2, a3, b2, b3 = offsets.tolist()
    lengths = {name: of[name] for name in ("r", "R", "L")}
    machine = Pss5Upu(
        **lengths, theta=float(np.radians(of["theta"])), lam0=of["lam0"],
        a2=a2, a3=a3, b2=b2, b3=b3, upu=float(upu), rail=0.55,
    )  # fmt: skip
    return Pair(
        machine, Model(**lengths, theta=of["theta"], q=around(of["q"]), b=around(of["b"]), upu=upu)
    )


@pytest.fixture(scope="session", params=["paper", "BEST", "GOOD"])
def layout(request: pytest.FixtureRequest) -> dict:
    return {"paper": PAPER, "BEST": BEST, "GOOD": GOOD}[request.param]


@pytest.fixture(scope="session", params=["euler0", "upu"])
def both(request: pytest.FixtureRequest, layout: dict) -> Pair:
    return made(layout, request.param == "upu")
