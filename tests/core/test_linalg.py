"""Compiled algebra and indices against NumPy."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pkm_gym.core.indices import angle_of_sine, squared_torque_index
from pkm_gym.core.linalg import (
    cross2,
    dot2,
    squared_singular_values,
    squared_singular_values3,
)


@pytest.fixture
def matrices(rng: np.random.Generator) -> np.ndarray:
    return rng.normal(size=(200, 2, 2)) * 10.0 ** rng.uniform(-3.0, 3.0, (200, 1, 1))


def test_products_of_plane_vectors(matrices: np.ndarray) -> None:
    for a, b in matrices:
        assert dot2(*a, *b) == pytest.approx(a @ b, rel=1e-12, abs=1e-12)
        assert cross2(*a, *b) == pytest.approx(np.linalg.det([a, b]), rel=1e-9, abs=1e-12)


def test_squared_singular_values_agree_with_svd(matrices: np.ndarray) -> None:
    for matrix in matrices:
        a, b = matrix
        found = squared_singular_values(a @ a, b @ b, a @ b, np.linalg.det(matrix) ** 2)
        expected = np.linalg.svd(matrix, compute_uv=False) ** 2
        np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_the_smaller_singular_value_does_not_cancel() -> None:
    # rows (1, 0) and (1, d): det = d, sigma_min -> d / sqrt 2
    d = 1e-7
    _, smaller = squared_singular_values(1.0, 1.0 + d * d, 1.0, d * d)
    assert math.sqrt(smaller) == pytest.approx(d / math.sqrt(2.0), rel=1e-12)


def test_the_torque_index_is_the_norm_of_a_drives_row(rng: np.random.Generator) -> None:
    for _ in range(200):
        rods = rng.uniform(0.0, 2.0 * np.pi, 2)
        w = np.stack([np.cos(rods), np.sin(rods)], axis=-1)
        s = rng.uniform(0.2, 1.0, 2) * [-1.0, 1.0]
        eta = rng.uniform(0.1, 5.0)
        J = w / s[:, None]
        rows = eta * np.linalg.inv(J).T + J
        sine = cross2(*w[0], *w[1])
        for i in range(2):
            found = squared_torque_index(eta, sine * sine, s[i] * s[i])
            assert found == pytest.approx(rows[i] @ rows[i], rel=1e-8)


def test_the_angle_of_a_sine_that_rounding_carried_past_one() -> None:
    assert angle_of_sine(1.0 + 1e-15) == math.pi / 2.0
    assert angle_of_sine(-1.0 - 1e-15) == -math.pi / 2.0
    assert angle_of_sine(0.5) == pytest.approx(math.pi / 6.0)


@pytest.mark.parametrize("sigma", [(1, 1, 0.3), (1, 0.3, 0.3), (1, 1, 1), (1, 1 - 1e-9, 0.5)])
def test_equal_singular_values_of_space_lose_no_digits(
    rng: np.random.Generator, sigma: tuple[float, float, float]
) -> None:
    for _ in range(200):
        turns = np.linalg.qr(rng.normal(size=(2, 3, 3)))[0]
        a, b, c = matrix = turns[0] @ np.diag(sigma) @ turns[1]
        det = np.linalg.det(matrix)
        found = squared_singular_values3(a @ a, b @ b, c @ c, a @ b, a @ c, b @ c, det * det)
        np.testing.assert_allclose(np.sqrt(found), sigma, rtol=1e-13)


def test_squared_singular_values_of_space_agree_with_svd(rng: np.random.Generator) -> None:
    for _ in range(200):
        a, b, c = matrix = rng.normal(size=(3, 3)) * 10.0 ** rng.uniform(-3.0, 3.0)
        det = np.linalg.det(matrix)
        found = squared_singular_values3(a @ a, b @ b, c @ c, a @ b, a @ c, b @ c, det * det)
        expected = np.linalg.svd(matrix, compute_uv=False) ** 2
        np.testing.assert_allclose(found, expected, rtol=1e-8)
