"""Pages to explore: what is on them, what is left out and said to be, what is refused, that nothing is lost."""

import builtins
import re
import sys

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.explorer import cells as explorer_cells
from dea_maps.explorer import curves as explorer_curves
from dea_maps.explorer.cells import cells_of, columns, plain_label, thinned
from dea_maps.explorer.curves import curves_of

pytest.importorskip("bokeh")

from dea_maps.explorer.export import draw, explore

FIELD = np.linspace(0.8, 2.2, 15)
RATE = np.geomspace(1e-2, 1e2, 9)
RATIO = [6.0, 2.0, 3.85]


@pytest.fixture(scope="module")
def cube():
    return dm.sweep(dm.RampHold(), field=FIELD, rate=RATE, modulus_ratio=RATIO)


@pytest.fixture(scope="module")
def step_map():
    return dm.sweep(dm.Step(), field=FIELD, modulus_ratio=[2.0, 3.0, 4.0, 5.0])


def legend_of(html):
    """Return the legend of the map, which names the outcomes that are on it."""
    return html[html.index('<p class="legend">') : html.index('<div id="map"')]


def words_of(html):
    """Return what can be read on a page, without scripts and styles."""
    body = html[html.index("<main>") : html.index("</footer>")]
    return " ".join(re.sub("<[^>]*>", " ", body).split())


def test_a_page_holds_all_it_needs(cube):
    html = draw(cube)
    assert html.lstrip().startswith("<!DOCTYPE html>")
    markup = re.sub(r"(<(script|style)[^>]*>).*?</\2>", r"\1", html, flags=re.DOTALL)
    assert len(markup) < 10_000
    assert "src" not in markup and "href" not in markup and "http" not in markup
    assert len(html) < 4e6
    assert "ramp hold" in html[html.index("<title>") : html.index("</title>")]


def test_a_page_says_how_to_read_it_and_whence_it_is(cube):
    html = draw(cube)
    words = words_of(html)
    assert "The slider changes the modulus ratio" in words
    assert "survives" in legend_of(html)
    assert "fails at once" not in legend_of(html)
    assert "All 405 cells of the map are shown" in words
    assert "rtol = 1e-06" in words
    assert f"Made by dea_maps {dm.__version__} from a map. dea_maps {dm.__version__}: ramp_hold, field=15 val" in words
    assert "modulus ratio μU/μR: unrelaxed shear modulus over relaxed shear modulus" in words


def test_a_page_names_the_file_of_the_map(step_map, tmp_path):
    step_map.to_netcdf(tmp_path / "films.nc")
    with xr.open_dataset(tmp_path / "films.nc") as ds:
        words = words_of(draw(ds))
    assert "from films.nc." in words
    assert str(tmp_path) not in words
    assert "fails at once" in words


def test_the_same_map_gives_the_same_page(step_map):
    assert draw(step_map) == draw(step_map)


def test_the_shortest_dimension_is_on_the_slider_and_all_values_rise(cube):
    cells = cells_of(cube)
    assert (cells.x.name, cells.y.name, cells.across[0].name) == ("field", "rate", "modulus_ratio")
    assert cells.shape == (3, 9, 15)
    np.testing.assert_array_equal(cells.across[0].values["modulus_ratio"], [2.0, 3.85, 6.0])
    part = cube.sel(modulus_ratio=3.85).transpose("rate", "field")
    shown = columns(cells, 1)
    np.testing.assert_array_equal(shown["outcome"], part.outcome.values.ravel())
    np.testing.assert_array_equal(shown["time_to_failure"], part.time_to_failure.values.ravel().astype("f4"))


def test_curves_end_where_the_map_says(cube):
    cells = cells_of(cube)
    curves = curves_of(cells)
    found = {name: cells.ds[name].values.ravel() for name in cells.ds}
    stretch = curves.stretch.values
    fails = found["outcome"] == 1
    np.testing.assert_allclose(curves.span[fails], found["time_to_failure"][fails], rtol=1e-6)
    np.testing.assert_allclose(stretch[fails, -1], found["critical_stretch"][fails], rtol=2e-5)
    survives = found["outcome"] == 0
    assert survives.any()
    np.testing.assert_allclose(stretch[survives, -1], found["final_stretch"][survives], rtol=1e-3)
    assert (np.diff(curves.time.values, axis=1) >= 0).all()


def test_curves_are_those_of_trajectory():
    ds = dm.sweep(dm.RampHold(), field=[1.2, 1.3], rate=0.5, modulus_ratio=4.0)
    curves = curves_of(cells_of(ds))
    times = curves.time.values[0] * float(curves.span[0])
    stretch = curves.stretch.values[0]
    film = dm.trajectory(dm.RampHold(), time=times[:-1], field=1.2, rate=0.5, modulus_ratio=4.0)
    np.testing.assert_allclose(stretch[:-1], film.stretch.values, rtol=2e-4)
    assert np.isclose(times, 1.2 / 0.5, rtol=1e-4).any()  # the kink where the ramp ends is on the curve


def test_what_fails_at_once_or_is_unresolved_has_no_curve(step_map):
    ds = step_map.copy(deep=True)
    ds.outcome[4, :] = 3
    ds.time_to_failure[4, :] = np.nan
    cells = cells_of(ds)
    curves = curves_of(cells)
    outcome = cells.ds.outcome.values.ravel()
    assert set(outcome) == {0, 1, 2, 3}
    assert (curves.span[outcome >= 2] == 0).all()
    assert (curves.span[outcome < 2] > 0).all()
    assert "unresolved" in legend_of(draw(ds))


def test_films_that_take_too_long_have_no_curve(cube, monkeypatch):
    cells = cells_of(cube)
    whole = curves_of(cells).span
    monkeypatch.setattr(explorer_curves, "MOST_TIME", float(whole.sum()) / 10)
    some = curves_of(cells).span
    assert 0 < (some > 0).sum() < (whole > 0).sum()
    assert whole[some == 0].min() >= some.max()


def test_a_map_of_few_variables_in_single_precision(cube):
    small = cube[["outcome"]].assign(time_to_failure=cube.time_to_failure.astype("f4"))
    least, whole = curves_of(cells_of(small)), curves_of(cells_of(cube))
    np.testing.assert_allclose(least.span, whole.span, rtol=1e-3)
    np.testing.assert_allclose(least.stretch.values, whole.stretch.values, atol=1e-3)
    assert "critical stretch" not in draw(dm.physical(small, dm.VHB, 100e-6))


def test_a_large_map_is_thinned_and_the_page_says_so(monkeypatch):
    ds = dm.sweep(dm.Step(), field=np.linspace(0.8, 2.2, 60), modulus_ratio=np.linspace(2, 6, 50))
    monkeypatch.setattr(explorer_cells, "_BYTES", 90_000)
    cells = cells_of(ds)
    assert cells.ds.outcome.size <= 500
    assert (cells.x.values["field"][[0, -1]] == [0.8, 2.2]).all()
    kept = {axis.name: axis.number for axis in cells.axes}
    assert 2 < kept["modulus_ratio"] < 50
    words = words_of(draw(ds))
    assert "Thinned, so that this page stays small" in words
    assert f"{kept['field']} of 60 values of field" in words
    assert f"{kept['modulus_ratio']} of 50 values of modulus ratio" in words


@pytest.mark.parametrize("totals", [[1000, 1000, 1000], [7, 10**6], [10**6], [300, 2, 10**4], [100, 100, 3]])
def test_never_more_cells_than_asked(totals):
    kept = thinned(totals, 30_000)
    assert np.prod(kept) <= 30_000
    assert all(2 <= number <= total for number, total in zip(kept, totals, strict=True))


def test_repeated_and_single_values():
    ds = dm.sweep(dm.RampHold(), field=[1.3, 1.1, 1.3], rate=[1.0], modulus_ratio=4.0)
    cells = cells_of(ds)
    assert cells.shape == (1, 1, 2)
    assert cells.x.total == 2
    assert "ramp rate k τ/Ec = 1, modulus ratio μU/μR = 4" in words_of(draw(ds))


def test_a_film_in_volts_and_seconds(cube):
    words = words_of(draw(dm.physical(cube, dm.VHB, 100e-6)))
    assert "100 µm thick" in words
    cells = cells_of(dm.physical(cube, dm.VHB, 100e-6))
    assert (cells.x.shown, cells.y.shown, cells.times_shown[1]) == ("voltage", "voltage_rate", "seconds_to_failure")
    assert cells.seconds == pytest.approx(dm.VHB.relaxation_time)
    fails = columns(cells, 0)
    true_field = cells.ds.critical_true_field.isel(modulus_ratio=0).values.ravel()
    np.testing.assert_allclose(fails["critical_true_field"], true_field / 1e6, rtol=1e-6)


def test_labels_are_plain():
    assert plain_label("final_stretch") == "final stretch λ∞"
    assert plain_label("rate") == "ramp rate k τ/Ec"
    assert plain_label("voltage") == "voltage (V)"


VALUES = {"field": [0.6, 1.1, 1.4], "rate": 1.0, "time": 0.5, "period": [1.0, 2.0], "share": 0.4}
REPEATED = [dm.Linear("field", time=0.5), dm.Hold("rest"), dm.Linear(0.0, rate="rate"), dm.Hold(1.0)]
OWN = {
    "waveform": dm.Waveform([0.0, 0.5, 1.0, 2.0], [0.5, -1.0, 1.0, 0.0], repeat=True),
    "sequence": dm.Sequence(REPEATED, repeat=2),
}


@pytest.mark.parametrize("name", dm.programs.PROGRAMS)
def test_every_program_has_a_page_with_its_field(name):
    program = OWN.get(name) or dm.programs.PROGRAMS[name]()
    parameters = {each: VALUES[kind] for each, kind in program.kinds.items()}
    if name == "step":
        parameters["stress"] = [0.0, 0.1]
    film = dm.physical(dm.sweep(program, **parameters, modulus_ratio=[3.0, 4.0]), dm.VHB, 100e-6)
    cells = cells_of(film)
    assert {axis.name for axis in cells.axes} == {
        "modulus_ratio",
        *(k for k, v in parameters.items() if np.size(v) > 1),
    }
    assert all(axis.shown != axis.name for axis in cells.axes if axis.name in {"field", "bias", "period", "stress"})
    curves = curves_of(cells)
    grid = xr.broadcast(cells.ds.outcome, *(cells.ds[each] for each in (*parameters, "modulus_ratio")))[1:]
    own = {each: array.values.ravel() for each, array in zip((*parameters, "modulus_ratio"), grid, strict=True)}
    for index in np.flatnonzero(curves.span)[:: max(1, np.count_nonzero(curves.span) // 4)]:
        times = curves.time.values[index] * float(curves.span[index])
        inside = np.ones(times.size, bool)
        inside[1:-1] = (np.diff(times)[1:] > 1e-3) & (np.diff(times)[:-1] > 1e-3)  # not beside a jump
        inside[[0, -1]] = False
        one = dm.trajectory(program, time=times[inside], **{each: float(values[index]) for each, values in own.items()})
        np.testing.assert_allclose(curves.stretch.values[index, inside], one.stretch, rtol=2e-3)
        np.testing.assert_allclose(curves.field.values[index, inside], one.applied_field, atol=2e-3)


def test_what_is_no_grid_is_refused(cube):
    def along(values):
        return xr.DataArray(values, dims="sample")

    samples = dm.sweep(dm.RampHold(), field=along([1.1, 1.2]), rate=along([1.0, 2.0]), modulus_ratio=4.0)
    with pytest.raises(ValueError, match="each along one parameter that varies, not scattered samples; got sample 2"):
        draw(samples)
    with pytest.raises(ValueError, match="needs two cells or more; got 1"):
        draw(cube.isel(field=0, rate=0, modulus_ratio=0))
    with pytest.raises(ValueError, match="a page needs the variable time_to_failure; the map lacks it"):
        draw(cube.drop_vars("time_to_failure"))
    with pytest.raises(ValueError, match="a page needs the variable outcome; the map lacks it"):
        draw(cube.drop_vars("outcome"))
    with pytest.raises(TypeError, match=r"ds must be a data set; got 'films.nc'"):
        draw("films.nc")
    with pytest.raises(ValueError, match="a page needs the parameter rate; the map lacks it"):
        draw(cube.isel(rate=0).drop_vars("rate"))
    with pytest.raises(ValueError, match=r"must name its program, one of step, ramp, .*; got None"):
        draw(cube.assign_attrs(program=None))


def test_a_page_is_written_whole_or_not_at_all(step_map, tmp_path, monkeypatch):
    path = tmp_path / "page.html"
    path.write_text("the old one")
    with pytest.raises(ValueError, match=r"a page must be a file ending in .html; got .*page.pdf"):
        explore(step_map, tmp_path / "page.pdf")
    with pytest.raises(FileNotFoundError, match="there is no folder"):
        explore(step_map, tmp_path / "nowhere" / "page.html")
    with pytest.raises(ValueError, match="lacks"):
        explore(step_map.drop_vars("outcome"), path)

    def fail(*_):
        raise OSError("no space left")

    with monkeypatch.context() as patch, pytest.raises(OSError, match="no space left"):
        patch.setattr("os.replace", fail)
        explore(step_map, path)
    assert path.read_text() == "the old one"
    assert [file.name for file in tmp_path.iterdir()] == ["page.html"]
    explore(step_map, path)
    assert "</html>" in path.read_text(encoding="utf-8")


def test_without_the_library(step_map, monkeypatch):
    original = builtins.__import__

    def refuse(name, *rest):
        if name.partition(".")[0] == "bokeh":
            raise ModuleNotFoundError("No module named 'bokeh'", name="bokeh")
        return original(name, *rest)

    for name in [*sys.modules]:
        if name.startswith(("dea_maps.explorer.page", "dea_maps.explorer.figures")):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(ValueError, match=r"explore needs Bokeh, which comes with: pip install 'dea-maps\[explore\]'"):
        draw(step_map)
