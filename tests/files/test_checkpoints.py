"""Where the chunks of a sweep are until it ends: in the map, once, whatever interrupts it."""

import os
import shutil

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.files import checkpoints, engines, stream

FILMS = {"field": np.linspace(0.8, 2.2, 60), "modulus_ratio": np.linspace(2.0, 6.0, 500)}
PARTS = 12


@pytest.fixture(autouse=True)
def few_parts(monkeypatch):
    """Chunks of 500 cells, large enough to have places of their own in the file, and parts of five."""
    monkeypatch.setattr(stream, "PART_CELLS", 2500)
    monkeypatch.setattr(stream, "CHUNK_CELLS", 500)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "map.nc"


@pytest.fixture(scope="module")
def whole():
    return dm.sweep(dm.Step(), **FILMS)


def write(path):
    dm.sweep_to_netcdf(path, dm.Step(), **FILMS)


def write_until(path, count):
    """Write until so many parts are finished; return the sizes of the parts and of the map."""
    with pytest.MonkeyPatch.context() as patch, pytest.raises(KeyboardInterrupt):
        counted(patch, count)
        write(path)
    return sizes(path)


def counted(patch, most=10**9):
    """Let so many parts be computed; return the list of those that are."""
    done, real = [], engines.solve

    def solve(*arguments, **options):
        if len(done) == most:
            raise KeyboardInterrupt
        done.append(arguments[1]["modulus_ratio"].size)
        return real(*arguments, **options)

    patch.setattr(engines, "solve", solve)
    return done


def sizes(path):
    folder = path.with_name("map.nc.parts")
    return sum(part.stat().st_size for part in folder.glob("*.npz")), (folder / "whole.nc").stat().st_size


def test_the_disk_holds_the_map_once(path, whole, monkeypatch):
    real, seen = engines.solve, []

    def solve(*arguments, **options):
        folder = path.with_name("map.nc.parts")
        seen.append(sum(place.stat().st_size for place in list(folder.iterdir()) if place.name[:3] != "unf"))
        return real(*arguments, **options)

    monkeypatch.setattr(engines, "solve", solve)
    write(path)
    xr.testing.assert_identical(xr.load_dataset(path), whole)
    assert len(seen) == PARTS
    assert max(seen) < 1.2 * path.stat().st_size


def test_what_is_resumed_leaves_the_old_map_as_it_enters_the_parts(path, whole, monkeypatch):
    parts, started = write_until(path, 8)
    assert parts < started / 3
    real, seen = checkpoints.Parts.save, []

    def save(self, *arguments):
        real(self, *arguments)
        if not (self.folder / "new").exists():
            seen.append(sum(sizes(path)))

    with monkeypatch.context() as patch:
        patch.setattr(checkpoints.Parts, "save", save)
        patch.setattr(stream, "MapFile", interrupt)
        with pytest.raises(KeyboardInterrupt):
            write(path)
    assert len(seen) == 8
    assert max(seen) < 1.2 * (parts + started)
    computed = counted(monkeypatch)
    write(path)
    assert len(computed) == PARTS - 8
    xr.testing.assert_identical(xr.load_dataset(path), whole)


def interrupt(*_):
    raise KeyboardInterrupt


@pytest.mark.parametrize("when", range(6))
def test_interrupted_while_resuming(when, path, whole, monkeypatch):
    """As parts are regained, and as they then enter the new map, nothing is lost."""
    write_until(path, 4)
    real, calls = os.replace, []

    def replace(source, target):
        calls.append(target)
        if len(calls) == when + 1:
            raise KeyboardInterrupt
        real(source, target)

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(os, "replace", replace)
        write(path)
    computed = counted(monkeypatch)
    write(path)
    assert len(computed) <= PARTS - 4
    xr.testing.assert_identical(xr.load_dataset(path), whole)


def test_a_bit_that_flips_in_the_map_is_found(path, whole, monkeypatch):
    write_until(path, 6)
    file = path.with_name("map.nc.parts") / "whole.nc"
    content = bytearray(file.read_bytes())
    content[-1000] ^= 0x10
    file.write_bytes(content)
    computed = counted(monkeypatch)
    with pytest.warns(UserWarning, match=r"000005\.npz is damaged: it is computed again"):
        write(path)
    assert len(computed) == PARTS - 5
    xr.testing.assert_identical(xr.load_dataset(path), whole)


def test_a_map_cut_short_loses_only_what_is_cut(path, whole, monkeypatch):
    write_until(path, 6)
    file = path.with_name("map.nc.parts") / "whole.nc"
    os.truncate(file, file.stat().st_size - 1000)
    computed = counted(monkeypatch)
    with pytest.warns(UserWarning, match=r"000005\.npz is damaged: it is computed again"):
        write(path)
    assert len(computed) == PARTS - 5
    xr.testing.assert_identical(xr.load_dataset(path), whole)


def test_parts_of_a_map_in_its_place_are_forgotten(path, whole, monkeypatch):
    """As after a crash between the renaming of the map and the removal of its parts."""
    write_until(path, 6)
    (path.with_name("map.nc.parts") / "whole.nc").unlink()
    computed = counted(monkeypatch)
    write(path)
    assert len(computed) == PARTS
    xr.testing.assert_identical(xr.load_dataset(path), whole)
    assert os.listdir(path.parent) == ["map.nc"]


def test_a_part_of_an_older_version_is_not_taken(path, whole):
    write_until(path, 1)
    folder = path.with_name("map.nc.parts")
    cells = {name: whole[name].values.ravel()[:2500] for name in whole.data_vars}
    np.savez(folder / "000000.npz", **cells, identity="of then", number=np.int64(0))
    with pytest.warns(UserWarning, match=r"000000\.npz is of another sweep: it is computed again"):
        write(path)
    xr.testing.assert_identical(xr.load_dataset(path), whole)


def test_parts_of_films_that_differ_are_not_exchanged(path):
    volts = {"voltage": np.linspace(1000.0, 3000.0, 40), "thickness": 1e-4}
    slow = dm.Material(87.8e3, 22.8e3, 200.0, 4.7)
    fast = dm.Material(87.8e3, 22.8e3, 100.0, 4.7)
    stream.PART_CELLS = stream.CHUNK_CELLS = 10
    with pytest.MonkeyPatch.context() as patch, pytest.raises(KeyboardInterrupt):
        counted(patch, 2)
        dm.sweep_to_netcdf(path, dm.Step(), material=slow, **volts)
    with pytest.warns(UserWarning, match="of another sweep"):
        dm.sweep_to_netcdf(path, dm.Step(), material=fast, **volts)
    shutil.rmtree(path.with_name("map.nc.parts"), ignore_errors=True)
    xr.testing.assert_identical(xr.load_dataset(path), dm.sweep(dm.Step(), material=fast, **volts))


@pytest.mark.parametrize("cells", [7, 500, 10**6])
def test_chunks_are_whole_in_every_part(cells, path, monkeypatch):
    """Also where memory allows parts smaller than the chunks would be."""
    monkeypatch.setattr(stream, "CHUNK_CELLS", 10**5)
    monkeypatch.setattr(stream, "PARTS_IN_MEMORY", 2**30 // (41 * cells))
    few = {**FILMS, "field": FILMS["field"][:3]}
    dm.sweep_to_netcdf(path, dm.Step(), **few)
    xr.testing.assert_identical(xr.load_dataset(path), dm.sweep(dm.Step(), **few))
