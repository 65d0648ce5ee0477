"""What a figure was measured on: the processor, the cores, the versions."""

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


def describe_machine(*packages: str) -> str:
    """Return the processor, the number of cores and the versions of Python and of packages, on two lines.

    Parameters
    ----------
    packages : str
        Names of distributions, as they are to be written; one that is absent is said to be.

    Examples
    --------
    >>> describe_machine("dea_maps").splitlines()[1].split(", ")[1].split()[0]
    'dea_maps'
    """
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    processor = models[0] if models else platform.processor() or platform.machine()
    versions = ", ".join(f"{name} {version_of(name)}" for name in packages)
    return f"machine: {processor}, {os.cpu_count()} cores\nversions: Python {platform.python_version()}, {versions}"


def version_of(package: str) -> str:
    """Return the version of a distribution, or that there is none.

    Examples
    --------
    >>> version_of("no such package")
    'not installed'
    """
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
