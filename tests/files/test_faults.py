"""What happens to long runs: killed, interrupted, out of disk. Nothing finished is lost, nothing is wrong."""

import os
import random
import resource
import signal
import subprocess
import sys
import time
from contextlib import chdir, suppress

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.cli.main import main
from dea_maps.files import stream

SPEC = """
[program]
name = "ramp_hold"
[grid]
field = { start = 0.8, stop = 2.2, num = 13 }
rate = { start = 1e-3, stop = 1e3, num = 11, spacing = "log" }
modulus_ratio = { start = 2.0, stop = 6.0, num = 7 }
"""
CUBE = {"field": np.linspace(0.8, 2.2, 13), "rate": np.geomspace(1e-3, 1e3, 11), "modulus_ratio": np.linspace(2, 6, 7)}
PARTS = 39
# A process that imports all and reads the machine code, says so, and then runs the command line on small parts.
RUN = """
import sys, time
import dea_maps as dm
from dea_maps.cli.main import main
from dea_maps.files import engines, stream
stream.PART_CELLS = stream.CHUNK_CELLS = 30
dm.sweep(dm.RampHold(), field=1.2, rate=1.0, modulus_ratio=4.0)
real = engines.solve
def solve(*arguments, **options):
    time.sleep(PAUSE)
    return real(*arguments, **options)
engines.solve = solve
print("ready", flush=True)
sys.exit(main(sys.argv[1:]))
"""
# The same without imports for every run: a process that is forked, small parts and all, whenever a line arrives.
FORKED = RUN.replace(
    "sys.exit(main(sys.argv[1:]))",
    """
import os
for line in sys.stdin:
    process = os.fork()
    if process == 0:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os._exit(main(sys.argv[1:]))
    print(process, flush=True)
    print(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), flush=True)
""",
)


@pytest.fixture(scope="module")
def whole():
    return dm.sweep(dm.RampHold(), **CUBE)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "spec.toml").write_text(SPEC)
    return tmp_path


def started(folder, *options, pause=0.0, **how):
    """Return a process that is about to sweep."""
    code = RUN.replace("PAUSE", repr(pause))
    command = [sys.executable, "-c", code, "sweep", "spec.toml", "-o", "map.nc", *options]
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **how)
    assert process.stdout.readline() == "ready\n"
    return process


@pytest.fixture
def finish(folder, monkeypatch, capsys):
    """Return a function that runs the sweep here, on the same small parts, and returns its status and errors."""
    monkeypatch.setattr(stream, "PART_CELLS", 30)
    monkeypatch.setattr(stream, "CHUNK_CELLS", 30)

    def run(where=folder):
        with chdir(where):  # and out of it again: nobody may be where a file system is taken away
            status = main(["sweep", "spec.toml", "-o", "map.nc"])
        return status, capsys.readouterr().err

    return run


def kept(folder):
    return len(list((folder / "map.nc.parts").glob("*.npz")))


def assert_complete(folder, whole):
    xr.testing.assert_identical(xr.load_dataset(folder / "map.nc"), whole)
    assert sorted(os.listdir(folder)) == ["map.nc", "spec.toml"]


@pytest.fixture
def forked(folder):
    """Return a function that runs the sweep, killed after some seconds unless it has ended, and returns its status."""
    command = [sys.executable, "-c", FORKED.replace("PAUSE", "0.01"), "sweep", "spec.toml", "-o", "map.nc"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(command, cwd=folder, text=True, **pipes) as parent:
        assert parent.stdout.readline() == "ready\n"

        def run(seconds=None):
            print("run", file=parent.stdin, flush=True)
            process = int(parent.stdout.readline())
            if seconds is not None:
                time.sleep(seconds)
                with suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)
            return int(parent.stdout.readline())

        yield run
        parent.stdin.close()


def test_killed_at_any_moment(folder, forked, whole):
    draw = random.Random(8)
    interrupted = 0
    for kill in range(30):
        # with the parts of all kills before: early ones hit the computing, late ones the file that is put together
        assert forked(draw.uniform(0.0, 0.5)) in {0, -signal.SIGKILL}
        if (folder / "map.nc").exists():
            xr.testing.assert_identical(xr.load_dataset(folder / "map.nc"), whole)
        else:
            interrupted += 1
        if kill % 6 == 5:
            assert forked() == 0
            assert_complete(folder, whole)
            (folder / "map.nc").unlink()
    assert interrupted >= 10


def test_interrupted_by_hand(folder, finish, whole):
    process = started(folder, pause=0.05)
    while kept(folder) < 3:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err.startswith("dea-maps: error: interrupted; ")
    assert f"{kept(folder)} of {PARTS} parts are kept in " in err
    assert err.endswith("to resume: dea-maps sweep spec.toml -o map.nc\n")
    assert 3 <= kept(folder) < PARTS
    assert finish()[0] == 0
    assert_complete(folder, whole)


def limited(size):
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def test_files_may_not_grow(folder, finish, whole):
    """A limit on the size of a file meets the map first: its parts are smaller."""
    assert finish()[0] == 0
    size = (folder / "map.nc").stat().st_size
    (folder / "map.nc").unlink()
    process = started(folder, preexec_fn=limited(int(0.8 * size)))
    _, err = process.communicate(timeout=60)
    assert process.returncode == 1
    assert err.startswith("dea-maps: error: ")
    assert err.count("\n") == 1
    assert kept(folder) > 0
    assert not (folder / "map.nc").exists()
    assert finish()[0] == 0
    assert_complete(folder, whole)


def test_a_full_disk(folder, finish, whole):
    small = folder / "small"
    small.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(small)]
    if subprocess.run(mount, capture_output=True, check=False).returncode != 0:
        pytest.skip("a small file system cannot be mounted here")
    try:
        (small / "spec.toml").write_text(SPEC)
        process = started(small)
        _, err = process.communicate(timeout=60)
        assert process.returncode == 1
        assert err.startswith("dea-maps: error: ")
        assert err.count("\n") == 1
        some = kept(small)
        assert 0 < some < PARTS
        subprocess.run(["mount", "-o", "remount,size=8M", str(small)], check=True)
        assert finish(small)[0] == 0
        assert_complete(small, whole)
    finally:
        subprocess.run(["umount", str(small)], check=True)


def test_a_folder_that_cannot_be_written(folder, finish):
    (folder / "map.nc").mkdir()
    status, err = finish()
    assert status == 2
    assert err == "dea-maps: error: cannot write map.nc: it is a folder\n"
