"""The printed machine and machines of every shape, each with its independent model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from pkm_gym.mechanisms.pus6.mechanism import Pus6

from .model import Model


@dataclass(frozen=True)
class Pair:
    """A machine and its model."""

    machine: Pus6
    model: Model

    def poses(self, rng: np.random.Generator, n: int, size: float = 1.0) -> np.ndarray:
        """Random poses (n, 6) of the machine's box, or of one ``size`` times as large."""
        one = self.machine
        half = np.array([one.xy, one.xy, one.z, one.tilt, one.tilt, one.spin])
        return size * half * rng.uniform(-1.0, 1.0, (n, 6))


def pair(L: float, R: float, **more: float) -> Pair:
    """A machine and its model of m and deg."""
    model = Model(L, R, **more)
    angles = {name: float(np.radians(getattr(model, name))) for name in ("phi_A", "phi_C")}
    return Pair(Pus6(L=L, R=R, r_B=model.r_B, tool=model.tool, **angles), model)


@pytest.fixture(scope="session")
def printed() -> Pair:
    """The paper's design."""
    return pair(0.46, 0.19)


@pytest.fixture(scope="session")
def pairs() -> list[Pair]:
    """Machines that reach their box on one side of the singularity, every other with a tool."""
    rng = np.random.default_rng(6)
    found: list[Pair] = []
    while len(found) < 24:
        L, R, r_B, phi_A, phi_C = rng.uniform(
            [0.36, 0.06, 0.30, 4.0, 4.0], [0.60, 0.24, 0.46, 60.0, 60.0]
        ).tolist()
        tool = 0.05 * (len(found) % 2)
        one = pair(L, R, r_B=r_B, phi_A=phi_A, phi_C=phi_C, tool=tool)
        corners = one.model.aspect(one.machine.search_poses())
        if np.isfinite(corners).all() and corners.min() > 0.3:
            found.append(one)
    return found
