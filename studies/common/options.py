"""The command line that the studies share: how much to compute, and where the figures go."""

import argparse
from pathlib import Path


def study_parser(run: str, description: str | None, quick: str) -> argparse.ArgumentParser:
    """Return a parser with ``--quick`` and ``--output``, whose folder is made as the arguments are parsed.

    Parameters
    ----------
    run : str
        The ``__file__`` of the study's ``run.py``. Without ``--output`` its files go to ``out/<study>``,
        which git ignores: what is tracked beside ``run.py`` changes only on request.
    description : str or None
        The study's ``__doc__``.
    quick : str
        What ``--quick`` leaves out.
    """
    study = Path(run).resolve().parent
    output = study.parents[1] / "out" / study.name
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help=quick)
    parser.add_argument(
        "--output", type=_made, default=str(output), metavar="FOLDER", help=f"default: out/{study.name} in the checkout"
    )
    return parser


def _made(name: str) -> Path:
    """Return a folder, made if need be."""
    folder = Path(name)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise argparse.ArgumentTypeError(f"cannot make the folder {folder}: {error.strerror}") from None
    return folder
