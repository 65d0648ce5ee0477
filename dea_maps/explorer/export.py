"""Pages to explore a map in a browser: one file each, which needs nothing else."""

from pathlib import Path

import xarray as xr

from ..atomic import PathLike, check_writable, replacing

SUFFIX = ".html"
"""How the name of a page ends."""


def explore(ds: xr.Dataset, path: PathLike) -> None:
    """Write a page to explore a map in a browser: a phase diagram, sliders, and the curves of chosen films.

    The page is one file that needs no network. It shows the values under the pointer, a slider for every parameter
    beyond two, and for a film that is chosen, by pointer or keyboard, its field and its stretch or area strain against
    time, and beside it those of a film kept before. Its address remembers what is shown. It stays below 10 MB: of a
    larger map it shows some values of each parameter, and says so.

    Parameters
    ----------
    ds : Dataset
        From `dea_maps.sweep` or a file of a sweep, over one or more parameters that vary, with the variables
        ``outcome`` and ``time_to_failure`` at least; in volts and seconds where it comes from `dea_maps.physical`.
    path : str or path-like
        The file to write or replace, ending in ``.html``.

    Raises
    ------
    TypeError, ValueError
        If there is no page for the data set, the suffix is another one, or Bokeh is not installed.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import dea_maps as dm, os, tempfile
    >>> ds = dm.sweep(dm.Step(), field=[0.9, 1.2, 1.5], modulus_ratio=[3.0, 4.0])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     explore(ds, os.path.join(folder, "page.html"))
    ...     os.listdir(folder)
    ['page.html']
    """
    check_page_path(path)
    save(draw(ds), path)


def check_page_path(path: PathLike) -> None:
    """Check that a page can be written to a file, before anything is computed for it.

    Parameters
    ----------
    path : str or path-like
        The file.

    Raises
    ------
    ValueError
        If its suffix is not `SUFFIX`.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> check_page_path("page.pdf")
    Traceback (most recent call last):
    ...
    ValueError: a page must be a file ending in .html; got page.pdf
    """
    if Path(path).suffix.lower() != SUFFIX:
        raise ValueError(f"a page must be a file ending in {SUFFIX}; got {path}")
    check_writable(path)


def draw(ds: xr.Dataset) -> str:
    """Return the page of a map, see `explore`.

    Parameters
    ----------
    ds : Dataset
        From a sweep.

    Returns
    -------
    str
        HTML.

    Raises
    ------
    TypeError, ValueError
        If there is no page for the data set, or Bokeh is not installed.

    Examples
    --------
    >>> import dea_maps as dm
    >>> draw(dm.sweep(dm.Step(), field=[0.9, 1.2, 1.5], modulus_ratio=[3.0, 4.0])).lstrip()[:15]
    '<!DOCTYPE html>'
    """
    try:
        from .page import page
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != "bokeh":
            raise
        raise ValueError("explore needs Bokeh, which comes with: pip install 'dea-maps[explore]'") from None
    from .cells import cells_of
    from .curves import curves_of

    cells = cells_of(ds)
    return page(cells, curves_of(cells), Path(ds.encoding.get("source", "")).name)


def save(page: str, path: PathLike) -> None:
    """Write a page to a file, replacing an old one only by the complete new one.

    Parameters
    ----------
    page : str
        From `draw`.
    path : str or path-like
        The file.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    with replacing(path) as temporary:
        temporary.write_text(page, encoding="utf-8")
