"""Machine code on disk: found by the next process, never by another version of the sources."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import pytest

ROOT = Path(__file__).parents[1]

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="no machine code with the JIT off")

CALL = """
import numpy as np
from dea_maps.kernels import build

kernel = build.sweep_for("step", "stretch", "quadrature")
result, status = np.empty((5, 1)), np.empty(1, np.int8)
kernel(np.array([1.2]), np.zeros(1), np.array([4.0]), 1e-6, 0.0, 1, status, result)
print(sum(kernel.stats.cache_hits.values()), sum(kernel.stats.cache_misses.values()), float(result[1, 0]))
"""


@pytest.fixture
def package(tmp_path):
    """Copy the sources to a folder of their own, importable from there."""
    shutil.copytree(ROOT / "dea_maps", tmp_path / "dea_maps", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "kernels", tmp_path / "dea_maps" / "kernels", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def call(package):
    """Return cache hits, cache misses and the critical stretch, from a new process."""
    variables = {**os.environ, "PYTHONPATH": str(package), "NUMBA_CACHE_DIR": str(package / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", CALL], cwd=package, env=variables, capture_output=True, text=True, check=True
    )
    hits, misses, stretch = done.stdout.split()
    return int(hits), int(misses), float(stretch)


def test_the_next_process_finds_the_code_and_an_edited_source_does_not(package):
    assert call(package) == (0, 1, pytest.approx(1.659354969, rel=1e-9))
    assert call(package) == (1, 0, pytest.approx(1.659354969, rel=1e-9))

    # A helper of the kernel, in another file than the one that is compiled: twice the critical stretch.
    source = package / "dea_maps" / "kernels" / "scenes.py"
    text = source.read_text()
    edited = text.replace("/ np.sqrt(CRITICAL_U)", "/ (0.5 * np.sqrt(CRITICAL_U))")
    assert edited != text
    source.write_text(edited)
    assert call(package) == (0, 1, pytest.approx(2 * 1.659354969, rel=1e-9))
