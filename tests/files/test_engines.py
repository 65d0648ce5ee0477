"""The engine of Dask workers: the same bits as threads, or one line that says what is wrong with the cluster."""

import os
import signal
import socket
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.cli.main import main
from dea_maps.files import engines, stream, to_netcdf
from dea_maps.materials.toml import PowerLaw

distributed = pytest.importorskip("distributed")

CUBE = {"field": np.linspace(0.8, 2.2, 13), "rate": np.geomspace(1e-3, 1e3, 11), "modulus_ratio": np.linspace(2, 6, 7)}

# Clusters that close leave sockets and event loops to the garbage collector, which warns.
pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.fixture(autouse=True)
def small_parts(monkeypatch):
    monkeypatch.setattr(stream, "PART_CELLS", 100)
    monkeypatch.setattr(stream, "CHUNK_CELLS", 30)


@pytest.fixture(scope="module")
def cluster():
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as made:
        yield made


def test_the_same_bits_as_threads(cluster, tmp_path):
    path = tmp_path / "map.nc"
    dm.sweep_to_netcdf(path, dm.RampHold(), **CUBE, engine="dask", scheduler=cluster.scheduler_address)
    xr.testing.assert_identical(xr.load_dataset(path), dm.sweep(dm.RampHold(), **CUBE))
    assert os.listdir(tmp_path) == ["map.nc"]


def test_a_worker_that_ends_unexpectedly_is_replaced(cluster, tmp_path, monkeypatch):
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


def test_workers_share_what_cells_of_a_product_grid_have_in_common(cluster, tmp_path):
    path = tmp_path / "map.nc"
    many = {**CUBE, "field": np.linspace(0.9, 2.2, 24)}
    dm.sweep_to_netcdf(path, dm.RampHold(), **many, engine="dask", scheduler=cluster.scheduler_address)
    found = xr.load_dataset(path)
    assert found.attrs["sharing"] == "product grid"
    xr.testing.assert_identical(found, dm.sweep(dm.RampHold(), **many))


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

    monkeypatch.setattr(stream, "task_of", broken)
    with pytest.raises(OSError, match="cells 308 to 384 could not be computed: "):
        dm.sweep_to_netcdf(path, dm.RampHold(), **CUBE, engine="dask", scheduler=cluster.scheduler_address)
    assert len(list((tmp_path / "map.nc.parts").glob("*.npz"))) == 4


def test_without_a_scheduler(tmp_path):
    with pytest.raises(OSError, match=r"127\.0\.0\.1:1"):
        dm.sweep_to_netcdf(
            tmp_path / "map.nc", dm.Step(), field=1.2, modulus_ratio=4.0, engine="dask", scheduler="tcp://127.0.0.1:1"
        )


def sweep_on(address, path):
    dm.sweep_to_netcdf(path, dm.RampHold(), **CUBE, engine="dask", scheduler=address)


def hide_package():
    sys.modules["dea_maps.files.engines.hidden"] = sys.modules.pop("dea_maps.files.engines", None)
    sys.modules["dea_maps.files.engines"] = None


def show_package():
    sys.modules["dea_maps.files.engines"] = sys.modules.pop("dea_maps.files.engines.hidden")


def be_of_another_version():
    engines.CODE = "dea_maps 0.0.1 with the kernels 0123456789abcdef"


def be_of_this_version(code):
    engines.CODE = code


def test_a_worker_without_the_package_is_named(cluster, tmp_path):
    with distributed.Client(cluster) as client:
        client.run(lambda: __import__("dea_maps.files.engines"))
        client.run(hide_package)
        try:
            with pytest.raises(OSError, match=f"a Dask worker has no dea_maps .*, this process {engines.CODE}: both"):
                sweep_on(cluster.scheduler_address, tmp_path / "map.nc")
        finally:
            client.run(show_package)
    assert os.listdir(tmp_path) == []


OTHER = r"a Dask worker has dea_maps 0\.0\.1 with the kernels 0123456789abcdef, this process dea_maps .* with the "


@pytest.mark.parametrize("when", ["before", "later"])
def test_a_worker_of_another_version_is_refused(when, cluster, tmp_path, monkeypatch):
    real, submitted = engines.Dask.submit, []

    def submit(self, task):
        if len(submitted) == 5:  # as a worker that joins later
            self._client.run(be_of_another_version)
        submitted.append(task)
        return real(self, task)

    with distributed.Client(cluster) as client:
        if when == "before":
            client.run(be_of_another_version)
        else:
            monkeypatch.setattr(engines.Dask, "submit", submit)
        try:
            with pytest.raises(OSError, match=OTHER):
                sweep_on(cluster.scheduler_address, tmp_path / "map.nc")
        finally:
            client.run(be_of_this_version, engines.CODE)
    assert (tmp_path / "map.nc.parts").exists() == (when == "later")


def test_the_code_that_is_compared_has_the_fingerprint_of_the_kernels():
    from dea_maps.kernels._jit import FINGERPRINT

    assert FINGERPRINT in engines.CODE
    assert dm.__version__ in engines.CODE


def test_without_workers(tmp_path, monkeypatch):
    monkeypatch.setattr(engines, "ARRIVAL", 0.3)
    with distributed.LocalCluster(n_workers=0, dashboard_address=None) as empty:
        address = empty.scheduler_address
        with (
            pytest.warns(UserWarning, match=f"the Dask scheduler at {address} has no workers: waiting for one"),
            pytest.raises(OSError, match=rf"the Dask scheduler at {address} has no workers, after 0\.3 s"),
        ):
            sweep_on(address, tmp_path / "map.nc")
    assert os.listdir(tmp_path) == []


CLUSTER = """
from distributed import LocalCluster
with LocalCluster(n_workers=1, processes=False, protocol="tcp", host="127.0.0.1", dashboard_address=None) as made:
    print(made.scheduler_address, flush=True)
    input()
"""


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP])
def test_a_scheduler_that_ends_unexpectedly(end, tmp_path, monkeypatch):
    monkeypatch.setattr(engines, "ANSWER", 2.0)
    monkeypatch.setattr(engines, "TRANSFER", 2.0)
    command = [sys.executable, "-c", CLUSTER]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    process = subprocess.Popen(command, text=True, **pipes)
    try:
        address = process.stdout.readline().strip()
        real, submitted = engines.Dask.submit, []

        def submit(self, task):
            if len(submitted) == 8:
                process.send_signal(end)
            submitted.append(task)
            return real(self, task)

        monkeypatch.setattr(engines.Dask, "submit", submit)
        with pytest.raises(OSError, match=f"the Dask scheduler at {address} was lost"):
            sweep_on(address, tmp_path / "map.nc")
    finally:
        process.kill()
        process.communicate()
    assert list(tmp_path.glob("map.nc.parts/*.npz"))
    assert not (tmp_path / "map.nc").exists()


@pytest.mark.parametrize("answer", ["none", "silence", "another protocol"])
def test_what_is_no_scheduler(answer, tmp_path, monkeypatch):
    monkeypatch.setattr(engines, "ANSWER", 1.0)
    with socket.create_server(("127.0.0.1", 0)) as server, ThreadPoolExecutor(1) as thread:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        if answer == "another protocol":
            thread.submit(lambda: server.accept()[0].sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n" * 10))
        elif answer == "none":
            server.close()
        with pytest.raises(OSError, match=f"the Dask scheduler at {address} does not answer"):
            sweep_on(address, tmp_path / "map.nc")
    assert os.listdir(tmp_path) == []


MALFORMED = ["", "127.0.0.1", "tcp://", "tcp://127.0.0.1:http", "tcp://127.0.0.1:99999", "smoke://127.0.0.1:1", "a b:1"]


@pytest.mark.parametrize("address", MALFORMED)
def test_a_malformed_address_is_refused(address, tmp_path, monkeypatch):
    monkeypatch.setattr(engines, "solve", None)
    with pytest.raises(ValueError, match=f"scheduler must be the address of a Dask scheduler, .*; got {address!r}"):
        sweep_on(address, tmp_path / "map.nc")
    with pytest.raises(TypeError, match=r"scheduler must be the address of a Dask scheduler, .*; got 3"):
        sweep_on(3, tmp_path / "map.nc")


SPEC = '[program]\nname = "step"\n[grid]\nfield = 1.2\nmodulus_ratio = 4.0\n'


@pytest.mark.parametrize(
    ("address", "status", "words"),
    [("tcp://127.0.0.1:1", 1, "does not answer"), ("127.0.0.1", 2, "must be the address"), (None, 2, "needs Dask")],
)
def test_the_command_line_ends_in_one_line(address, status, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(engines, "ANSWER", 1.0)
    (tmp_path / "spec.toml").write_text(SPEC)
    options = ["--scheduler", address] if address else []
    if address is None:
        monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["sweep", "spec.toml", "-o", "map.nc", "--engine", "dask", *options]) == status
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("dea-maps: error: ")
    assert err.endswith("\n")
    assert err.count("\n") == 1
    assert words in err
    assert os.listdir(tmp_path) == ["spec.toml"]


def test_without_dask(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(ValueError, match=r"engine 'dask' needs Dask, which comes with: pip install 'dea-maps\[distr"):
        to_netcdf.sweep_to_netcdf(tmp_path / "map.nc", dm.Step(), field=1.2, modulus_ratio=4.0, engine="dask")
    assert os.listdir(tmp_path) == []
