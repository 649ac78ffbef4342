"""The paper's statements on its simulations are computed, and can fail."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import pkm_gym
from pkm_gym.mechanisms.spr3 import twin
from pkm_gym.mechanisms.spr3.claims import claims, driven
from pkm_gym.mechanisms.spr3.mechanism import Spr3
from pkm_gym.mechanisms.spr3.path import motion

VERDICTS = {
    "Section 2": "holds, but not for a limb in whose plane the path lies",
    "Section 3": "holds for the printed dimensions",
    "Sections 4, 5": "holds",
    "Section 5": "holds",
}


@pytest.fixture(scope="module")
def printed() -> Spr3:
    problem = pkm_gym.make_problem("spr3")
    machine: Any = problem.mechanism(problem.printed_design())
    assert isinstance(machine, Spr3)
    return machine


def verdicts(machine: Spr3, run: Any) -> dict[str, str]:
    return {claim.claim.partition(":")[0]: claim.verdict for claim in claims(machine, run)}


def test_the_statements_hold_at_the_printed_speed(printed: Spr3) -> None:
    run = driven(printed)
    assert verdicts(printed, run) == VERDICTS
    assert np.abs(run.speeds.twin - run.speeds.planned).max() < 1e-6
    assert np.abs(run.speeds.twin - run.speeds.analytic).max() < 1e-8
    assert run.off.max() < 5e-6
    assert run.speeds.times[-1] == pytest.approx(run.plan.times[-1], abs=twin.SOLVER.timestep)


def test_a_twin_of_other_dimensions_contradicts_the_statements(
    printed: Spr3, monkeypatch: pytest.MonkeyPatch
) -> None:
    build = twin.build
    other = replace(printed, b=1.01 * printed.b, q_min=0.4, q_max=0.85)
    monkeypatch.setattr(twin, "build", lambda _, pose: build(other, pose))
    found = verdicts(printed, driven.__wrapped__(printed, 5.0))
    assert found == VERDICTS | {"Sections 4, 5": "contradicted", "Section 5": "contradicted"}


def test_in_a_plane_of_no_leg_every_limb_spins(printed: Spr3) -> None:
    run = driven(printed, 5.0)
    path, speed, acceleration = twin.planned_path(printed)
    slanted = motion(printed, replace(path, gamma=0.5), speed, acceleration)
    assert verdicts(printed, replace(run, plan=slanted))["Section 2"] == "holds"


def test_a_workspace_with_other_volumes_is_found_out(
    printed: Spr3, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pkm_gym.mechanisms.spr3.claims.volume_by_quadrature", lambda _: 0.0125)
    assert verdicts(printed, driven(printed, 5.0))["Section 3"] == "contradicted"


def test_faster_legs_lag_more(printed: Spr3) -> None:
    slow, fast = (driven(printed, haste) for haste in (1.0, 5.0))
    assert fast.speeds.times[-1] == pytest.approx(slow.speeds.times[-1] / 5.0, rel=1e-4)
    assert fast.off.max() > 3.0 * slow.off.max()
