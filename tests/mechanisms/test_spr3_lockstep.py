"""Poses in lockstep are those of paths from home, and their loops vectorise."""

from __future__ import annotations

import math
import re
from typing import Any

import numba
import numpy as np
import pytest
from numpy.lib.recfunctions import structured_to_unstructured

from pkm_gym.core.compile import FLAGS
from pkm_gym.mechanisms.spr3 import indices, lockstep
from pkm_gym.mechanisms.spr3.kinematics import follow, level, pose_at
from pkm_gym.mechanisms.spr3.lockstep import WIDTH, Lanes, filled, lanes_for, solve, solve_places

POSES = 27


def lanes_of(rng: np.random.Generator, q_c: float, lam: float) -> Lanes:
    """Lanes whose legs are drawn from a joint box, some of them at its corners."""
    lanes = lanes_for(POSES)
    share = rng.uniform(-1.0, 1.0, (POSES, 3))
    share[:8] = np.sign(share[:8])
    for name, legs in zip(("q1", "q2", "q3"), q_c * (1.0 + lam * share.T), strict=True):
        lanes.legs[name][:POSES] = legs
    return lanes


@pytest.mark.parametrize("lam", [0.05, 0.2, 0.35, 0.5])
def test_poses_are_those_of_paths_from_home(rng: np.random.Generator, lam: float) -> None:
    at_once = followed = barred = 0
    for _ in range(150):
        a, q_c = rng.uniform(0.05, 2.0), rng.uniform(0.5, 2.0)
        b = 3.0 - a - q_c
        if b < 0.05 or abs(b - a) >= q_c * (1.0 - lam):
            continue
        lanes = lanes_of(rng, q_c, lam)
        lockstep.solve_in_steps(lanes.legs, POSES, q_c, a, b, lanes.poses)
        early = lanes.poses["done"][:POSES] == 1.0
        solve(lanes, POSES, q_c, a, b)
        home = (0.0, 0.0, level(q_c, a, b), q_c, q_c, q_c)
        expected = np.array([follow(*home, *legs, a, b) for legs in lanes.legs[:POSES].tolist()])
        found = structured_to_unstructured(lanes.poses[:POSES])
        np.testing.assert_array_equal(found[:, 3], expected[:, 3])
        reached = found[:, 3] == 1.0
        assert reached[early].all()
        np.testing.assert_allclose(found[reached], expected[reached], rtol=0.0, atol=1e-11)
        at_once += early.sum()
        followed += (reached & ~early).sum()
        barred += (~reached).sum()
    assert at_once > (1000 if lam < 0.3 else 300)
    if lam >= 0.2:
        assert followed > 20
        assert barred > 20


@pytest.mark.parametrize("radius", [0.1, 0.6, 1.5])
def test_places_have_the_poses_of_lines_from_the_axis(
    rng: np.random.Generator, radius: float
) -> None:
    at_once = followed = barred = 0
    for _ in range(100):
        b, lanes = rng.uniform(0.1, 1.5), lanes_for(POSES)
        places = rng.uniform((-radius, -radius, 0.0), (radius, radius, 1.5), (POSES, 3))
        places[0, 2] = -0.3
        for name, column in zip("xyz", places.T, strict=True):
            lanes.places[name][:POSES] = column
        lockstep.solve_places_in_steps(lanes.places, POSES, b, lanes.poses)
        early = lanes.poses["done"][:POSES] == 1.0
        solve_places(lanes, POSES, b)
        expected = np.array([pose_at(*place, b) for place in places.tolist()])
        found = structured_to_unstructured(lanes.poses[:POSES])
        np.testing.assert_array_equal(found[:, 3], expected[:, 3])
        reached = found[:, 3] == 1.0
        assert reached[early].all()
        assert not reached[0]
        np.testing.assert_allclose(found[reached], expected[reached], rtol=0.0, atol=1e-11)
        at_once += early.sum()
        followed += (reached & ~early).sum()
        barred += (~reached).sum()
    assert min(at_once, followed, barred) > 20


def test_legs_in_lanes_are_those_of_one_pose(rng: np.random.Generator) -> None:
    lanes = lanes_of(rng, 1.2, 0.2)
    expected = lanes.legs[:POSES].copy()
    solve(lanes, POSES, 1.2, 0.8, 1.0)
    lockstep.legs_of(lanes, POSES, 0.8, 1.0)
    for name in ("q1", "q2", "q3"):
        np.testing.assert_allclose(lanes.legs[name][:POSES], expected[name], rtol=1e-14)


def test_a_pose_does_not_depend_on_the_lanes_beside_it(rng: np.random.Generator) -> None:
    a, q_c, b = 0.8, 1.2, 1.0
    many = lanes_of(rng, q_c, 0.2)
    solve(many, POSES, q_c, a, b)
    indices.conditioning_of(many, POSES, a, b, 0.0, 1.0)
    for k in range(POSES):
        alone = lanes_for(1)
        alone.legs[0] = many.legs[k]
        solve(alone, 1, q_c, a, b)
        indices.conditioning_of(alone, 1, a, b, 0.0, 1.0)
        assert alone.poses[0] == many.poses[k]
        assert alone.local[0] == many.local[k]


def test_legs_that_do_not_reach_one_another_have_no_pose() -> None:
    lanes = lanes_for(1)
    lanes.legs[0] = (0.5, 0.5, 0.5)
    solve(lanes, 1, 0.5, 0.2, 1.5)
    assert lanes.poses["done"][0] == 0.0
    assert math.isnan(level(0.5, 0.2, 1.5))


def test_lanes_fill_whole_vectors() -> None:
    assert [filled(n) for n in (1, WIDTH, WIDTH + 1)] == [WIDTH, WIDTH, 2 * WIDTH]
    assert all(len(array) == 2 * WIDTH for array in lanes_for(WIDTH + 1))


def compiled_anew(kernel: Any, *arguments: Any) -> str:
    """What the compiler makes of a kernel."""
    compiled = numba.njit(fastmath=FLAGS, error_model="numpy")(kernel.py_func)
    compiled(*arguments)
    (text,) = compiled.inspect_llvm().values()
    return str(text)


def test_the_loops_vectorise(rng: np.random.Generator) -> None:
    a, b, q_c, lanes = 0.8, 1.0, 1.2, lanes_of(rng, 1.2, 0.2)
    lanes.places["x"] = lanes.places["y"] = 0.0
    lanes.places["z"] = 1.0
    for kernel, arguments in (
        (lockstep.solve_in_steps, (lanes.legs, POSES, q_c, a, b, lanes.poses)),
        (lockstep.solve_places_in_steps, (lanes.places, POSES, b, lanes.poses)),
        (lockstep.legs_of, (lanes, POSES, a, b)),
        (indices.conditioning_of, (lanes, POSES, a, b, 0.0, 1.0)),
        (indices.projections_of, (lanes, POSES, a, b)),
    ):
        text = compiled_anew(kernel, *arguments)
        for operation in ("fmul", "fadd", "fdiv"):
            vectors = re.findall(rf"= {operation}[a-z ]* <\d+ x double>", text)
            scalars = re.findall(rf"= {operation}[a-z ]* double", text)  # for what is left over
            assert len(vectors) > 0.4 * len(scalars) > 0, (kernel, operation)
