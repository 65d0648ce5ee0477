"""Scales of charts: colours, axes, the values that are shown."""

import numpy as np
import pytest

from dea_maps.charts.data import log_spaced
from dea_maps.charts.isochrones import isochrone_levels, time_span
from dea_maps.charts.regions import COLOURS
from dea_maps.sweeps.chunks import evenly


def test_colours_rise_in_luminance():
    red, green, blue, _ = COLOURS(np.linspace(0, 1, 128)).T
    luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue
    assert (np.diff(luminance) > 0).all()
    assert luminance[0] > 0.2  # a black line is seen on it


@pytest.mark.parametrize(
    ("values", "log"),
    [
        (np.linspace(1, 9, 5), False),
        (np.geomspace(1, 9, 5), True),
        (np.linspace(0, 9, 5), False),
        (np.array([1.0, 1000.0]), False),
        (np.array([2.0, 3.85, 10.0]), True),
    ],
)
def test_log_spaced(values, log):
    assert log_spaced(values) is log


def test_evenly_spread_indices():
    assert evenly(100, 4).tolist() == [0, 33, 66, 99]
    assert evenly(3, 4).tolist() == [0, 1, 2]


def test_span_of_colours_leaves_out_stray_times():
    times = np.concatenate([np.geomspace(0.1, 10, 1000), [1e-9, 0.0, np.nan, np.inf]])
    least, greatest = time_span(times)
    assert 0.05 < least < 0.2
    assert greatest == pytest.approx(10)
    assert time_span(np.array([0.0, np.nan])) is None
    assert time_span(np.array([3.0])) == (1.5, 6.0)


@pytest.mark.parametrize("span", [(1e-6, 1e6), (0.02, 3.0), (1.1, 1.4), (1.5, 6.0)])
def test_isochrones_are_few_and_round(span):
    levels = isochrone_levels(span)
    assert 2 <= len(levels) <= 13
    assert span[0] <= levels.min() <= levels.max() <= span[1]
    np.testing.assert_allclose(levels, [float(f"{level:.2g}") for level in levels], rtol=1e-12)
