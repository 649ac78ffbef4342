"""Where quadratic models are highest, against grids over the line and the rectangle."""

from __future__ import annotations

import numpy as np
import pytest

from pkm_gym.core.quadratic import highest_in_rectangle, highest_on_line

GRID = np.linspace(-1.0, 1.0, 201)


def models(rng: np.random.Generator, n: int) -> list[tuple[np.ndarray, np.ndarray]]:
    hessians = rng.normal(size=(n, 2, 2))
    return list(zip(rng.normal(size=(n, 2)), hessians + hessians.swapaxes(1, 2), strict=True))


def height(slope: np.ndarray, hessian: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    quadratic = hessian[0, 0] * u * u + 2.0 * hessian[0, 1] * u * v + hessian[1, 1] * v * v
    return slope[0] * u + slope[1] * v + 0.5 * quadratic


def found(slope: np.ndarray, hessian: np.ndarray, v_first: bool) -> tuple[float, float]:
    (huu, huv), (_, hvv) = hessian
    return highest_in_rectangle(*slope, huu, huv, hvv, -1.0, 1.0, -1.0, 1.0, v_first)


def test_a_line_is_highest_at_its_vertex_or_uphill(rng: np.random.Generator) -> None:
    for slope, bend in rng.normal(size=(200, 2)):
        at = highest_on_line(slope, bend, -1.0, 1.0)
        assert -1.0 <= at <= 1.0
        here, there = (slope * t + 0.5 * bend * t * t for t in (at, GRID))
        if bend < 0.0:
            assert here >= there.max() - 1e-12
        else:
            assert at == np.sign(slope)


@pytest.mark.parametrize("v_first", [False, True])
def test_a_concave_model_is_highest_there(rng: np.random.Generator, v_first: bool) -> None:
    everywhere = np.meshgrid(GRID, GRID)
    concave = [m for m in models(rng, 400) if np.linalg.eigvalsh(m[1])[-1] < 0.0]
    assert len(concave) > 20
    inside = 0
    for slope, hessian in concave:
        u, v = found(slope, hessian, v_first)
        inside += abs(u) < 1.0 and abs(v) < 1.0
        top = height(slope, hessian, *everywhere).max()
        assert height(slope, hessian, np.array(u), np.array(v)) >= top - 1e-9
    assert inside > 5


def test_the_two_ways_up_a_saddle_are_two_sides_of_it() -> None:
    slope, hessian = np.array([0.1, -0.1]), np.array([[-1.0, 3.0], [3.0, -1.0]])
    first, second = (found(slope, hessian, v_first) for v_first in (False, True))
    assert first != second
    for u, v in (first, second):
        here = height(slope, hessian, np.array(u), np.array(v))
        assert here >= height(slope, hessian, GRID, np.array(v)).max() - 1e-12
