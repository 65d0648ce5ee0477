"""Logarithm and arc tangent of the kernels against mpmath."""

import mpmath
import numpy as np
import pytest

from dea_maps.kernels.elementary import angle, logarithm_of_one_plus

RANDOM = np.random.default_rng(3)


@pytest.mark.parametrize("along", [-1e3, -1.0, -1e-9, 0.0, 1e-9, 1.0, 1e3])
def test_angle(along):
    for across in (1e-12, 1e-3, 0.4, 1.0, 2.5, 1e6, *10 ** RANDOM.uniform(-9, 9, 50)):
        exact = mpmath.atan2(mpmath.mpf(across), mpmath.mpf(along))
        assert abs(angle(np.float64(across), np.float64(along)) / exact - 1) < 1e-15


@pytest.mark.parametrize("x", [-0.5, 0.5**0.5 - 1.0, -1e-16, 1e-300, 0.4142, 0.4143, 1.0, 1e300])
def test_logarithm(x):
    with mpmath.workdps(400):
        assert abs(logarithm_of_one_plus(np.float64(x)) / mpmath.log1p(mpmath.mpf(x)) - 1) < 1e-15


def test_logarithm_everywhere():
    small = RANDOM.choice([-1.0, 1.0], 300) * 10 ** RANDOM.uniform(-30, -0.3, 300)
    for x in (*small, *10 ** RANDOM.uniform(-1, 200, 300)):
        assert abs(logarithm_of_one_plus(np.float64(x)) / mpmath.log1p(mpmath.mpf(x)) - 1) < 2e-15
    assert logarithm_of_one_plus(np.float64(0.0)) == 0.0
