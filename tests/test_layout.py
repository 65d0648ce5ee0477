"""The layout: two houses and one door, small files, light imports."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import dea_maps as dm

ROOT = Path(__file__).parents[1]
OUTER, INNER = ROOT / "dea_maps", ROOT / "kernels"
PYTHON = sorted(
    path for folder in ("dea_maps", "kernels", "tests", "studies") for path in (ROOT / folder).rglob("*.py")
)
HEAVY = ("numba", "numpy", "scipy", "xarray", "pandas", "netCDF4", "matplotlib", "tqdm", "bokeh")


def imported(path, package):
    """Return the full names of the modules that a file imports, wherever in it."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            parents = package.split(".")
            base = parents[: len(parents) - node.level + 1] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            found |= {module, *(f"{module}.{alias.name}" for alias in node.names)}
    return found


def test_files_are_found():
    assert len(list(OUTER.glob("*.py"))) > 10
    assert len(list(INNER.glob("*.py"))) > 5


def test_kernels_know_nothing_of_the_outer_house():
    for path in INNER.rglob("*.py"):
        outer = {
            name
            for name in imported(path, "dea_maps.kernels")
            if name.split(".")[0] == "dea_maps" and not name.startswith("dea_maps.kernels")
        }
        assert not outer, f"{path.name} imports {outer}"


def test_one_module_is_the_door_to_the_kernels():
    doors = {
        path.name
        for path in OUTER.glob("*.py")
        if any(name.startswith("dea_maps.kernels") for name in imported(path, "dea_maps"))
    }
    assert doors == {"solve.py"}


@pytest.mark.parametrize("path", PYTHON, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_files_are_short(path):
    assert len(path.read_text().splitlines()) <= 300


def modules_after(statement):
    code = f"import sys; {statement}; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(run.stdout.splitlines()[-1].split())


@pytest.mark.parametrize(
    "statement",
    ["import dea_maps", "from dea_maps.cli import main; main(['--help'])", "from dea_maps import Step"],
)
def test_nothing_heavy_is_imported_early(statement):
    modules = modules_after(statement)
    assert "dea_maps" in modules
    assert not modules & set(HEAVY)


def test_every_public_name_is_there():
    for name in dm.__all__:
        assert name in dir(dm)
        assert getattr(dm, name) is not None
    with pytest.raises(AttributeError, match="module 'dea_maps' has no attribute 'sweeps'"):
        dm.sweeps  # noqa: B018


def test_functions_are_not_hidden_by_modules():
    code = (
        "import dea_maps.sweeping, dea_maps.catalogue, dea_maps.trajectories, dea_maps as dm;"
        "assert all(callable(f) for f in (dm.sweep, dm.methods, dm.trajectory, dm.sweep_to_netcdf))"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
