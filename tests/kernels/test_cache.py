"""Machine code on disk: found by the next process, never by another version of the sources, and not needed."""

import errno
import os
import shutil
import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path

import filelock
import numba
import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.cli.main import main
from dea_maps.kernels import _cache, _jit

ROOT = Path(__file__).parents[2]

compiles_only = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="no machine code with the JIT off")

CALL = """
import numpy as np
from numba.core.event import install_recorder
from dea_maps.sweeps import solve
from dea_maps.sweeps.methods import choose
from dea_maps.programs import Step

choice = choose(Step(), "auto", "auto", 1e-6, None)
expected = solve.compiles(Step(), choice)
with install_recorder("numba:compile") as compiling:
    found = solve.solve(Step(), {"field": np.array([1.2]), "modulus_ratio": np.array([4.0])}, choice)
assert expected == bool(compiling.buffer)
print(expected, solve.compiles(Step(), choice), float(found.critical_stretch[0]))
"""


@pytest.fixture
def package(tmp_path):
    """Copy the sources to a folder of their own, importable from there."""
    shutil.copytree(ROOT / "dea_maps", tmp_path / "dea_maps", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "kernels", tmp_path / "dea_maps" / "kernels", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def call(package, **variables):
    """Return whether the kernel was to be compiled, whether it still was after, and the critical stretch."""
    variables = {**os.environ, "PYTHONPATH": str(package), "NUMBA_CACHE_DIR": str(package / "cache"), **variables}
    done = subprocess.run(
        [sys.executable, "-c", CALL], cwd=package, env=variables, capture_output=True, text=True, check=True
    )
    before, after, stretch = done.stdout.split()
    return before, after, float(stretch)


@compiles_only
def test_later_processes_find_the_code_and_an_edited_source_does_not(package):
    """Neither Python's own cache nor the folder of the sources decides what is found."""
    known = pytest.approx(1.659354969, rel=1e-9)
    kept = {"NUMBA_CACHE_DIR": str(package / "cache"), "PYTHONDONTWRITEBYTECODE": ""}
    assert call(package, **kept) == ("True", "False", known)  # Python compiles the sources
    assert any(package.rglob("*.pyc"))
    assert call(package, **kept) == ("False", "False", known)  # Python reads them compiled
    moved = package / "elsewhere"
    moved.mkdir()
    (package / "dea_maps").rename(moved / "dea_maps")
    assert call(moved, **kept) == ("False", "False", known)

    # A helper of the kernel, in another file than the one that is compiled: twice the critical stretch. And in the
    # user's cache folder, which is what is taken where nothing else is said.
    source = moved / "dea_maps" / "kernels" / "solvers.py"
    text = source.read_text()
    edited = text.replace("/ np.sqrt(CRITICAL_U)", "/ (0.5 * np.sqrt(CRITICAL_U))")
    assert edited != text
    source.write_text(edited)
    home = package / "home"
    elsewhere = {"NUMBA_CACHE_DIR": "", "HOME": str(home), "XDG_CACHE_HOME": "", "LOCALAPPDATA": str(home)}
    assert call(moved, **elsewhere) == ("True", "False", pytest.approx(2 * 1.659354969, rel=1e-9))
    folders = {path.relative_to(package).parts[0] for path in package.rglob("*.nb[ci]")}
    assert folders == {"cache", "home"}


def test_the_fingerprint_knows_every_source_and_where_it_is(tmp_path, monkeypatch):
    monkeypatch.setattr(_jit, "__file__", str(tmp_path / "_jit.py"))
    inner = tmp_path / "forms" / "area.py"
    inner.parent.mkdir()
    found = set()
    for source in ("a = 1", "a = 2"):
        inner.write_text(source)
        found.add(_jit._fingerprint())
    (tmp_path / "forms" / "notes.txt").write_text("no source")
    assert _jit._fingerprint() in found
    inner.rename(tmp_path / "area.py")
    assert _jit._fingerprint() not in found
    (tmp_path / "area.py").rename(inner)
    assert _jit._fingerprint() in found


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return the folder of the machine code of kernels made from now on, which does not exist yet."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))
    _cache._warn_once.cache_clear()
    yield tmp_path / "cache" / "dea_maps" / _jit.FINGERPRINT
    _cache._warn_once.cache_clear()


def scale_by(factor):
    """Make a kernel as another process would make it again."""

    def scale(x):
        return factor * x

    return _jit.Kernel(scale, "float64,")


def used(kernel, x):
    """Return whether a kernel was to be compiled, and its result."""
    return kernel.needs_compiling(), kernel(x)


@compiles_only
def test_a_kernel_has_one_file_and_kernels_are_told_apart(folder):
    assert used(scale_by(2.0), 3.0) == (True, 6.0)
    assert used(scale_by(2.0), 4.0) == (False, 8.0)
    assert used(scale_by(3.0), 4.0) == (True, 12.0)
    assert used(scale_by(3.0), 5.0) == (False, 15.0)
    assert len(list(folder.iterdir())) == 2


@compiles_only
def test_another_version_of_numba_does_not_find_the_code(folder, monkeypatch):
    assert used(scale_by(2.0), 3.0) == (True, 6.0)
    monkeypatch.setattr(numba, "__version__", "another")
    assert used(scale_by(2.0), 3.0) == (True, 6.0)
    assert used(scale_by(2.0), 3.0) == (False, 6.0)


@compiles_only
def test_a_kernel_is_compiled_once_for_arrays_of_every_layout(folder):
    def total(x):
        found = 0.0
        for row in range(x.shape[0]):
            for column in range(x.shape[1]):
                found += x[row, column]
        return found

    kernel = _jit.Kernel(total, "float64[:, :],")
    x = np.arange(12.0).reshape(3, 4)
    assert [kernel(x), kernel(x.T), kernel(x[:, 1:3]), kernel(x[:1, :1])] == [66.0, 66.0, 33.0, 0.0]
    assert len(kernel._machine.signatures) == 1
    assert len(list(folder.iterdir())) == 1


@compiles_only
def test_threads_that_begin_at_once_wait_for_one_compilation(folder):
    kernel = scale_by(7.0)
    barrier = threading.Barrier(4)
    found = []

    def work():
        barrier.wait()
        found.append(kernel(2.0))

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [14.0] * 4
    assert sum(kernel._machine._cache_misses.values()) == 1


def lock_of(kernel):
    """Return the file that another process locks while it compiles the same."""
    return kernel._machine._cache._path(kernel._signature, kernel._machine.targetctx).with_suffix(".lock")


@compiles_only
def test_processes_that_begin_at_once_wait_for_one_compilation(folder):
    first, second = scale_by(7.0), scale_by(7.0)  # as two processes would make it
    compile_it, began = first._machine.compile, threading.Event()

    def compile_slowly(signature):
        began.set()
        time.sleep(0.5)
        compile_it(signature)

    first._machine.compile = compile_slowly
    thread = threading.Thread(target=first.prepare)
    thread.start()
    assert began.wait(60.0)
    assert second(2.0) == 14.0
    thread.join()
    assert (sum(second._machine._cache_hits.values()), sum(second._machine._cache_misses.values())) == (1, 0)
    assert len(list(folder.iterdir())) == 1


@compiles_only
def test_a_process_that_was_killed_keeps_nobody_waiting(folder):
    kernel = scale_by(2.0)
    folder.mkdir(parents=True)
    lock_of(kernel).touch()
    assert used(kernel, 3.0) == (True, 6.0)
    assert len(list(folder.iterdir())) == 1


@compiles_only
def test_a_process_that_hangs_does_not_keep_others_waiting_for_ever(folder, monkeypatch):
    monkeypatch.setattr(_cache, "LONGEST_WAIT", 0.1)
    kernel = scale_by(2.0)
    folder.mkdir(parents=True)
    with filelock.FileLock(lock_of(kernel)):
        assert used(kernel, 3.0) == (True, 6.0)
        assert lock_of(kernel).exists()


@compiles_only
@pytest.mark.parametrize("error", [NotImplementedError, OSError(errno.ENOLCK, "No locks available")])
def test_where_files_cannot_be_locked_kernels_are_compiled_all_the_same(folder, monkeypatch, error):
    def refused(lock, timeout):
        raise error

    monkeypatch.setattr(_cache.FileLock, "acquire", refused)
    assert used(scale_by(2.0), 3.0) == (True, 6.0)
    assert used(scale_by(2.0), 3.0) == (False, 6.0)


def empty(content):
    return b""


def truncated(content):
    return content[: len(content) // 2]


def flipped(content):
    """One bit of the machine code: it may well run, and give something else."""
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


def garbage(content):
    return np.random.default_rng(0).bytes(len(content))


@compiles_only
@pytest.mark.parametrize("damage", [empty, truncated, flipped, garbage])
def test_damaged_files_are_compiled_again_with_one_warning(folder, damage):
    for factor in (2.0, 3.0):
        scale_by(factor)(1.0)
    for path in folder.iterdir():
        path.write_bytes(damage(path.read_bytes()))
    with pytest.warns(UserWarning, match=r"^unusable machine code in .*: compiled again$") as told:
        assert [used(scale_by(factor), 4.0) for factor in (2.0, 3.0)] == [(True, 8.0), (True, 12.0)]
    assert len(told) == 1
    assert [used(scale_by(factor), 4.0) for factor in (2.0, 3.0)] == [(False, 8.0), (False, 12.0)]


def check_nothing_kept(reason):
    """Kernels are compiled, with one warning in all, and again by whoever comes next."""
    with pytest.warns(UserWarning, match=rf"^machine code cannot be kept in .* \({reason}\): every process") as told:
        assert [used(scale_by(factor), 4.0) for factor in (2.0, 3.0, 2.0)] == [(True, 8.0), (True, 12.0), (True, 8.0)]
    assert len(told) == 1


@compiles_only
def test_a_full_disk_costs_the_cache_alone(folder, monkeypatch):
    write = Path.write_bytes

    def without_room(path, content):
        write(path, content[:100])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))

    monkeypatch.setattr(Path, "write_bytes", without_room)
    check_nothing_kept("No space left on device")
    assert not list(folder.iterdir())


@compiles_only
def test_a_file_in_place_of_the_folder_costs_the_cache_alone(folder):
    folder.parent.parent.mkdir()
    folder.parent.write_text("notes")
    check_nothing_kept("(Not a directory|File exists)")
    assert folder.parent.read_text() == "notes"


@compiles_only
def test_a_folder_in_place_of_a_file_costs_the_cache_alone(folder):
    scale_by(2.0)(1.0)
    (path,) = folder.iterdir()
    path.unlink()
    path.mkdir()
    with pytest.warns(UserWarning) as told:
        assert used(scale_by(2.0), 4.0) == (True, 8.0)
    assert len(told) == 2
    assert [file.name for file in folder.iterdir()] == [path.name]


@compiles_only
@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="may write everywhere")
def test_no_right_to_write_costs_the_cache_alone(folder):
    folder.parent.mkdir(parents=True)
    folder.parent.chmod(0o500)
    check_nothing_kept("Permission denied")
    folder.parent.chmod(0o700)


SPECIFICATION = """
[program]
name = "step"
[grid]
field = [0.9, 1.2]
modulus_ratio = 4.0
"""

LIMITED = """
import resource, sys
from dea_maps.cli.main import main

resource.setrlimit(resource.RLIMIT_FSIZE, (2**16, 2**16))
sys.exit(main(["sweep", "spec.toml", "-o", "map.nc"]))
"""


@compiles_only
@pytest.mark.skipif(sys.platform == "win32", reason="no limits on the size of files")
def test_a_sweep_whose_code_is_larger_than_files_may_be(tmp_path):
    (tmp_path / "spec.toml").write_text(SPECIFICATION)
    variables = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", LIMITED], cwd=tmp_path, env=variables, capture_output=True, text=True, check=True
    )
    assert done.stdout == "map.nc: 2 cells: 1 survives, 1 fails later, 0 fails at once, 0 unresolved\n"
    said, warned = done.stderr.splitlines()
    assert said.startswith("compiling for step, once, some ")
    assert warned.startswith("dea-maps: warning: machine code cannot be kept in ")
    kept = [path.name.partition("-")[0] for path in (tmp_path / "cache").rglob("*") if path.is_file()]
    assert kept == ["sums"], "that of checksums alone is smaller"
    with xr.open_dataset(tmp_path / "map.nc") as ds:
        assert ds.critical_stretch.values[1] == pytest.approx(1.659354969, rel=1e-6)


def test_old_versions_are_removed_but_for_those_used_last(folder):
    now = time.time()
    others = [folder.parent / f"{number:016x}" for number in range(6)]
    for age, other in enumerate(others):
        other.mkdir(parents=True)
        (other / "code.nbc").write_bytes(b"code")
        os.utime(other, (now, now - 1000 * age))
    (folder.parent / "notes").mkdir()
    (folder.parent / ("f" * 16)).symlink_to(folder.parent / "notes")
    folder.mkdir()
    _cache.MachineCode(test_old_versions_are_removed_but_for_those_used_last, _jit.FINGERPRINT)._remove_old_versions()
    kept = {path.name for path in folder.parent.iterdir()}
    assert kept >= {folder.name, "notes", "f" * 16}
    assert kept & {other.name for other in others} <= {other.name for other in others[: _cache.KEPT - 1]}
    assert others[0].exists()
    assert not others[-1].exists()


@compiles_only
def test_loading_counts_as_use(folder):
    scale_by(2.0)(1.0)
    os.utime(folder, (0.0, 0.0))
    assert scale_by(2.0)(4.0) == 8.0
    assert folder.stat().st_mtime > time.time() - 3600.0


@compiles_only
def test_a_version_that_another_process_removes_is_compiled_again(folder):
    scale_by(2.0)(1.0)
    kernel = scale_by(2.0)
    assert not kernel.needs_compiling()
    shutil.rmtree(folder)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert kernel(4.0) == 8.0
    assert used(scale_by(2.0), 4.0) == (False, 8.0)


@pytest.fixture
def cold(monkeypatch):
    """Let every kernel look as if it were still to be compiled."""
    monkeypatch.setattr(_jit.Kernel, "needs_compiling", lambda kernel: True)


STEP = {"field": [0.9, 1.2], "modulus_ratio": 4.0}


def test_compiling_is_said_with_progress(cold, capsys, tmp_path):
    dm.sweep(dm.Step(), **STEP)
    assert capsys.readouterr() == ("", "")
    dm.sweep(dm.Step(), **STEP, progress=True)
    dm.sweep_to_netcdf(tmp_path / "map.nc", dm.Step(), **STEP, progress=True)
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("compiling for step, once, some ") == 2
    assert "compiling" not in captured.err[captured.err.index("100%") :].partition("\n")[0]


def test_what_is_there_already_is_not_said_to_be_compiled(capsys):
    dm.sweep(dm.Step(), **STEP)
    dm.sweep(dm.Step(), **STEP, progress=True)
    assert "compiling" not in capsys.readouterr().err


def test_compiling_is_said_on_the_command_line(cold, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("spec.toml").write_text(SPECIFICATION)
    assert main(["sweep", "spec.toml", "-o", "map.nc"]) == 0
    captured = capsys.readouterr()
    assert captured.err.startswith("compiling for step, once, some ")
    assert captured.err.count("\n") == 1
    assert main(["sweep", "spec.toml", "-o", "map.nc", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
