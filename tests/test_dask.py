"""The engine of Dask workers: the same bits as threads, also when a worker dies."""

import os
import signal

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps import disk, engines, streaming
from dea_maps.material_table import PowerLaw

distributed = pytest.importorskip("distributed")

CUBE = {"field": np.linspace(0.8, 2.2, 13), "rate": np.geomspace(1e-3, 1e3, 11), "modulus_ratio": np.linspace(2, 6, 7)}

# Clusters that close leave sockets and event loops to the garbage collector, which warns.
pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.fixture(autouse=True)
def small_parts(monkeypatch):
    monkeypatch.setattr(streaming, "PART_CELLS", 100)
    monkeypatch.setattr(streaming, "CHUNK_CELLS", 30)


@pytest.fixture(scope="module")
def cluster():
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as made:
        yield made


def test_the_same_bits_as_threads(cluster, tmp_path):
    path = tmp_path / "map.nc"
    dm.sweep_to_netcdf(path, dm.RampHold(), **CUBE, engine="dask", scheduler=cluster.scheduler_address)
    xr.testing.assert_identical(xr.load_dataset(path), dm.sweep(dm.RampHold(), **CUBE))
    assert os.listdir(tmp_path) == ["map.nc"]


def test_a_worker_that_dies_is_replaced(cluster, tmp_path, monkeypatch):
    path, pids = tmp_path / "map.nc", []
    real = engines.Dask.submit

    def submit(self, task):
        if len(pids) == 3:
            (pid, *_) = self._client.run(os.getpid).values()
            os.kill(pid, signal.SIGKILL)
        pids.append(os.getpid())
        return real(self, task)

    monkeypatch.setattr(engines.Dask, "submit", submit)
    dm.sweep_to_netcdf(path, dm.RampHold(), **CUBE, engine="dask", scheduler=cluster.scheduler_address)
    assert len(pids) == 13
    xr.testing.assert_identical(xr.load_dataset(path), dm.sweep(dm.RampHold(), **CUBE))


def test_workers_find_the_breakdown_too(cluster, tmp_path):
    film = dm.Material(87.8e3, 22.8e3, 200.0, 4.7, breakdown_strength=PowerLaw(30e6, 1.0))
    arguments = {"field": [0.9, 1.3, 1.7, 2.1], "rate": [0.1, 10.0], "modulus_ratio": 4.0, "material": film}
    for name, engine in (("a", {}), ("b", {"engine": "dask", "scheduler": cluster.scheduler_address})):
        dm.sweep_to_netcdf(tmp_path / name, dm.RampHold(), **arguments, thickness=1e-4, **engine)
    found = xr.load_dataset(tmp_path / "b")
    xr.testing.assert_identical(found, xr.load_dataset(tmp_path / "a"))
    assert 2 in found.first_limit


def test_what_cannot_be_finished_is_named(cluster, tmp_path, monkeypatch):
    path = tmp_path / "map.nc"
    real = engines.task_of

    def broken(grid, index, choice, variables, dtype):
        task = real(grid, index, choice, variables, dtype)
        return task._replace(choice=None) if index[0].start == 4 else task

    monkeypatch.setattr(streaming, "task_of", broken)
    with pytest.raises(OSError, match="cells 308 to 384 could not be computed: "):
        dm.sweep_to_netcdf(path, dm.RampHold(), **CUBE, engine="dask", scheduler=cluster.scheduler_address)
    assert len(list((tmp_path / "map.nc.parts").glob("*.npz"))) == 4


def test_without_a_scheduler(tmp_path):
    with pytest.raises(OSError, match=r"127\.0\.0\.1:1"):
        dm.sweep_to_netcdf(
            tmp_path / "map.nc", dm.Step(), field=1.2, modulus_ratio=4.0, engine="dask", scheduler="tcp://127.0.0.1:1"
        )


def test_without_dask(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(ValueError, match=r"engine 'dask' needs Dask, which comes with: pip install 'dea-maps\[distr"):
        disk.sweep_to_netcdf(tmp_path / "map.nc", dm.Step(), field=1.2, modulus_ratio=4.0, engine="dask")
    assert os.listdir(tmp_path) == []
