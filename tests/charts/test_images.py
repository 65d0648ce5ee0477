"""Pictures of charts, compared with those that somebody has looked at.

``python tests/test_images.py`` draws all of them anew; look at each before it is committed.
"""

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from matplotlib import image
from matplotlib.contour import ContourSet
from scipy import ndimage

import dea_maps as dm
from dea_maps import charts

FOLDER = Path(__file__).parent / "images"
DOTS_PER_INCH = 80
_REACH, _CONTRAST = 4, 60 / 255
"""So far may things move, in pixels, and so much may colours change."""

_MOST_STRANGE, _WORD, _MOST_SIDE_BY_SIDE = 0.002, 15, 20
"""Part of all pixels that may be strange; size of a short word in pixels, and how many may be strange in it."""


def step():
    return dm.sweep(dm.Step(), field=np.linspace(0.7, 2.5, 37), modulus_ratio=np.linspace(1.5, 6.0, 31))


def ramp_hold():
    return dm.sweep(
        dm.RampHold(), field=np.linspace(0.8, 2.2, 25), rate=np.geomspace(1e-3, 1e3, 25), modulus_ratio=[2.0, 3.85]
    )


def films():
    times = np.linspace(0.0, 8.0, 161)
    return dm.trajectory(dm.Step(), time=times, field=[0.8, 1.0, 1.05, 1.1, 1.2, 1.5], modulus_ratio=4.0)


def breakdown():
    ds = step().isel(field=slice(None, None, 4), modulus_ratio=slice(None, None, 4))
    first = ((ds.field > 1.2) & (ds.modulus_ratio > 4.0)).astype(np.int8) * 2
    flags = {"flag_values": np.arange(4, dtype=np.int8), "flag_meanings": "none instability breakdown unresolved"}
    return ds.assign(first_limit=first.assign_attrs(flags))


def design():
    time = np.geomspace(1.0, 1e7, 29)
    voltage = np.outer([1600.0, 800.0, 330.0], 1.0 + 0.96 / np.sqrt(1.0 + time / 200.0))
    limit = np.zeros(voltage.shape, np.int8)
    limit[:2, :8] = 1
    voltage[2, -6:] = np.nan
    limit[2, -6:] = 2
    flags = {"flag_values": np.arange(3, dtype=np.int8), "flag_meanings": "instability breakdown unresolved"}
    return xr.Dataset(
        {
            "allowable_voltage": (("film", "holding_time"), voltage),
            "limit": (("film", "holding_time"), limit, flags),
        },
        {"film": ["VHB, 100 um", "VHB, 50 um", "VHB, 20 um"], "holding_time": time},
    )


def few_times():
    ds = design().isel(holding_time=slice(None, None, 5))
    ds["limit"][1, 2] = 1
    return ds


def pulses():
    return dm.sweep(
        dm.PulseTrain(), field=np.linspace(0.9, 2.2, 14), period=1.0, duty=np.linspace(0.1, 0.9, 9), modulus_ratio=4.0
    )


def lifetimes():
    survived = np.array([1.1744, 1.2799, 1.5283])
    field = np.unique(np.outer(survived, 1.0 + np.geomspace(3e-4, 0.6, 15)))
    return dm.sweep(dm.PulseTrain(), field=field, period=1.0, duty=[0.25, 0.5, 0.65], modulus_ratio=4.0)


def loops(field, last):
    times = np.concatenate([np.linspace(0.0, 3.0, 181), np.linspace(last, last + 1.0, 61)])
    return dm.trajectory(dm.TriangleTrain(), time=times, field=field, period=1.0, modulus_ratio=4.0)


def dead_loads():
    return dm.sweep(dm.Step(), field=np.linspace(0.2, 1.6, 15), modulus_ratio=4.0, prestretch=np.linspace(1.0, 3.0, 11))


def physical(ds):
    return dm.physical(ds, dm.VHB, 50e-6)


PICTURES = {
    "phase_diagram": lambda: charts.draw(step()),
    "phase_diagram_si_slide": lambda: charts.draw(physical(ramp_hold().isel(modulus_ratio=1)), size="slide"),
    "phase_diagram_breakdown": lambda: charts.draw(breakdown()),
    "panels": lambda: charts.draw(ramp_hold()),
    "one_parameter": lambda: charts.draw(step().sel(modulus_ratio=3.0, method="nearest")),
    "failure_curves": lambda: charts.failure_curves(step()).figure,
    "stretch_chart": lambda: charts.draw(step(), chart="stretch_chart"),
    "trajectories_si": lambda: charts.draw(physical(films())),
    "design_chart": lambda: charts.draw(design()),
    "design_chart_few": lambda: charts.draw(few_times()),
    "phase_diagram_pulses": lambda: charts.draw(physical(pulses())),
    "phase_diagram_dead_loads": lambda: charts.draw(dead_loads()),
    "two_values": lambda: charts.draw(step().isel(modulus_ratio=[4, 20], field=slice(None, None, 4))),
    "cycles_chart": lambda: charts.draw(lifetimes(), chart="cycles_chart"),
    "hysteresis_loops": lambda: charts.draw(physical(loops(1.4, 59.0)), chart="hysteresis_loops"),
    "hysteresis_failure": lambda: charts.draw(loops(1.75, 3.0), chart="hysteresis_loops"),
    "program_chart": lambda: charts.draw(physical(pulses()), chart="program_chart"),
}


def as_on_every_machine():
    """Forget a user's settings; words in the font that comes with Matplotlib, as little hinted as can be."""
    mpl.rcdefaults()
    mpl.rcParams["font.family"] = "DejaVu Sans"
    mpl.rcParams["text.hinting"] = "none"


def render(figure, path):
    figure.savefig(path, dpi=DOTS_PER_INCH, metadata={"Software": None})
    return image.imread(path)[..., :3]


def unlike(drawn, kept):
    """Say how unlike two pictures are, where 1 is too much.

    A pixel is strange if it is unlike all those of the other picture near its place: words and lines may move by a few
    pixels, as they do from one release of Matplotlib or FreeType to the next, but not come or go. What counts is how
    many are strange, as they are where a line is missing, and how many are so side by side, as where a word is.
    """
    strange = np.zeros(drawn.shape[:2], bool)
    for here, there in ((drawn, kept), (kept, drawn)):
        size = (2 * _REACH + 1, 2 * _REACH + 1, 1)
        low, high = ndimage.minimum_filter(there, size), ndimage.maximum_filter(there, size)
        strange |= ((here < low - _CONTRAST) | (here > high + _CONTRAST)).any(axis=2)
    densest = ndimage.uniform_filter(strange.astype(float), _WORD).max() * _WORD**2
    return max(strange.mean() / _MOST_STRANGE, densest / _MOST_SIDE_BY_SIDE)


@pytest.fixture(autouse=True)
def plain_settings():
    with mpl.rc_context():
        as_on_every_machine()
        yield


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_is_as_it_was_looked_at(name, tmp_path):
    drawn, kept = render(PICTURES[name](), tmp_path / f"{name}.png"), image.imread(FOLDER / f"{name}.png")[..., :3]
    assert drawn.shape == kept.shape
    assert unlike(drawn, kept) < 1, f"{tmp_path / name}.png is unlike {FOLDER / name}.png"


def test_every_picture_is_compared():
    assert {path.stem for path in FOLDER.glob("*.png")} == set(PICTURES)


def without(kind, figure):
    """Take one thing off a chart."""
    ax = figure.axes[0]
    if kind == "isochrone":
        [artist for artist in ax.collections if isinstance(artist, ContourSet)][1].remove()
    elif kind == "label":
        next(text for text in ax.texts if text.get_text() == "1").remove()
    elif kind == "name":
        next(text for text in ax.texts if text.get_text() == "survives").remove()
    elif kind == "boundary":
        ax.lines[0].remove()
    elif kind == "region":
        next(artist for artist in ax.collections if artist.get_hatch()).remove()
    elif kind == "unit":
        ax.set_xlabel("field")
    elif kind == "colour bar":
        figure.axes[1].set_visible(False)
    return figure


@pytest.mark.parametrize("kind", ["isochrone", "label", "name", "boundary", "region", "unit", "colour bar"])
def test_what_is_missing_is_noticed(kind, tmp_path):
    whole = image.imread(FOLDER / "phase_diagram.png")[..., :3]
    assert unlike(render(without(kind, PICTURES["phase_diagram"]()), tmp_path / "less.png"), whole) > 1


@pytest.mark.parametrize("line", ["curve", "legend"])
def test_a_missing_curve_is_noticed(line, tmp_path):
    figure = PICTURES["failure_curves"]()
    (ax,) = figure.axes
    {"curve": ax.lines[2], "legend": ax.get_legend()}[line].remove()
    whole = image.imread(FOLDER / "failure_curves.png")[..., :3]
    assert unlike(render(figure, tmp_path / "less.png"), whole) > 1


@pytest.mark.parametrize("name", ["phase_diagram", "failure_curves"])
def test_words_may_look_otherwise(name, tmp_path):
    mpl.rcParams["text.hinting"] = "force_autohint"
    drawn, kept = render(PICTURES[name](), tmp_path / "other.png"), image.imread(FOLDER / f"{name}.png")[..., :3]
    assert unlike(drawn, kept) < 1


if __name__ == "__main__":
    as_on_every_machine()
    FOLDER.mkdir(exist_ok=True)
    for each, draw in PICTURES.items():
        render(draw(), FOLDER / f"{each}.png")
