"""Interpolation: cubic radial basis functions, against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import RBFInterpolator

from pkm_gym.benchmark.interpolation import Cubic


@pytest.mark.parametrize(("m", "n"), [(1, 12), (4, 60), (7, 200)])
def test_the_interpolant_is_scipys_over_stretched_points(rng, m, n):
    points, values = rng.uniform(-0.6, 0.6, (n, m)), rng.normal(size=(n, 3))
    asked = rng.uniform(-0.7, 0.7, (50, m))
    cubic = Cubic.through(points, values)
    other = RBFInterpolator(points * cubic.stretch, values, kernel="cubic", degree=1)
    np.testing.assert_allclose(cubic(asked), other(asked * cubic.stretch), rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(cubic(points), values, rtol=0.0, atol=1e-8)
