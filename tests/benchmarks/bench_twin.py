"""MuJoCo steps a second of the twins, one by one and in threads; how fast one is built."""

from __future__ import annotations

import os
from typing import Any

import mujoco
import numpy as np
import pytest
from mujoco.rollout import Rollout

import pkm_gym
from pkm_gym.twin.check import random_designs
from pkm_gym.twin.model import Twin

DESIGNS, STEPS = 32, 200


@pytest.fixture(scope="module", params=["diamond", "spr3"])
def machines(request: pytest.FixtureRequest) -> list[Any]:
    problem = pkm_gym.make_problem(request.param)
    return [problem.mechanism(design) for design in random_designs(problem, DESIGNS, seed=0)]


@pytest.fixture
def twins(machines: list[Any]) -> list[Twin]:
    return [Twin(machine, machine.sample_poses()[0]) for machine in machines]


def name_of(twins: list[Twin]) -> str:
    return twins[0].mechanism.twin_module.split(".")[-2]


def test_steps_one_by_one(benchmark: Any, twins: list[Twin]) -> None:
    def simulate() -> None:
        for twin in twins:
            mujoco.mj_resetData(twin.model, twin.data)
            for _ in range(STEPS):
                mujoco.mj_step(twin.model, twin.data)

    benchmark.extra_info.update(
        row=f"{name_of(twins)} twin, one by one", unit="steps", count=STEPS * DESIGNS
    )
    benchmark.pedantic(simulate, rounds=3, warmup_rounds=1)


def test_steps_in_mujoco_s_threads(benchmark: Any, twins: list[Twin]) -> None:
    threads = os.cpu_count() or 1
    models = [twin.model for twin in twins]
    spec = mujoco.mjtState.mjSTATE_FULLPHYSICS
    states = np.empty((DESIGNS, mujoco.mj_stateSize(models[0], spec)))
    for twin, state in zip(twins, states, strict=True):
        mujoco.mj_getState(twin.model, twin.data, state, spec)
    control = np.zeros((DESIGNS, 1, models[0].nu))
    data = [mujoco.MjData(models[0]) for _ in range(threads)]
    name = name_of(twins)
    benchmark.extra_info.update(
        row=f"{name} twin, mujoco.rollout",
        unit="steps",
        count=STEPS * DESIGNS,
        versus={f"{name} twin, one by one": "one by one"},
    )
    with Rollout(nthread=threads) as rollout:
        benchmark.pedantic(
            lambda: rollout.rollout(models, data, states, control, nstep=STEPS),
            rounds=3,
            warmup_rounds=1,
        )


def test_building(benchmark: Any, machines: list[Any]) -> None:
    machine = machines[0]
    pose = machine.sample_poses()[0]
    name = type(machine).__name__
    benchmark.extra_info.update(row=f"{name} twin, built", target="<= 5 ms")
    benchmark.pedantic(lambda: Twin(machine, pose), rounds=20, warmup_rounds=1)
