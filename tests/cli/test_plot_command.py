"""``dea-maps plot`` of files that are no maps: the chart that suits them, or one sentence."""

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.charts import select
from dea_maps.cli.main import main

TIMES = np.linspace(0.0, 5.0, 51)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return the current folder, with files of trajectories and of a design."""
    monkeypatch.chdir(tmp_path)
    films = dm.trajectory(dm.Step(), time=TIMES, field=[0.9, 1.2], modulus_ratio=4.0)
    films.to_netcdf("films.nc")
    dm.physical(dm.breakdown(films, 1.8), dm.VHB, 1e-4).to_netcdf("volts.nc")
    dm.design(dm.VHB, [5e-5, 1e-4], [1.0, 60.0, 3600.0, np.inf]).to_netcdf("design.nc")
    xr.Dataset({"allowable_voltage": 1.0}).to_netcdf("other.nc")
    return tmp_path


@pytest.mark.parametrize(
    ("file", "labels"),
    [
        ("films", ("time $t/\\tau$", "stretch $\\lambda$")),
        ("volts", ("time (min)", "stretch $\\lambda$")),
        ("design", ("holding time (s)", "allowable voltage (kV)")),
    ],
)
def test_plot_draws_what_suits_a_file(folder, monkeypatch, file, labels):
    drawn = []
    monkeypatch.setattr(select, "save", lambda figure, path: drawn.append(figure))
    assert main(["plot", f"{file}.nc", "-o", "chart.png"]) == 0
    (ax, *_) = drawn[0].axes
    assert (ax.get_xlabel(), ax.get_ylabel()) == labels


@pytest.mark.parametrize(("verb", "file"), [("plot", "other"), ("info", "design"), ("explore", "design")])
def test_files_that_are_none_of_ours_or_no_map_are_refused(folder, capsys, verb, file):
    arguments = {"plot": ["-o", "chart.png"], "info": [], "explore": ["-o", "page.html"]}[verb]
    assert main([verb, f"{file}.nc", *arguments]) == 2
    words = "is not a map: it does not hold the variables and attributes of a sweep"
    assert capsys.readouterr() == ("", f"dea-maps: error: {file}.nc {words}\n")
    assert sorted(path.suffix for path in folder.iterdir()) == [".nc"] * 4


def test_a_design_for_good_alone_is_a_table_and_no_chart(folder, capsys):
    (folder / "spec.toml").write_text('[material]\npreset = "VHB"\nthickness = 50e-6\n[design]\nholding_time = inf')
    assert main(["design", "spec.toml"]) == 0
    table = capsys.readouterr().out
    assert "indefinitely" in table
    assert main(["design", "spec.toml", "-o", "chart.png"]) == 2
    words = "a design chart needs two finite holding times or more; got 0"
    assert capsys.readouterr() == (table, f"dea-maps: error: {words}\n")
