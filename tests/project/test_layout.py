"""The layout: rooms whose imports run one way, one interface to the kernels, light imports."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import dea_maps as dm

ROOT = Path(__file__).parents[2]
OUTER, INNER = ROOT / "dea_maps", ROOT / "kernels"
HEAVY = ("numba", "numpy", "scipy", "xarray", "pandas", "netCDF4", "h5py", "matplotlib", "tqdm", "bokeh")

# Rooms of dea_maps, from below: each may import those before it, and none of its own rank.
RANKS = (
    {
        "nomenclature",
        "outcomes",
        "checks",
        "plausibility",
        "printable",
        "notices",
        "atomic",
        "netcdf_lock",
        "pieces",
        "programs",
        "program_text",
        "csv_tables",
        "toml_tables",
    },
    {"materials"},
    {"sweeps"},
    {"limits", "general"},
    {"runs"},
    {"files"},
    {"charts"},
    {"explorer"},
    {"cli"},
    {"__main__"},
)
# The same within the kernels: what is common, then the rooms, then what is made of them.
KERNEL_RANKS = (
    {"_jit", "_cache", "model", "elementary", "lane_state", "programs"},
    {"checksum"},
    {"sweep"},
    {"forms"},
    {"runge_kutta", "hold"},
    {"rising"},
    {"dead_load"},
    {"loading", "solvers"},
    {"build"},
    {"product"},
)


def modules(folder):
    """Return the files of a package by the parts of their names within it."""
    return {path.relative_to(folder).with_suffix("").parts: path for path in folder.rglob("*.py")}


def imported(path, package):
    """Return the full names of the modules that a file imports, wherever in it; ``package`` is where it lies."""
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


def rooms_of(folder, package):
    """Return, by room, the rooms that its files import."""
    rooms = {}
    for parts, path in modules(folder).items():
        if parts == ("__init__",):
            continue
        names = imported(path, ".".join((package, *parts[:-1])))
        inside = {name.removeprefix(f"{package}.").split(".")[0] for name in names if name.startswith(f"{package}.")}
        own = {child.stem for child in folder.iterdir() if child.suffix == ".py" or (child / "__init__.py").exists()}
        rooms.setdefault(parts[0], set()).update((inside & own) - {parts[0], "__init__"})
    return rooms


@pytest.mark.parametrize(
    ("folder", "package", "ranks"),
    [(OUTER, "dea_maps", RANKS), (INNER, "dea_maps.kernels", KERNEL_RANKS)],
    ids=["dea_maps", "kernels"],
)
def test_imports_run_one_way(folder, package, ranks):
    rank = {room: place for place, rooms in enumerate(ranks) for room in rooms}
    found = rooms_of(folder, package)
    assert set(found) == set(rank)
    upward = {
        f"{room} imports {other}"
        for room, others in found.items()
        for other in others
        if rank[other] > rank[room] or (rank[other] == rank[room] > 0)
    }
    assert not upward


def test_kernels_know_nothing_of_the_package_around_them():
    for parts, path in modules(INNER).items():
        names = imported(path, ".".join(("dea_maps", "kernels", *parts[:-1])))
        outer = {name for name in names if name.split(".")[0] == "dea_maps" and not name.startswith("dea_maps.kernels")}
        assert not outer, f"{path.name} imports {outer}"


def test_one_module_is_the_interface_to_the_kernels():
    through = {
        "/".join(parts)
        for parts, path in modules(OUTER).items()
        if any(name.startswith("dea_maps.kernels") for name in imported(path, ".".join(("dea_maps", *parts[:-1]))))
    }
    assert through == {"sweeps/solve"}


def test_every_folder_is_packed():
    packed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    there = {".".join(("dea_maps", *parts[:-1])) for parts in modules(OUTER)}
    there |= {".".join(("dea_maps", "kernels", *parts[:-1])) for parts in modules(INNER)}
    assert sorted(packed) == sorted(there)


def modules_after(statement):
    code = f"import sys; {statement}; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(run.stdout.splitlines()[-1].split())


@pytest.mark.parametrize(
    "statement",
    ["import dea_maps", "from dea_maps.cli.main import main; main(['--help'])", "from dea_maps import Step"],
)
def test_nothing_heavy_is_imported_early(statement):
    loaded = modules_after(statement)
    assert "dea_maps" in loaded
    assert not loaded & set(HEAVY)


def test_every_public_name_is_there():
    for name in dm.__all__:
        assert name in dir(dm)
        assert getattr(dm, name) is not None
    with pytest.raises(AttributeError, match="module 'dea_maps' has no attribute 'sweeper'"):
        dm.sweeper  # noqa: B018


def test_help_lists_every_public_name():
    listed = re.findall(r"\w+", dm.__doc__.split("::\n")[1].split("Examples")[0])
    assert set(dm.__all__) - set(listed) == {"__version__"}


def test_functions_are_not_hidden_by_modules():
    code = (
        "import dea_maps.runs.maps, dea_maps.limits.breakdown, dea_maps.explorer.export, dea_maps as dm;"
        "assert all(callable(getattr(dm, name)) for name in dm.__all__ if name[0].islower() and name != 'charts')"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
