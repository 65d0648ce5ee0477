"""The tables as files: writing with a hash, reading with verification."""

import csv
import hashlib
import io
import os
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).resolve().parent
PROGRAMS = ("step", "ramp", "ramp_hold")
INPUTS = ("modulus_ratio", "field", "rate")
RESULTS = (
    "time_to_failure",
    "critical_stretch",
    "critical_internal_stretch",
    "critical_field",
    "final_stretch",
)
CONDITIONS = ("condition_time", "condition_stretch", "condition_internal_stretch", "condition_field")
COLUMNS = (*INPUTS, "outcome", *RESULTS, "agreed_digits", *CONDITIONS, "regime")
HASH_LINE = "# sha256 of all that follows this line: "


def write(program: str, notes: list[str], rows: list[dict[str, str]]) -> None:
    """Write a table in one stroke: notes, hash, column names, rows."""
    body = io.StringIO()
    writer = csv.DictWriter(body, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_hashed(FOLDER / f"{program}.csv", notes, body.getvalue())


def write_hashed(path: Path, notes: list[str], text: str) -> None:
    """Write column names and rows in one stroke, below notes and their hash."""
    digest = hashlib.sha256(text.encode()).hexdigest()
    part = path.with_suffix(".part")
    head = "".join(f"# {note}\n" for note in notes)
    part.write_text(f"{head}{HASH_LINE}{digest}\n{text}", encoding="utf-8")
    os.replace(part, path)


def read_hashed(path: Path) -> list[dict[str, str]]:
    """Return the rows of a table as text; ValueError if they do not match the hash."""
    _, _, rest = path.read_bytes().decode().partition(HASH_LINE)
    digest, _, body = rest.partition("\n")
    if hashlib.sha256(body.encode()).hexdigest() != digest:
        raise ValueError(f"{path.name} does not match its hash: generate it again, never edit it")
    return list(csv.DictReader(io.StringIO(body)))


def read(program: str) -> list[dict[str, str]]:
    """Return the rows of a table as text; ValueError if they do not match the hash.

    Parameters
    ----------
    program : {"step", "ramp", "ramp_hold"}
        The loading program.

    Returns
    -------
    list of dict
        Column name to text, empty where the row has no such number.
    """
    return read_hashed(FOLDER / f"{program}.csv")


def load(program: str) -> dict[str, np.ndarray]:
    """Return a table as arrays.

    Parameters
    ----------
    program : {"step", "ramp", "ramp_hold"}
        The loading program.

    Returns
    -------
    dict of numpy.ndarray
        By column: the inputs that the program takes and the results as float64 (NaN where a row has no such
        number), ``outcome`` as int8 (0 survives, 1 fails_later, 2 fails_at_once), ``condition_*`` as float64:
        the relative change of a result per relative change of an input, the largest over the inputs
        (``condition_stretch`` speaks of critical_stretch, or of final_stretch where the film survives),
        ``regime`` as text.
    """
    rows = read(program)
    columns: dict[str, np.ndarray] = {}
    for name in COLUMNS:
        texts = [row[name] for row in rows]
        if name in INPUTS and not any(texts):
            continue
        if name == "regime":
            columns[name] = np.array(texts)
        elif name == "outcome":
            columns[name] = np.array(texts, dtype=np.int8)
        else:
            columns[name] = np.array([float(text) if text else np.nan for text in texts])
    return columns
