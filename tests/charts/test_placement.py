"""Where words fit on a chart."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from dea_maps.charts.placement import place_inside, place_on_line

NONE = np.empty((0, 2))


@pytest.fixture
def ax():
    """Return axes 400 pixels wide and 300 high, from 0 to 4 and 0 to 3."""
    figure = Figure(figsize=(4, 3), dpi=100)
    FigureCanvasAgg(figure)
    ax = figure.add_axes((0, 0, 1, 1))
    ax.set(xlim=(0, 4), ylim=(0, 3))
    return ax


def line(*points):
    return [np.array(points, float)]


def test_a_label_goes_to_the_middle_of_a_free_line(ax):
    x, y = place_on_line(ax, line((0, 1.5), (4, 1.5)), (30, 10), [], NONE)
    assert y == pytest.approx(1.5)
    assert 1.4 < x < 2.6


def test_a_label_keeps_away_from_words(ax):
    words = Bbox([[100, 140], [200, 160]])
    x, _ = place_on_line(ax, line((0, 1.5), (4, 1.5)), (30, 10), [words], NONE)
    assert x > 2.3


def test_a_label_keeps_its_height_from_other_lines(ax):
    near = np.column_stack([np.linspace(0, 300, 301), np.full(301, 155.0)])
    x, _ = place_on_line(ax, line((0, 1.5), (4, 1.5)), (30, 10), [], near)
    assert x > 3.05


def test_a_label_takes_the_piece_with_room(ax):
    pieces = line((0.0, 0.1), (0.2, 0.1)) + line((1, 2), (3, 2))
    assert place_on_line(ax, pieces, (30, 10), [], NONE)[1] == pytest.approx(2)


@pytest.mark.parametrize(
    ("pieces", "taken"),
    [
        ([], []),
        (line((1.0, 1.5), (1.2, 1.5)), []),
        (line((0, 0.05), (4, 0.05)), []),
        (line((0, 1.5), (4, 1.5)), [Bbox([[0, 100], [400, 200]])]),
    ],
)
def test_a_line_without_room_has_no_label(ax, pieces, taken):
    assert place_on_line(ax, pieces, (30, 10), taken, NONE) is None


def named(ax, mask):
    words = ax.text(0, 0, "fails at once", ha="center", va="center", fontsize=9)
    x, y = np.linspace(0, 4, mask.shape[1]), np.linspace(0, 3, mask.shape[0])
    return words, place_inside(ax, words, x, y, mask)


def test_a_name_stands_level_in_the_middle_of_a_wide_region(ax):
    mask = np.zeros((31, 41), bool)
    mask[5:16, 20:41] = True
    words, fits = named(ax, mask)
    assert fits
    assert words.get_rotation() == 0
    assert words.get_position() == pytest.approx((2.97, 1.0), abs=0.1)


def test_a_name_stands_upright_in_a_narrow_region(ax):
    mask = np.zeros((31, 41), bool)
    mask[:, 3:6] = True
    words, fits = named(ax, mask)
    assert fits
    assert words.get_rotation() == 90
    assert words.get_position() == pytest.approx((0.4, 1.5), abs=0.1)


def test_a_name_does_not_fit_into_a_sliver(ax):
    mask = np.zeros((31, 41), bool)
    mask[:, 3] = True
    assert not named(ax, mask)[1]


def test_a_name_does_not_bridge_two_regions(ax):
    mask = np.zeros((31, 41), bool)
    mask[:3, :4] = mask[:3, 5:9] = True
    assert not named(ax, mask)[1]
