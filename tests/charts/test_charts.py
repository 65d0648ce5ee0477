"""Charts: which one is drawn, what stands on it, that nothing overlaps, and what is refused."""

import itertools
import os

import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import PathCollection, QuadMesh
from matplotlib.figure import Figure

import dea_maps as dm
from dea_maps import charts
from dea_maps.charts.select import draw, phase_diagram, plot
from dea_maps.sweeps.dataset import make_dataset
from dea_maps.sweeps.grid import make_grid
from dea_maps.sweeps.solve import Solution

FIELD = np.linspace(0.8, 2.6, 61)
RATE = np.geomspace(1e-3, 1e3, 43)
RATIO = np.linspace(1.5, 6.0, 41)


def made_up(program, **parameters):
    """Return a map with the right regions, but times and stretches that merely look like it."""
    grid = make_grid(program, **parameters)
    ratio = grid.parameters["modulus_ratio"]
    field = grid.parameters.get("field", np.broadcast_to(9.0, grid.shape))
    rate = grid.parameters.get("rate", np.broadcast_to(np.inf, grid.shape))
    at_once = (field >= np.sqrt(ratio)) & np.isinf(rate)
    outcome = np.select([at_once, field <= 1], [2, 0], 1).astype(np.int8)
    with np.errstate(invalid="ignore", divide="ignore"):
        held = np.pi * (ratio - 1) / (3 * np.sqrt(field - 1)) * np.abs(1 - field / np.sqrt(ratio))
        time = np.where(outcome == 0, np.nan, np.where(at_once, 0.0, held + 1 / rate))
    stretch = np.where(outcome == 0, np.nan, 2 ** (1 / 3) + time / (1 + time))
    provenance = {"method": "none", "formulation": "none", "rtol": 1e-6}
    return make_dataset(grid, Solution(outcome, time, stretch, stretch, field, stretch), provenance)


@pytest.fixture(scope="module")
def step_map():
    return made_up(dm.Step(), field=FIELD, modulus_ratio=RATIO)


@pytest.fixture(scope="module")
def cube():
    return made_up(dm.RampHold(), field=FIELD, rate=RATE, modulus_ratio=[2.0, 3.85, 6.0])


def words_on(ax):
    return [text for text in ax.texts if text.get_text()]


def assert_apart(texts, frame):
    """Check that words overlap neither each other nor the frame."""
    boxes = [text.get_window_extent() for text in texts]
    for one, other in itertools.combinations(boxes, 2):
        assert not one.overlaps(other)
    for box in boxes:
        assert frame.x0 <= box.x0 <= box.x1 <= frame.x1
        assert frame.y0 <= box.y0 <= box.y1 <= frame.y1


def outcome_under(ax, text, ds):
    """Return the outcomes of the cells under some words."""
    box = text.get_window_extent().transformed(ax.transData.inverted())
    corners = itertools.product((box.x0, box.x1), (box.y0, box.y1))
    x, y = ds.outcome.dims
    return {int(ds.outcome.sel({x: x_at, y: y_at}, method="nearest")) for x_at, y_at in corners}


def test_regions_are_named_in_place(step_map):
    ax = phase_diagram(step_map)
    names = {text.get_text(): text for text in words_on(ax)}
    assert outcome_under(ax, names["survives"], step_map) == {0}
    assert outcome_under(ax, names["fails at once"], step_map) == {2}
    assert "unresolved" not in names
    assert ax.get_legend() is None


def test_isochrones_carry_their_times(step_map):
    ax = phase_diagram(step_map)
    labels = [text for text in words_on(ax) if text.get_text()[0].isdigit()]
    assert {"1", "10"} <= {text.get_text() for text in labels}
    for label in labels:
        x, y = label.get_position()
        time = float(step_map.time_to_failure.interp(field=x, modulus_ratio=y))
        assert time == pytest.approx(float(label.get_text()), rel=0.2)


@pytest.mark.parametrize("fixture", ["step_map", "cube"])
def test_words_do_not_overlap(request, fixture):
    figure = draw(request.getfixturevalue(fixture))
    figure.draw_without_rendering()
    for ax in figure.axes:
        assert_apart(words_on(ax), ax.get_window_extent())


def test_labels_of_axes_stay_on_the_page_and_apart(cube):
    figure = draw(cube)
    figure.draw_without_rendering()
    page = figure.bbox
    boxes = [ax.get_tightbbox() for ax in figure.axes]
    for box in boxes:
        assert page.x0 <= box.x0 <= box.x1 <= page.x1
        assert page.y0 <= box.y0 <= box.y1 <= page.y1
    for one, other in itertools.combinations(boxes, 2):
        assert not one.overlaps(other)


def test_axes_say_what_they_show(step_map):
    ax = phase_diagram(step_map)
    assert ax.get_xlabel() == "field $E/E_c$"
    assert ax.get_ylabel() == r"modulus ratio $\mu_U/\mu_R$"
    assert ax.get_title(loc="left").replace("\n", " ") == "step to a held field"
    assert (ax.get_xscale(), ax.get_yscale()) == ("linear", "linear")
    assert ax.get_xlim() == (0.8, 2.6)
    (bar,) = [other for other in ax.figure.axes if other is not ax]
    assert bar.get_ylabel() == r"time to failure $t/\tau$"
    assert bar.get_yscale() == "log"


def test_log_spaced_parameters_get_log_axes(cube):
    ax = phase_diagram(cube.isel(modulus_ratio=1))
    assert (ax.get_xscale(), ax.get_yscale()) == ("linear", "log")
    title = ax.get_title(loc="left").replace("\n", " ")
    assert title == r"ramp to a held field, $\mu_U/\mu_R$ = 3.85"


def test_times_have_their_colours(step_map):
    ax = phase_diagram(step_map)
    (mesh,) = [artist for artist in ax.collections if isinstance(artist, QuadMesh) and artist.norm.vmax > 10]
    shown = mesh.get_array()
    later = step_map.outcome.values.T == 1
    over = [artist for artist in ax.collections if artist.get_zorder() > mesh.get_zorder() and len(artist.get_paths())]
    assert len(over) >= 2  # the regions that survive and fail at once are painted over the colours
    assert not np.ma.getmaskarray(shown)[later].any()
    np.testing.assert_array_equal(shown[later], step_map.time_to_failure.values.T[later])


def test_a_region_too_small_for_its_name_is_in_the_legend():
    ds = made_up(dm.Step(), field=np.linspace(0.99, 2.0, 60), modulus_ratio=np.linspace(5, 6, 20))
    ax = phase_diagram(ds)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["survives"]
    assert "survives" not in [text.get_text() for text in words_on(ax)]


def test_unresolved_cells_are_shown(step_map):
    ds = step_map.copy(deep=True)
    ds.outcome[20:40, 25:38] = 3
    ds.time_to_failure[20:40, 25:38] = np.nan
    ax = phase_diagram(ds)
    (name,) = [text for text in words_on(ax) if text.get_text() == "unresolved"]
    assert outcome_under(ax, name, ds) == {3}


def test_a_map_without_failure_has_no_colour_bar():
    ds = made_up(dm.Step(), field=np.linspace(0.1, 0.9, 9), modulus_ratio=RATIO)
    ax = phase_diagram(ds)
    assert [text.get_text() for text in words_on(ax)] == ["survives"]
    assert len(ax.figure.axes) == 1


def test_draws_on_given_axes(step_map):
    figure = Figure()
    left, right = figure.subplots(1, 2)
    assert phase_diagram(step_map, ax=right) is right
    assert right.get_xlabel()
    assert not left.get_xlabel()


def test_unsorted_repeated_and_falling_values_draw_the_same_map(step_map):
    order = np.random.default_rng(1).permutation(len(FIELD))
    shuffled = step_map.isel(field=[*order, 0], modulus_ratio=slice(None, None, -1))
    one, other = phase_diagram(step_map), phase_diagram(shuffled)
    for mesh, same in zip(one.collections, other.collections, strict=True):
        if isinstance(mesh, QuadMesh):
            np.testing.assert_array_equal(mesh.get_coordinates(), same.get_coordinates())
            np.testing.assert_array_equal(mesh.get_array(), same.get_array())


def test_three_dimensions_give_panels_along_the_shortest(cube):
    figure = draw(cube)
    *panels, bar = figure.axes
    assert [ax.get_title() for ax in panels] == [
        rf"modulus ratio $\mu_U/\mu_R$ = {value}" for value in ("2", "3.85", "6")
    ]
    assert bar.get_ylabel() == r"time to failure $t/\tau$"
    assert panels[0].get_ylabel() == r"ramp rate $k\,\tau/E_c$"
    assert all(ax.get_xlabel() == "field $E/E_c$" for ax in panels)
    spans = {mesh.norm.vmax for ax in panels for mesh in ax.collections if isinstance(mesh, QuadMesh)} - {
        0.0,
        1.0,
    }
    assert len({span for span in spans if span > 100}) == 1


def test_many_values_give_four_panels_evenly_spread():
    ds = made_up(dm.RampHold(), field=FIELD[::4], rate=RATE[::4], modulus_ratio=np.linspace(2, 5, 10))
    *panels, _ = draw(ds).axes
    assert [ax.get_title()[-2:].strip() for ax in panels] == ["2", "3", "4", "5"]


def test_one_dimension_gives_two_curves():
    ds = made_up(dm.Step(), field=FIELD, modulus_ratio=4.0)
    upper, lower = draw(ds).axes
    assert upper.get_ylabel() == r"time to failure $t/\tau$"
    assert upper.get_yscale() == "log"
    assert lower.get_ylabel() == r"critical stretch $\lambda$"
    assert lower.get_xlabel() == "field $E/E_c$"
    assert upper.get_title(loc="left") == r"step to a held field, $\mu_U/\mu_R$ = 4"
    np.testing.assert_array_equal(lower.lines[0].get_ydata(), ds.critical_stretch)
    np.testing.assert_array_equal(upper.lines[0].get_ydata(), ds.time_to_failure.where(ds.outcome == 1))
    assert {text.get_text() for text in upper.texts} == {"survives", "fails at once"}
    assert_apart(upper.texts, upper.get_window_extent())


def test_scattered_samples_give_points():
    random = np.random.default_rng(1)
    sample = {
        "field": xr.DataArray(random.uniform(0.8, 2.6, 50), dims="sample"),
        "modulus_ratio": xr.DataArray(random.uniform(2, 6, 50), dims="sample"),
    }
    ds = made_up(dm.Step(), **sample)
    ax, bar = draw(ds).axes
    assert bar.get_ylabel() == r"time to failure $t/\tau$"
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("field $E/E_c$", r"modulus ratio $\mu_U/\mu_R$")
    points = [artist for artist in ax.collections if isinstance(artist, PathCollection)]
    assert sorted(len(artist.get_offsets()) for artist in points) == sorted(
        int((ds.outcome == outcome).sum()) for outcome in (0, 1, 2)
    )
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["survives", "fails at once"]


def test_samples_along_one_parameter_give_curves():
    ds = made_up(dm.Step(), field=xr.DataArray([1.2, 1.1, 0.9], dims="sample"), modulus_ratio=4.0)
    upper, _ = draw(ds).axes
    assert upper.lines[0].get_xdata().tolist() == [0.9, 1.1, 1.2]


@pytest.mark.parametrize(
    ("ds", "message"),
    [
        (made_up(dm.Step(), field=1.2, modulus_ratio=4), "a chart needs two cells or more; got 1"),
        (made_up(dm.Step(), field=[], modulus_ratio=4), "a chart needs two cells or more; got 0"),
        (
            made_up(dm.Step(), field=[1.2, 1.3], modulus_ratio=4).drop_vars("outcome"),
            "a chart needs the variable outcome; the map lacks it",
        ),
        (
            made_up(dm.Step(), field=[1.2, 1.3], modulus_ratio=4).drop_vars("critical_stretch"),
            "needs the variable critical_stretch; the map lacks it",
        ),
        (
            made_up(dm.Step(), field=xr.DataArray(np.full((2, 2), 1.2), dims=("a", "b")), modulus_ratio=4),
            "a chart of samples needs two parameters that vary; got none",
        ),
    ],
)
def test_what_cannot_be_drawn_is_refused(ds, message):
    with pytest.raises(ValueError, match=message):
        draw(ds)


@pytest.mark.parametrize("dims", [{"rate": 0, "modulus_ratio": 0}, {}])
def test_a_phase_diagram_has_two_dimensions(cube, dims):
    with pytest.raises(ValueError, match="a phase diagram needs two dimensions, each along one parameter; got field"):
        phase_diagram(cube.isel(dims))


@pytest.mark.parametrize(("suffix", "start"), [("png", b"\x89PNG"), ("SVG", b"<?xml"), ("pdf", b"%PDF")])
def test_the_suffix_chooses_the_kind_of_file(step_map, tmp_path, suffix, start):
    plot(step_map, tmp_path / f"chart.{suffix}")
    assert (tmp_path / f"chart.{suffix}").read_bytes().startswith(start)
    assert os.listdir(tmp_path) == [f"chart.{suffix}"]


def test_a_chart_that_cannot_be_written_is_refused_before_drawing(step_map, tmp_path, monkeypatch):
    monkeypatch.setattr(charts, "draw", None)
    with pytest.raises(ValueError, match=r"a chart must be a file ending in .png, .svg, .pdf; got chart"):
        plot(step_map, "chart")
    with pytest.raises(FileNotFoundError, match="there is no folder"):
        plot(step_map, tmp_path / "absent" / "chart.png")


def test_a_chart_that_fails_leaves_the_old_one(step_map, tmp_path, monkeypatch):
    def fail(self, path, **_):
        path.write_text("half")
        raise OSError("the disk is full")

    (tmp_path / "chart.png").write_text("old")
    monkeypatch.setattr(Figure, "savefig", fail)
    with pytest.raises(OSError, match="the disk is full"):
        plot(step_map, tmp_path / "chart.png")
    assert (tmp_path / "chart.png").read_text() == "old"
    assert os.listdir(tmp_path) == ["chart.png"]
