"""Sweeps to files: the same map as in memory, part by part, whatever interrupts or damages them."""

import os
import shutil
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.files import engines, stream
from dea_maps.files.to_netcdf import planned_file
from dea_maps.runs.request import Request

CUBE = {"field": np.linspace(0.8, 2.2, 13), "rate": np.geomspace(1e-3, 1e3, 11), "modulus_ratio": np.linspace(2, 6, 7)}
GRIDS = {
    "cube": (dm.RampHold(), CUBE),
    "one part": (dm.Step(), {"field": [0.9, 1.2], "modulus_ratio": 4.0}),
    "one cell": (dm.Ramp(), {"rate": 1.0, "modulus_ratio": 4.0}),
    "no cell": (dm.Step(), {"field": [], "modulus_ratio": [2.0, 4.0]}),
    "samples": (
        dm.Ramp(),
        {"rate": xr.DataArray(np.geomspace(0.01, 10, 300), dims="sample"), "modulus_ratio": 4.0},
    ),
    "labels": (
        dm.Step(),
        {
            "field": xr.DataArray([1.1, 1.3], dims="film", coords={"film": ["thin", "thick"]}),
            "modulus_ratio": [2.0, 4.0],
        },
    ),
}


@pytest.fixture(autouse=True)
def small_parts(monkeypatch):
    """Cut small grids into many parts and chunks."""
    monkeypatch.setattr(stream, "PART_CELLS", 100)
    monkeypatch.setattr(stream, "CHUNK_CELLS", 30)


@pytest.fixture(scope="module")
def whole():
    return dm.sweep(dm.RampHold(), **CUBE)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "map.nc"


def write(path, **options):
    dm.sweep_to_netcdf(path, dm.RampHold(), **CUBE, **options)


def parts_in(path):
    return sorted(path.with_name("map.nc.parts").glob("*.npz"))


@pytest.mark.parametrize("name", GRIDS)
def test_file_holds_what_a_sweep_returns(name, path):
    program, parameters = GRIDS[name]
    path.write_text("old")
    assert dm.sweep_to_netcdf(path, program, **parameters) is None
    xr.testing.assert_identical(xr.load_dataset(path), dm.sweep(program, **parameters))
    assert os.listdir(path.parent) == ["map.nc"]


def test_variables_are_stored_as_a_data_set_stores_them(path, tmp_path, whole):
    write(path)
    whole.to_netcdf(tmp_path / "other.nc")
    with xr.open_dataset(path) as found, xr.open_dataset(tmp_path / "other.nc") as expected:
        for name in whole.variables:
            storage = ("dtype", "zlib", "shuffle", "fletcher32", "complevel")
            kept = {key: found[name].encoding.get(key) for key in storage}
            assert kept == {key: expected[name].encoding.get(key) for key in kept}
            assert ("_FillValue" in found[name].encoding) == ("_FillValue" in expected[name].encoding)


def test_some_variables_in_single_precision(path, whole):
    write(path, variables=["time_to_failure", "outcome"], dtype="float32")
    ds = xr.load_dataset(path)
    assert list(ds.data_vars) == ["outcome", "time_to_failure"]
    np.testing.assert_array_equal(ds.outcome, whole.outcome)
    np.testing.assert_array_equal(ds.time_to_failure, whole.time_to_failure.astype(np.float32))


def stop_after(monkeypatch, count, error):
    """Let so many parts be computed, then fail; return the list of numbers of cells that were computed."""
    done = []
    real = engines.solve

    def solve(*arguments, **options):
        if len(done) >= count:
            raise error
        done.append(arguments[1]["modulus_ratio"].size)
        return real(*arguments, **options)

    monkeypatch.setattr(engines, "solve", solve)
    return done


@pytest.mark.parametrize("error", [KeyboardInterrupt(), OSError("the disk is full"), MemoryError("no room")])
def test_an_interrupted_sweep_goes_on(path, whole, monkeypatch, error):
    path.write_text("old")
    with monkeypatch.context() as patch, pytest.raises(type(error)):
        stop_after(patch, 5, error)
        write(path)
    assert path.read_text() == "old"
    assert len(parts_in(path)) == 5
    with monkeypatch.context() as patch:
        computed = stop_after(patch, 10**9, None)
        write(path)
    assert sum(computed) == whole.outcome.size - 5 * 77
    xr.testing.assert_identical(xr.load_dataset(path), whole)
    assert os.listdir(path.parent) == ["map.nc"]


def test_an_interrupt_says_what_is_kept(path, monkeypatch):
    stop_after(monkeypatch, 5, KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt, match=r"5 of 13 parts are kept in .*map\.nc\.parts"):
        write(path)


def half_done(path, monkeypatch, count=5):
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        stop_after(patch, count, KeyboardInterrupt())
        write(path)
    return parts_in(path)


def test_a_fresh_start_forgets_the_parts(path, whole, monkeypatch):
    half_done(path, monkeypatch)
    with monkeypatch.context() as patch:
        computed = stop_after(patch, 10**9, None)
        write(path, fresh=True)
    assert sum(computed) == whole.outcome.size


def flip(path, place):
    data = bytearray(path.read_bytes())
    data[int(place * (len(data) - 1))] ^= 0x10
    path.write_bytes(data)


DAMAGE = {
    "empty": lambda path: path.write_bytes(b""),
    "truncated": lambda path: path.write_bytes(path.read_bytes()[:-100]),
    "half": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "foreign": lambda path: path.write_text("not a part"),
    "another archive": lambda path: np.savez(path, outcome=np.zeros(3)),
    "flipped": lambda path: flip(path, 0.4),
    "exchanged": lambda path: shutil.copy(path.with_name("000003.npz"), path),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_damaged_parts_are_named_and_computed_again(name, path, whole, monkeypatch):
    part = half_done(path, monkeypatch)[1]
    DAMAGE[name](part)
    with monkeypatch.context() as patch, pytest.warns(UserWarning, match=rf"{part} is .*: it is computed again"):
        computed = stop_after(patch, 10**9, None)
        write(path)
    assert sum(computed) == whole.outcome.size - 4 * 77
    xr.testing.assert_identical(xr.load_dataset(path), whole)


def test_no_flipped_bit_changes_the_map(path, whole, monkeypatch):
    """Wherever a bit flips in a part, the map is the same; only where it does not matter is the part taken."""
    saved = half_done(path, monkeypatch, 2)[0].parent
    shutil.copytree(saved, path.parent / "saved")
    rng = np.random.default_rng(3)
    for place in rng.random(12):
        shutil.rmtree(saved, ignore_errors=True)
        shutil.copytree(path.parent / "saved", saved)
        flip(saved / "000000.npz", place)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("warnings.warn", lambda *_, **__: None)
            write(path)
        xr.testing.assert_identical(xr.load_dataset(path), whole)


@pytest.mark.parametrize(
    "change",
    [
        {"rtol": 1e-7},
        {"method": "dopri5"},
        {"field": CUBE["field"] + 1e-15},
        {"variables": ["time_to_failure"]},
        {"dtype": "float32"},
    ],
)
def test_parts_of_another_sweep_are_not_taken(change, path, monkeypatch):
    half_done(path, monkeypatch, 1)
    asked = {**CUBE, **change}
    with pytest.warns(UserWarning, match="000000.npz is of another sweep"):
        dm.sweep_to_netcdf(path, dm.RampHold(), **asked)
    for key in ("variables", "dtype"):
        asked.pop(key, None)
    expected = dm.sweep(dm.RampHold(), **asked)
    for name, variable in xr.load_dataset(path).data_vars.items():
        np.testing.assert_array_equal(variable, expected[name].astype(variable.dtype))


def test_a_second_writer_is_refused(path, monkeypatch):
    real = engines.solve

    def solve(*arguments, **options):
        with pytest.raises(OSError, match="another sweep is writing it"):
            write(path)
        return real(*arguments, **options)

    with monkeypatch.context() as patch:
        patch.setattr(engines, "solve", solve)
        write(path)
    assert os.listdir(path.parent) == ["map.nc"]


def test_memory_bounds_the_parts(path, monkeypatch):
    monkeypatch.setattr(stream, "SHARING_PART_CELLS", 10**9)
    sizes = {}
    for memory in (None, "16MiB", 2**24, "20 MB", "1.5GiB"):
        plan = planned_file(path, Request(dm.RampHold(), {**CUBE, "field": np.linspace(1, 2, 10**6)}), memory=memory)
        sizes[memory] = max(plan.parts.cells(0), plan.parts.cells(1)) * 41
    assert sizes["16MiB"] == sizes[2**24] <= 2**24 / 8
    assert sizes["16MiB"] < sizes["20 MB"] < sizes[None] <= 2**30 / 8
    assert sizes[None] < sizes["1.5GiB"]


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"path": 3}, TypeError, "path must be a string or path-like; got 3"),
        ({"path": "absent/map.nc"}, FileNotFoundError, "cannot write absent/map.nc: there is no folder absent"),
        ({"variables": "outcome"}, TypeError, "variables must be names in a list or the like; got 'outcome'"),
        ({"variables": 3}, TypeError, "variables must be names in a list or the like; got 3"),
        ({"variables": []}, ValueError, "variables must name at least one variable; got none"),
        ({"variables": ["time"]}, ValueError, "variables must be among outcome, .*; got 'time'"),
        ({"dtype": "float16"}, ValueError, "dtype must be one of float64, float32; got 'float16'"),
        ({"engine": "spark"}, ValueError, "engine must be one of threads, dask; got 'spark'"),
        ({"scheduler": "tcp://host:1"}, ValueError, "scheduler must be left out with the engine 'threads'"),
        ({"memory": "much"}, ValueError, "memory must be a number of bytes .*; got 'much'"),
        ({"memory": "1MB"}, ValueError, "memory must be .* at least 16 MiB; got '1MB'"),
        ({"memory": 1.5}, TypeError, "memory must be .*; got 1.5"),
    ],
)
def test_bad_arguments_are_refused_before_solving(arguments, error, message, monkeypatch, tmp_path):
    monkeypatch.setattr(engines, "solve", None)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(error, match=message):
        dm.sweep_to_netcdf(**{"path": "map.nc", "program": dm.RampHold(), **CUBE, **arguments})
    assert os.listdir(tmp_path) == []


MARK = "parts-of-dea_maps"
OF_ANOTHER = {
    "notes": lambda folder, _: (folder / "notes.txt").write_text("mine"),
    "a part of another hand": lambda folder, _: (folder / "000001.npz").write_text("mine"),
    "notes among parts": lambda folder, _: [(folder / name).write_text("mine") for name in (MARK, "notes.txt")],
    "a folder for a part": lambda folder, _: ((folder / MARK).touch(), (folder / "000001.npz").mkdir()),
    "a link for a part": lambda folder, other: (
        (folder / MARK).touch(),
        (folder / "000001.npz").symlink_to(other / "mine"),
    ),
    "a link for the lock": lambda folder, other: (folder / "lock").symlink_to(other / "mine"),
    "a pipe": lambda folder, _: os.mkfifo(folder / "lock"),
}


def tree(folder):
    """Return all that is in a folder, and what is in its files."""
    found = {}
    for place in sorted(folder.rglob("*")):
        is_text = place.is_file() and not place.is_symlink()
        found[place.name] = place.read_text() if is_text else place.lstat().st_mode
    return found


@pytest.mark.parametrize("fresh", [False, True])
@pytest.mark.parametrize("name", OF_ANOTHER)
def test_a_folder_of_another_is_refused_and_stays(name, fresh, path, monkeypatch):
    folder, other = path.with_name("map.nc.parts"), path.with_name("other")
    folder.mkdir()
    other.mkdir()
    (other / "mine").write_text("mine")
    OF_ANOTHER[name](folder, other)
    before = tree(path.parent)
    monkeypatch.setattr(engines, "solve", None)
    with pytest.raises(OSError, match=rf"cannot write {path}: {folder}, the place of its parts, holds '") as caught:
        write(path, fresh=fresh)
    assert "\n" not in str(caught.value)
    assert tree(path.parent) == before


@pytest.mark.parametrize(("kind", "words"), [("link", "is a link"), ("file", "is not a folder")])
def test_a_place_of_parts_that_is_no_folder_is_refused(kind, words, path, monkeypatch):
    folder, other = path.with_name("map.nc.parts"), path.with_name("other")
    other.mkdir()
    folder.symlink_to(other) if kind == "link" else folder.write_text("mine")
    before = tree(path.parent)
    monkeypatch.setattr(engines, "solve", None)
    with pytest.raises(OSError, match=rf"{folder}, the place of its parts, {words}"):
        write(path)
    assert tree(path.parent) == before


def test_a_file_put_among_the_parts_while_computing_stays(path, whole, monkeypatch):
    real, notes = engines.solve, path.with_name("map.nc.parts") / "notes.txt"

    def solve(*arguments, **options):
        notes.write_text("mine")
        return real(*arguments, **options)

    monkeypatch.setattr(engines, "solve", solve)
    write(path)
    xr.testing.assert_identical(xr.load_dataset(path), whole)
    assert os.listdir(notes.parent) == ["notes.txt"]
    assert notes.read_text() == "mine"


@pytest.mark.parametrize("interrupted", [False, True])
def test_too_little_room_is_said_before_computing(interrupted, path, monkeypatch):
    if interrupted:
        half_done(path, monkeypatch)
    cube = {**CUBE, "field": np.linspace(0.8, 2.2, 200)}
    least = (200 * 11 * 7 * 41 + (200 + 11 + 7) * 8) // 4
    needed = least - sum(part.stat().st_size for part in path.parent.glob("map.nc.parts/*"))
    asked = []

    def disk_usage(free):
        return lambda folder: (asked.append(folder), SimpleNamespace(free=free))[1]

    refusal = rf"cannot write {path}: the map needs at least .* MiB, and .* MiB are free in {path.parent}"
    with monkeypatch.context() as patch, pytest.raises(OSError, match=refusal):
        patch.setattr(engines, "solve", None)
        patch.setattr(shutil, "disk_usage", disk_usage(needed - 1))
        dm.sweep_to_netcdf(path, dm.RampHold(), **cube)
    monkeypatch.setattr(shutil, "disk_usage", disk_usage(needed))
    planned_file(path, Request(dm.RampHold(), cube))
    assert 0 < needed <= least
    assert asked == [path.parent, path.parent]


def test_a_link_is_followed_and_the_mode_kept(path, tmp_path, whole):
    (tmp_path / "elsewhere").mkdir()
    target = tmp_path / "elsewhere" / "old.nc"
    target.write_text("old")
    target.chmod(0o640)
    path.symlink_to(target)
    write(path)
    assert path.is_symlink()
    assert target.stat().st_mode & 0o7777 == 0o640
    xr.testing.assert_identical(xr.load_dataset(target), whole)
    assert os.listdir(target.parent) == ["old.nc"]


def test_threads_write_and_open_at_once(tmp_path, whole):
    """Each of eight threads writes its own files and reads those of others; HDF5 alone would crash the process."""
    field = CUBE["field"]

    def work(number):
        for turn in range(3):
            own, other = tmp_path / f"{number}.nc", tmp_path / f"{(number + turn) % 8}.nc"
            dm.sweep_to_netcdf(own, dm.RampHold(), **{**CUBE, "field": field + number / 100})
            for file in (own, other):
                if file.exists():
                    with dm.open(file) as ds:
                        assert ds.critical_stretch.shape == whole.outcome.shape
                        ds.time_to_failure.sum().item()
        return number

    with ThreadPoolExecutor(8) as threads:
        assert list(threads.map(work, range(8))) == list(range(8))
    for number in range(8):
        expected = dm.sweep(dm.RampHold(), **{**CUBE, "field": field + number / 100})
        xr.testing.assert_identical(xr.load_dataset(tmp_path / f"{number}.nc"), expected)
    assert len(os.listdir(tmp_path)) == 8
