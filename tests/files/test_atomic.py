"""Files: replaced whole or not at all, and known again."""

import os
import pickle
import subprocess
import sys
import tempfile

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.atomic import check_writable, replacing
from dea_maps.files.netcdf import open_map, write_dataset
from dea_maps.sweeps.dataset import make_dataset
from dea_maps.sweeps.grid import make_grid
from dea_maps.sweeps.solve import Solution


@pytest.fixture
def ds():
    grid = make_grid(dm.Step(), field=[1.1, 1.2], modulus_ratio=4)
    maps = (np.arange(2.0) + number for number in range(5))
    provenance = {"method": "dop853", "formulation": "fold", "rtol": 1e-6}
    return make_dataset(grid, Solution(np.ones(2, np.int8), *maps), provenance)


@pytest.mark.parametrize("kind", [str, lambda path: path])
def test_writes_what_reads_back_identical(ds, tmp_path, kind):
    write_dataset(ds, kind(tmp_path / "map.nc"))
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "map.nc"), ds)
    assert os.listdir(tmp_path) == ["map.nc"]


def test_a_path_without_folder_is_in_the_current_one(ds, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_dataset(ds, "map.nc")
    assert os.listdir(tmp_path) == ["map.nc"]


def test_the_old_file_stays_until_the_new_one_is_complete(tmp_path):
    path = tmp_path / "note.txt"
    path.write_text("old")
    with replacing(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "old"
        assert temporary.parent == path.parent
        assert temporary.suffix == ".txt"
    assert path.read_text() == "new"


@pytest.mark.parametrize("failure", [OSError, MemoryError, KeyboardInterrupt, SystemExit])
def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path, failure):
    path = tmp_path / "note.txt"
    path.write_text("old")
    with pytest.raises(failure), replacing(path) as temporary:
        temporary.write_text("half")
        raise failure
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["note.txt"]


def test_bytes_are_on_the_disk_before_the_name_and_the_name_before_the_return(tmp_path, monkeypatch):
    events = []
    fsync, replace = os.fsync, os.replace

    def record_sync(descriptor):
        events.append(os.readlink(f"/proc/self/fd/{descriptor}"))
        fsync(descriptor)

    def record_replace(source, target):
        events.append("replace")
        replace(source, target)

    monkeypatch.setattr(os, "fsync", record_sync)
    monkeypatch.setattr(os, "replace", record_replace)
    with replacing(tmp_path / "note.txt") as temporary:
        temporary.write_text("new")
    assert events == [str(temporary), "replace", str(tmp_path)]


def test_a_link_is_followed(tmp_path):
    target, link = tmp_path / "target.txt", tmp_path / "link.txt"
    target.write_text("old")
    link.symlink_to(target)
    with replacing(link) as temporary:
        temporary.write_text("new")
    assert link.is_symlink()
    assert target.read_text() == "new"


OUTPUTS = {
    "a pipe": (os.mkfifo, OSError, "it is a device, a pipe or a socket, not a file"),
    "a folder": (os.mkdir, IsADirectoryError, "it is a folder"),
    "a link to a pipe": (
        lambda path: (os.mkfifo(f"{path}.pipe"), os.symlink(f"{path}.pipe", path)),
        OSError,
        "it is a device, a pipe or a socket, not a file",
    ),
    "a link to a folder": (lambda path: os.symlink(path.parent, path), IsADirectoryError, "it is a folder"),
    "a link to itself": (lambda path: os.symlink(path, path), OSError, "Too many levels of symbolic links"),
    "a loop of links": (
        lambda path: (os.symlink(path, f"{path}.back"), os.symlink(f"{path}.back", path)),
        OSError,
        "Too many levels of symbolic links",
    ),
    "a link to nowhere": (lambda path: os.symlink("absent/x", path), FileNotFoundError, "there is no folder"),
    "read-only": (lambda path: (path.write_text("old"), path.chmod(0o444)), PermissionError, "it is read-only"),
}


@pytest.mark.parametrize("name", OUTPUTS)
def test_what_cannot_be_replaced_is_refused_and_stays(ds, name, tmp_path):
    make, error, words = OUTPUTS[name]
    path = tmp_path / "map.nc"
    make(path)
    before = {place.name: place.lstat() for place in tmp_path.iterdir()}
    for write in (check_writable, lambda path: write_dataset(ds, path)):
        with pytest.raises(error, match=f"cannot write {path}: {words}") as caught:
            write(path)
        assert "\n" not in str(caught.value)
    after = {place.name: place.lstat() for place in tmp_path.iterdir()}
    assert [(name, s.st_ino, s.st_mode) for name, s in after.items()] == [
        (name, s.st_ino, s.st_mode) for name, s in before.items()
    ]


def test_what_this_user_may_not_write_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "map.nc"
    path.write_text("old")
    monkeypatch.setattr(os, "access", lambda place, mode: not (place == path and mode == os.W_OK))
    with pytest.raises(PermissionError, match=f"cannot write {path}: it is read-only"):
        check_writable(path)


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o664])
def test_the_mode_of_a_replaced_file_is_kept(ds, tmp_path, mode):
    path = tmp_path / "map.nc"
    path.write_text("old")
    path.chmod(mode)
    write_dataset(ds, path)
    assert path.stat().st_mode & 0o7777 == mode
    xr.testing.assert_identical(xr.load_dataset(path), ds)


def test_a_link_to_a_new_file_makes_it(ds, tmp_path):
    (tmp_path / "link.nc").symlink_to("new.nc")
    write_dataset(ds, tmp_path / "link.nc")
    assert (tmp_path / "link.nc").is_symlink()
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "new.nc"), ds)


def test_an_opened_map_is_pickled(ds, tmp_path):
    write_dataset(ds, tmp_path / "map.nc")
    with open_map(tmp_path / "map.nc") as opened, pickle.loads(pickle.dumps(opened)) as copy:
        xr.testing.assert_identical(copy, ds)


FULL_DISK = """
import resource, sys
import xarray as xr, numpy as np
from dea_maps.files.netcdf import write_dataset
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
try:
    write_dataset(xr.Dataset({"x": ("n", np.random.default_rng(1).random(100_000))}), sys.argv[1])
except OSError as error:
    print(error)
"""


def test_a_file_that_does_not_fit_leaves_the_old_one(tmp_path):
    path = tmp_path / "map.nc"
    path.write_bytes(b"old")
    run = subprocess.run([sys.executable, "-c", FULL_DISK, path], capture_output=True, text=True, check=True)
    assert str(path) in run.stdout
    assert path.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["map.nc"]


def test_unwritable_places_are_named(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    for path, error, words in [
        (tmp_path, IsADirectoryError, "it is a folder"),
        (tmp_path / "absent" / "map.nc", FileNotFoundError, "there is no folder"),
        (tmp_path / "file" / "map.nc", NotADirectoryError, "is not a folder"),
    ]:
        with pytest.raises(error, match=f"cannot write {path}: .*{words}") as caught:
            check_writable(path)
        assert "\n" not in str(caught.value)

    def refuse(**_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(tempfile, "TemporaryFile", refuse)
    with pytest.raises(PermissionError, match=r"cannot write .*map.nc: Permission denied in the folder"):
        check_writable(tmp_path / "map.nc")


def test_checking_leaves_nothing_behind(tmp_path):
    check_writable(tmp_path / "map.nc")
    assert os.listdir(tmp_path) == []


def test_a_map_is_opened(ds, tmp_path):
    write_dataset(ds, tmp_path / "map.nc")
    with open_map(tmp_path / "map.nc") as opened:
        xr.testing.assert_identical(opened, ds)


def test_what_is_no_map_is_refused(ds, tmp_path):
    (tmp_path / "note.txt").write_text("no map")
    xr.Dataset({"outcome": 1.0}).to_netcdf(tmp_path / "foreign.nc")
    ds.drop_vars(ds.data_vars).to_netcdf(tmp_path / "empty.nc")
    for name, error, words in [
        ("absent.nc", FileNotFoundError, "there is no file"),
        ("", IsADirectoryError, "is not a file"),
        ("note.txt", ValueError, "is not a NetCDF file"),
        ("foreign.nc", ValueError, "is not a map"),
        ("empty.nc", ValueError, "is not a map"),
    ]:
        with pytest.raises(error, match=words):
            open_map(tmp_path / name)
