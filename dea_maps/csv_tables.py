"""CSV files: columns of numbers by the names in the first line."""

import csv

import numpy as np
import numpy.typing as npt

from .atomic import PathLike, read_text
from .checks import brief


def read_columns(path: PathLike, names: tuple[str, ...]) -> dict[str, npt.NDArray[np.float64]]:
    """Read columns of numbers; empty lines and lines that begin with # do not count.

    Parameters
    ----------
    path : str or path-like
        A CSV file whose first line names its columns.
    names : tuple of str
        Of the columns to read, in any order in the file; others are passed over.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is no such table, with its name and line.
    """
    text = read_text(path, "a table")
    try:
        return _columns(text, names)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _columns(text: str, names: tuple[str, ...]) -> dict[str, npt.NDArray[np.float64]]:
    """Return the columns of a table in CSV."""
    reader = csv.reader("\n" if line.startswith("#") else f"{line}\n" for line in text.split("\n"))
    rows = []
    try:
        for row in reader:
            if any(cell.strip() for cell in row):
                rows.append((reader.line_num, [cell.strip() for cell in row]))
    except csv.Error as error:
        raise ValueError(f"line {reader.line_num} cannot be read: {error}") from None
    heads = rows[0][1] if rows else []
    for name in names:
        if heads.count(name) != 1:
            raise ValueError(f"its first line must name the columns {', '.join(names)}, each once; got {brief(heads)}")
    columns: dict[str, list[float]] = {name: [] for name in names}
    for number, row in rows[1:]:
        for name, values in columns.items():
            place = heads.index(name)
            cell = row[place] if place < len(row) else ""
            try:
                if not cell.isascii() or "_" in cell:  # of which Python would make numbers
                    raise ValueError
                values.append(float(cell))
            except ValueError:
                raise ValueError(f"line {number} must have a number for {name}; got {brief(cell)}") from None
    return {name: np.array(values) for name, values in columns.items()}
