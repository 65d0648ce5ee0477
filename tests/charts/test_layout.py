"""Layout of charts: nothing overlaps or is cut off, in each kind and size, and on axes that are given."""

import itertools

import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

import dea_maps as dm
from dea_maps import charts
from dea_maps.charts.choices import SIZES


def physical(ds):
    return dm.physical(ds, dm.VHB, 100e-6)


KINDS = {
    "phase_diagram": ("step", charts.phase_diagram),
    "failure_curves": ("step", charts.failure_curves),
    "critical_field": ("ramp", lambda ds, ax=None, **_: charts.failure_curves(ds, ax, variable="critical_field", **_)),
    "stretch_chart": ("step", charts.stretch_chart),
    "cycles_chart": ("pulses", charts.cycles_chart),
    "trajectories": ("films", charts.trajectories),
    "hysteresis_loops": ("cycled", charts.hysteresis_loops),
    "program_chart": ("pulses", charts.program_chart),
    "design_chart": ("designed", charts.design_chart),
}


def all_words(figure):
    """Return the boxes of all words on a figure that are seen, in pixels."""
    figure.draw_without_rendering()
    texts = [text for text in figure.findobj(Text) if text.get_visible()]
    ticks = {id(label) for ax in figure.axes for each in (ax, *ax.child_axes) for label in _hidden_labels(each)}
    return {text: Text.get_window_extent(text) for text in texts if text.get_text().strip() and id(text) not in ticks}


def _hidden_labels(ax):
    """Return the labels of ticks that Matplotlib keeps but does not draw."""
    for axis in (ax.xaxis, ax.yaxis):
        low, high = sorted(axis.get_view_interval())
        inside = [axis.get_transform().transform([low, high])]
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
            at = axis.get_transform().transform([tick.get_loc()])[0]
            off = not (inside[0][0] - 1e-9 <= at <= inside[0][1] + 1e-9)
            yield from (label for label in (tick.label1, tick.label2) if off or not label.get_visible())


def shrunk(box):
    return box.padded(-0.5)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("kind", KINDS)
def test_nothing_overlaps_or_is_cut_off(kind, size, request):
    fixture, chart = KINDS[kind]
    ds = request.getfixturevalue(fixture)
    for each in (ds, physical(ds)) if fixture != "designed" else (ds,):
        figure = chart(each, size=size).figure
        assert tuple(figure.get_size_inches()) == SIZES[size][:2]
        boxes = all_words(figure)
        for (one, box), (other, other_box) in itertools.combinations(boxes.items(), 2):
            overlap = shrunk(box).overlaps(shrunk(other_box))
            assert not overlap, f"{one.get_text()!r} lies upon {other.get_text()!r}"
        page = figure.bbox
        for text, box in boxes.items():
            assert page.x0 - 0.5 <= box.x0 <= box.x1 <= page.x1 + 0.5, text
            assert page.y0 - 0.5 <= box.y0 <= box.y1 <= page.y1 + 0.5, text


@pytest.mark.parametrize("size", SIZES)
def test_panels_have_room(cube, size):
    figure = charts.draw(physical(cube), size=size)
    boxes = all_words(figure)
    for (one, box), (other, other_box) in itertools.combinations(boxes.items(), 2):
        assert not shrunk(box).overlaps(shrunk(other_box)), f"{one.get_text()!r} lies upon {other.get_text()!r}"
    assert all(figure.bbox.contains(box.x0, box.y0) and figure.bbox.contains(box.x1, box.y1) for box in boxes.values())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("layout", [None, "constrained"])
def test_a_given_place_is_kept(kind, layout, request):
    fixture, chart = KINDS[kind]
    figure = Figure(figsize=(9, 4), layout=layout)
    left, right = figure.subplots(1, 2)
    others, frame = left.get_position().bounds, right.get_position()
    assert chart(request.getfixturevalue(fixture), left.figure.axes[1]) is right
    assert not left.has_data()
    if layout is None:
        assert left.get_position().bounds == others
        right_end = max(box.x1 for box in all_words(figure).values()) / figure.bbox.width
        assert right_end <= frame.x1 + 0.02
