"""Files read by other tools, those that are installed: the same numbers as in memory."""

import re
import shutil
import subprocess

import numpy as np
import pytest

import dea_maps as dm

CUBE = {"field": np.linspace(0.8, 2.2, 5), "rate": np.geomspace(1e-2, 1e2, 4), "modulus_ratio": [2.0, 4.0, 6.0]}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    path = tmp_path_factory.mktemp("map") / "map.nc"
    dm.sweep_to_netcdf(path, dm.RampHold(), **CUBE)
    return path, dm.sweep(dm.RampHold(), **CUBE)


def output(tool, *arguments):
    if shutil.which(tool) is None:
        pytest.skip(f"{tool} is not installed")
    return subprocess.run([tool, *map(str, arguments)], capture_output=True, text=True, check=True).stdout


def test_ncdump(made):
    path, ds = made
    text = output("ncdump", "-p", "9,17", "-v", "critical_field", path).split("critical_field =")[1]
    items = [item for item in re.split(r"[,;}\s]+", text) if item]
    found = [np.nan if item in {"_", "NaN"} else float(item) for item in items]
    np.testing.assert_array_equal(np.reshape(found, ds.critical_field.shape), ds.critical_field)


def test_nco(made, tmp_path):
    path, ds = made
    output("ncks", "-O", "-d", "field,4", "-d", "rate,3", "-d", "modulus_ratio,2", path, tmp_path / "cell.nc")
    text = output("ncks", "--trd", "-H", "-C", "-s", "%.17g\n", "-v", "time_to_failure", tmp_path / "cell.nc")
    assert float(text.split()[0]) == ds.time_to_failure[-1, -1, -1]


def test_cdo(made):
    path, ds = made
    listed = output("cdo", "-s", "showname", path).split()
    assert set(ds.data_vars) <= set(listed)


def test_octave(made):
    path, ds = made
    script = f"pkg load netcdf; printf('%.17g\\n', ncread('{path}', 'time_to_failure'))"
    found = np.array(output("octave", "--no-gui", "--eval", script).split(), float)
    # the first dimension varies fastest there
    np.testing.assert_array_equal(found.reshape(ds.time_to_failure.shape), ds.time_to_failure)


def test_vtk(made):
    path, ds = made
    vtk = pytest.importorskip("vtk", reason="vtk is not installed")
    reader = vtk.vtkNetCDFCFReader()
    reader.SetFileName(str(path))
    reader.SphericalCoordinatesOff()
    reader.Update()
    names = {reader.GetVariableArrayName(i) for i in range(reader.GetNumberOfVariableArrays())}
    assert set(ds.data_vars) <= names
