"""Checks in environments of their own: ``nox -l`` lists them, ``nox -s NAME`` runs one, ``nox`` the usual ones."""

import os
import shutil
import subprocess
from pathlib import Path

import nox

ROOT = Path(__file__).parent
PYTHONS = ("3.11", "3.12", "3.13")
# Tests that take the kernels apart; without machine code the others would take long and reach no line more.
KERNEL_TESTS = (
    *(f"tests/kernels/test_{name}.py" for name in (
        "area_strain", "elementary", "events", "model", "quadrature", "radau", "rising_event",
    )),
    "tests/sweeps/test_programs.py",
    "tests/sweeps/test_trajectories.py",
    "tests/theory/test_1_coefficients.py",
    "tests/theory/test_6_random_films.py",
)  # fmt: skip
TOO_LONG = "tests/theory/test_6_random_films.py::test_any_legal_input_has_its_outcome"

nox.options.sessions = ["lint", "format", "types", "docs", "tests"]
nox.options.error_on_missing_interpreters = False


def _found(version: str) -> bool:
    """Return whether there is such a Python that starts."""
    command = shutil.which(f"python{version}")
    return command is not None and subprocess.run([command, "-c", ""], capture_output=True, check=False).returncode == 0


if shutil.which("pyenv"):  # its commands for versions that are not selected do not start: select all that are wanted
    listed = subprocess.run(["pyenv", "versions", "--bare"], capture_output=True, text=True, check=False).stdout.split()
    wanted = [version for version in listed if version.rpartition(".")[0] in PYTHONS]
    os.environ["PYENV_VERSION"] = ":".join(wanted)

FOUND = [version for version in PYTHONS if _found(version)]


@nox.session(python=FOUND)
def tests(session: nox.Session) -> None:
    """Run all tests on every supported Python that the machine has."""
    session.install("-e", ".[test,docs]")
    session.run("pytest", *session.posargs)


@nox.session(python=FOUND[:1])
def lowest(session: nox.Session) -> None:
    """Run all tests on the lowest versions of the dependencies that pyproject.toml allows."""
    project = nox.project.load_toml("pyproject.toml")["project"]
    extras = project["optional-dependencies"]
    required = [*project["dependencies"], *extras["distributed"], *extras["explore"]]
    required.append("pyparsing<3.3")  # 3.3 warns the user of names that old releases of Matplotlib call
    pinned = Path(session.create_tmp(), "lowest.txt")
    pinned.write_text("".join(f"{requirement.replace('>=', '==')}\n" for requirement in required))
    session.install("-e", ".[test]", "-c", str(pinned))
    session.run("pytest", "-W", "default", *session.posargs)  # old releases warn, by no fault of the tests


@nox.session
def lint(session: nox.Session) -> None:
    """Run the linter."""
    session.install("ruff>=0.8")
    session.run("ruff", "check", ".")


@nox.session
def format(session: nox.Session) -> None:
    """Check that the code is formatted; ``nox -s format -- --fix`` formats it."""
    session.install("ruff>=0.8")
    session.run("ruff", "format", *([] if "--fix" in session.posargs else ["--check"]), ".")


@nox.session
def types(session: nox.Session) -> None:
    """Check the types on an installed copy: in the checkout the kernels lie outside the package."""
    session.install(".[distributed,explore]", "mypy>=1.13")
    session.chdir(session.create_tmp())
    session.run("mypy", "--config-file", str(ROOT / "pyproject.toml"), "--cache-dir", "mypy", "-p", "dea_maps")


@nox.session
def docs(session: nox.Session) -> None:
    """Build the documentation into out/docs, warnings as errors."""
    session.install("-e", ".[docs]")
    session.run("sphinx-build", "-W", "--keep-going", "-b", "html", "docs", "out/docs", *session.posargs)


@nox.session
def coverage(session: nox.Session) -> None:
    """Count the lines of kernels/ that the tests reach, without machine code: at least 95 %."""
    session.install("-e", ".[test]", "pytest-cov>=6")
    # A division by zero, which gives inf in machine code by design, warns.
    options = ["-p", "no:cacheprovider", "-W", "ignore::RuntimeWarning", f"--deselect={TOO_LONG}"]
    counted = ["--cov", "--cov-report=term-missing:skip-covered", "--cov-fail-under=95"]
    env = {"NUMBA_DISABLE_JIT": "1", "COVERAGE_FILE": str(Path(session.create_tmp(), "coverage"))}
    session.run("pytest", *options, *counted, *session.posargs, *KERNEL_TESTS, env=env)
