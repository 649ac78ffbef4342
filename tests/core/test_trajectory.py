"""The 3-4-5 polynomial and the pick-and-place path."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pkm_gym.core.trajectory import (
    pick_and_place,
    pick_and_place_durations,
    polynomial_345,
    ramped,
)

PATHS = st.builds(
    lambda width, ratio, time, overlap: {
        "width": width, "lift": ratio * width, "time": time, "overlap": overlap
    },
    st.floats(0.05, 2.0), st.floats(0.005, 0.1), st.floats(0.1, 3.0), st.floats(0.0, 0.95),
)  # fmt: skip


def follow(t: np.ndarray, path: dict[str, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, velocities and accelerations (n, 2) at instants (n,)."""
    rows = np.array([pick_and_place(instant, **path) for instant in t])
    return rows[:, :2], rows[:, 2:4], rows[:, 4:]


def test_the_polynomial_is_at_rest_at_both_ends_and_outside() -> None:
    for rho, place in ((-1.0, 0.0), (0.0, 0.0), (1.0, 1.0), (2.0, 1.0)):
        assert polynomial_345(rho) == (place, 0.0, 0.0)
    inside = np.array([polynomial_345(rho) for rho in (1e-7, 1.0 - 1e-7)])
    np.testing.assert_allclose(inside, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], atol=1e-5)


@given(st.floats(0.01, 0.99))
def test_the_polynomials_rates_are_its_derivatives(rho: float) -> None:
    step = 1e-5
    ahead, behind = polynomial_345(rho + step), polynomial_345(rho - step)
    _, rate, bend = polynomial_345(rho)
    assert (ahead[0] - behind[0]) / (2.0 * step) == pytest.approx(rate, abs=1e-8)
    assert (ahead[1] - behind[1]) / (2.0 * step) == pytest.approx(bend, abs=1e-7)


@given(PATHS)
def test_the_durations_add_up_and_reach_the_same_acceleration(path: dict[str, float]) -> None:
    rise, traverse = pick_and_place_durations(**path)
    assert traverse + 2.0 * (1.0 - path["overlap"]) * rise == pytest.approx(path["time"])
    assert path["lift"] / rise**2 == pytest.approx(path["width"] / traverse**2)


@given(PATHS)
def test_the_path_starts_and_ends_at_rest_at_its_ends(path: dict[str, float]) -> None:
    for t, side in ((0.0, -0.5), (path["time"], 0.5)):
        place, velocity, acceleration = follow(np.array([t]), path)
        np.testing.assert_allclose(place[0], [side * path["width"], 0.0], atol=1e-12)
        np.testing.assert_allclose(velocity[0] * path["time"], 0.0, atol=1e-9)
        np.testing.assert_allclose(acceleration[0] * path["time"] ** 2, 0.0, atol=1e-6)


@given(PATHS)
def test_velocities_and_accelerations_are_derivatives(path: dict[str, float]) -> None:
    t = np.linspace(0.0, path["time"], 203)[1:-1]
    step = 1e-5 * path["time"]
    _, velocity, acceleration = follow(t, path)
    ahead, behind = follow(t + step, path), follow(t - step, path)
    slope = (ahead[0] - behind[0]) / (2.0 * step)
    np.testing.assert_allclose(slope, velocity, rtol=0.0, atol=1e-6 * np.abs(velocity).max())
    # the third derivative jumps where a move begins or ends, so this one is right to O(step) there
    bend = (ahead[1] - behind[1]) / (2.0 * step)
    scale = np.abs(acceleration).max()
    np.testing.assert_allclose(bend, acceleration, rtol=0.0, atol=2e-3 * scale)


@given(PATHS)
def test_the_path_is_mirrored_in_time_and_stays_in_its_box(path: dict[str, float]) -> None:
    t = np.linspace(0.0, path["time"], 101)
    place, _, _ = follow(t, path)
    np.testing.assert_allclose(place[::-1] * [-1.0, 1.0], place, rtol=0.0, atol=1e-9)
    assert (np.abs(place[:, 0]) <= 0.5 * path["width"] * (1.0 + 1e-12)).all()
    assert (place[:, 1] >= -1e-12).all()
    assert (place[:, 1] <= path["lift"] * (1.0 + 1e-12)).all()


def test_without_overlap_it_lifts_before_it_crosses() -> None:
    path: dict[str, Any] = {"width": 0.8, "lift": 0.06, "time": 0.3, "overlap": 0.0}
    rise, traverse = pick_and_place_durations(**path)
    place, _, _ = follow(np.array([0.99 * rise, 1.01 * rise, rise + 0.99 * traverse]), path)
    assert place[0, 0] == -0.4
    assert place[1, 0] > -0.4
    np.testing.assert_allclose(place[1:, 1], 0.06)


@given(st.floats(1.0, 20.0), st.floats(0.05, 0.5))
def test_a_ramped_feed_goes_from_rest_to_rest_and_is_steady_between(duration, share):
    ramp = share * duration
    times = np.linspace(0.0, duration, 2001)
    way, speed = ramped(times, duration, ramp)
    assert way[0] == speed[0] == speed[-1] == 0.0
    assert way[-1] == pytest.approx(duration - ramp)
    np.testing.assert_allclose(np.gradient(way, times)[1:-1], speed[1:-1], atol=2e-4)
    steady = (times >= ramp) & (times <= duration - ramp)
    np.testing.assert_allclose(speed[steady], 1.0)
    np.testing.assert_allclose(speed, speed[::-1], atol=1e-12)
    bend = np.gradient(speed, times)
    assert abs(bend[[0, -1]]).max() < 0.05 * abs(bend).max()
