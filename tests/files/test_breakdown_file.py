"""Sweeps to a file of a film whose breakdown strength is known: what `dm.breakdown` says, whatever the parts."""

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.cli.main import main
from dea_maps.files import engines, stream
from dea_maps.limits import breakdown
from dea_maps.materials.toml import PowerLaw

FILM = """
[material]
preset = "VHB"
thickness = 100e-6
breakdown_strength = 51e6
"""
SPEC = f"""
[program]
name = "step"
[grid]
voltage = [1200, 1900, 2300, 2500, 3200]
{FILM}
"""
CONSTANT = dm.Material(87.8e3, 22.8e3, 200.0, 4.7, name="film", breakdown_strength=51e6)
GROWING = dm.Material(87.8e3, 22.8e3, 200.0, 4.7, name="film", breakdown_strength=PowerLaw(30.6e6, 1.13))
GRID = {"field": np.linspace(0.7, 2.2, 7), "rate": [0.1, 1.0, 30.0], "modulus_ratio": [2.0, 3.85]}
LIMITED = ("first_limit", "time_to_breakdown", "breakdown_stretch", "breakdown_field")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "spec.toml").write_text(SPEC)
    return tmp_path


def expected(material, **stored):
    ds = dm.breakdown(dm.sweep(dm.RampHold(), **GRID, **stored), material.strength, **stored)
    return dm.physical(ds, material, 100e-6)


def test_the_command_line_applies_the_breakdown_strength(folder, capsys):
    assert main(["sweep", "spec.toml", "-o", "map.nc"]) == 0
    film = CONSTANT
    field = np.array([1200.0, 1900.0, 2300.0, 2500.0, 3200.0]) / (film.critical_field * 100e-6)
    ds = dm.breakdown(dm.sweep(dm.Step(), field=field, modulus_ratio=film.modulus_ratio), film.strength)
    with xr.open_dataset("map.nc") as found:
        for name in LIMITED:
            xr.testing.assert_equal(found[name].drop_vars("voltage"), ds[name])
        seconds = found["seconds_to_breakdown"].values
    assert set(ds.first_limit.values.tolist()) == {0, 1, 2}
    np.testing.assert_array_equal(seconds, 200.0 * ds.time_to_breakdown.values)
    said = capsys.readouterr().out.splitlines()[-1]
    assert said.endswith("; first limit: 1 none, 3 instability, 1 breakdown, 0 unresolved")


@pytest.mark.parametrize("material", [CONSTANT, GROWING], ids=["constant", "growing"])
def test_a_file_is_the_map_with_its_first_limits(tmp_path, material):
    dm.sweep_to_netcdf(tmp_path / "a.nc", dm.RampHold(), **GRID, material=material, thickness=100e-6)
    found = xr.load_dataset(tmp_path / "a.nc")
    xr.testing.assert_identical(found, expected(material))
    assert found["first_limit"].dtype == np.int8
    assert {1, 2} <= set(np.unique(found["first_limit"]))
    with dm.open(tmp_path / "a.nc") as opened:
        xr.testing.assert_identical(opened, found)


def test_parts_and_blocks_change_no_bit(tmp_path, monkeypatch):
    whole, parts = tmp_path / "whole.nc", tmp_path / "parts.nc"
    arguments = {**GRID, "material": GROWING, "thickness": 100e-6}
    dm.sweep_to_netcdf(whole, dm.RampHold(), **arguments)
    monkeypatch.setattr(stream, "CHUNK_CELLS", 6)
    monkeypatch.setattr(stream, "PART_CELLS", 12)
    monkeypatch.setattr(breakdown, "BLOCK", 5)
    dm.sweep_to_netcdf(parts, dm.RampHold(), **arguments)
    xr.testing.assert_identical(xr.load_dataset(parts), xr.load_dataset(whole))


def test_single_precision_is_rounded_last(tmp_path):
    path = tmp_path / "single.nc"
    dm.sweep_to_netcdf(path, dm.RampHold(), **GRID, material=CONSTANT, thickness=1e-4, dtype="float32")
    found, double = xr.load_dataset(path), expected(CONSTANT)
    for name in LIMITED:
        np.testing.assert_array_equal(found[name], double[name].astype(found[name].dtype))
    assert found["time_to_breakdown"].dtype == np.float32


def test_some_variables_come_with_what_ends_the_loading_first(tmp_path):
    kept = {"variables": ["time_to_breakdown", "time_to_failure"]}
    dm.sweep_to_netcdf(tmp_path / "some.nc", dm.Step(), field=2.0, material=CONSTANT, thickness=1e-4,
                       modulus_ratio=4.0, **kept)  # fmt: skip
    with dm.open(tmp_path / "some.nc") as ds:
        names = {"time_to_failure", "time_to_breakdown", "first_limit"}
        assert set(ds.data_vars) == names | {"seconds_to_failure", "seconds_to_breakdown"}
    with pytest.raises(ValueError, match=r"variables must be among outcome, .*; got 'first_limit'"):
        dm.sweep_to_netcdf(tmp_path / "b.nc", dm.Step(), field=2.0, modulus_ratio=4.0, variables=["first_limit"])


def interrupted(path, monkeypatch, **arguments):
    """Run a sweep that ends after its first part; return how many parts the next run computes."""
    calls = []
    real = engines.compute

    def computing(task, *others, **named):
        calls.append(task)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return real(task, *others, **named)

    monkeypatch.setattr(engines, "compute", computing)
    with pytest.raises(KeyboardInterrupt):
        dm.sweep_to_netcdf(path, dm.RampHold(), **GRID, thickness=1e-4, **arguments)


def test_parts_of_another_strength_are_not_used(tmp_path, monkeypatch):
    monkeypatch.setattr(stream, "CHUNK_CELLS", 6)
    monkeypatch.setattr(stream, "PART_CELLS", 6)
    for material in (GROWING, dm.Material(87.8e3, 22.8e3, 200.0, 4.7, name="film")):
        with monkeypatch.context() as patch:
            interrupted(tmp_path / "a.nc", patch, material=material)
        with pytest.warns(UserWarning, match="is of another sweep"):
            dm.sweep_to_netcdf(tmp_path / "a.nc", dm.RampHold(), **GRID, thickness=1e-4, material=CONSTANT)
        xr.testing.assert_identical(xr.load_dataset(tmp_path / "a.nc"), expected(CONSTANT))


def test_a_strength_that_is_a_function(tmp_path):
    material = dm.Material(87.8e3, 22.8e3, 200.0, 4.7, breakdown_strength=lambda stretch: 30e6 + 9e6 * stretch)
    dm.sweep_to_netcdf(tmp_path / "a.nc", dm.RampHold(), **GRID, material=material, thickness=100e-6)
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "a.nc"), expected(material))


def test_a_strength_that_does_not_fall_is_refused_before_computing(folder, capsys, monkeypatch):
    monkeypatch.setattr(engines, "compute", None)
    for strength, words in (
        ("{ at_rest = 30e6, exponent = 2.5 }", "must fall with the stretch"),
        ("{ at_rest = -30e6, exponent = 1.0 }", "must be finite and above 0"),
    ):
        (folder / "spec.toml").write_text(SPEC.replace("51e6", strength))
        assert main(["sweep", "spec.toml", "-o", "map.nc"]) == 2
        err = capsys.readouterr().err
        assert words in err and err.count("\n") == 1
    (folder / "spec.toml").write_text(SPEC + "[accuracy]\nrtol = 1e-11\n")
    assert main(["sweep", "spec.toml", "-o", "map.nc"]) == 2
    assert "rtol must be from 1e-10 to 0.001 with a breakdown strength; got 1e-11" in capsys.readouterr().err


def test_the_dry_run_counts_the_breakdown(folder, capsys):
    assert main(["sweep", "spec.toml", "-o", "map.nc", "--dry-run"]) == 0
    assert "\nbreakdown strength         51 MV/m\n" in capsys.readouterr().out


def test_info_says_what_comes_first(folder, capsys):
    assert main(["sweep", "spec.toml", "-o", "map.nc", "--quiet"]) == 0
    assert main(["info", "map.nc"]) == 0
    out = capsys.readouterr().out
    assert "what ends the loading first, in cells\nnone                       1\n" in out
    assert "\nbreakdown                  1\n" in out
    assert "\ntime_to_breakdown          " in out
    assert "\nseconds_to_breakdown       " in out


VOLTAGES = "voltage = [1200, 1900, 2300, 2500, 3200]"


@pytest.mark.parametrize("grid", [VOLTAGES, "modulus_ratio = [3, 4, 5]\nvoltage = 2300"])
def test_curves_show_where_it_breaks_down(folder, grid):
    (folder / "spec.toml").write_text(SPEC.replace(VOLTAGES, grid).replace("51e6", "45e6"))
    assert main(["sweep", "spec.toml", "-o", "map.nc", "--quiet"]) == 0
    assert main(["plot", "map.nc", "-o", "chart.svg"]) == 0
    assert "breaks down first" in (folder / "chart.svg").read_text()


def test_points_and_failure_curves_show_it_too():
    ds = dm.breakdown(dm.sweep(dm.Step(), field=[1.2, 1.5, 1.9], modulus_ratio=4.0), 3.2)
    assert ds.first_limit.values.tolist() == [2, 2, 1]
    ax = dm.charts.failure_curves(ds)
    drawn = next(line for line in ax.lines if len(line.get_xdata()) == 3)
    assert np.isnan(drawn.get_ydata()).tolist() == [True, True, False]
    field, ratio = (xr.DataArray(values, dims="sample") for values in ([1.2, 1.5, 1.9], [4.0, 4.1, 4.0]))
    samples = dm.breakdown(dm.sweep(dm.Step(), field=field, modulus_ratio=ratio), 3.2)
    legends = [*dm.charts.draw(samples).legends, *(ax.get_legend() for ax in dm.charts.draw(samples).axes)]
    labels = [text.get_text() for legend in legends if legend is not None for text in legend.get_texts()]
    assert "breaks down first" in labels


def test_a_page_shows_where_a_film_breaks_down():
    pytest.importorskip("bokeh")
    from dea_maps.explorer.cells import cells_of, columns
    from dea_maps.explorer.curves import curves_of
    from dea_maps.explorer.export import draw

    ds = dm.breakdown(dm.sweep(dm.Step(), field=[0.7, 1.2, 1.5, 1.9], modulus_ratio=4.0), 3.2)
    cells = cells_of(ds)
    assert columns(cells, 0)["outcome"].tolist() == [0, 4, 4, 1]
    curves = curves_of(cells)
    for index in (1, 2):
        assert curves.span[index] == pytest.approx(ds.time_to_breakdown.values[index], rel=1e-6)  # of single precision
        assert curves.ends[index]
        assert curves.stretch.values[index, -1] == pytest.approx(ds.breakdown_stretch.values[index], abs=2e-4)
    html = draw(ds)
    assert "breaks down first" in html
    assert "time to breakdown" in html


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("first_limit", lambda values: values + np.int8(3)),
        ("first_limit", np.zeros_like),
        ("time_to_breakdown", np.negative),
        ("breakdown_stretch", lambda values: values - 1.0),
        ("breakdown_field", lambda values: np.where(np.isnan(values), 1.0, np.nan)),
    ],
)
def test_a_map_with_impossible_limits_is_refused(tmp_path, name, change):
    path = tmp_path / "map.nc"
    ds = dm.breakdown(dm.sweep(dm.Step(), field=[0.7, 1.2, 1.9], modulus_ratio=4.0), 3.2)
    ds.to_netcdf(path)
    dm.open(path).close()
    ds.assign({name: ds[name].copy(data=change(ds[name].values))}).to_netcdf(path)
    with pytest.raises(ValueError, match=f"is not a map, or is damaged: .*{name.replace('_', '.')}"):
        dm.open(path)
