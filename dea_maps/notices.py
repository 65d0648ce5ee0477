"""Notices: what takes time is said on standard error before it begins, to whoever asked for progress."""

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_LOG = logging.getLogger("dea_maps")


def notice(words: str) -> None:
    """Say something, where `shown_notices` is in force or the caller's logging shows it."""
    _LOG.info(words)


class _OnStandardError(logging.Handler):
    """Prints lines, above a progress bar if there is one."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print it."""
        from tqdm import tqdm

        tqdm.write(record.getMessage(), file=sys.stderr)


_HANDLER = _OnStandardError()


@contextmanager
def shown_notices(wanted: bool = True) -> Iterator[None]:
    """Print notices on standard error, once though one of these stand in another.

    Parameters
    ----------
    wanted : bool
        Whether to.

    Examples
    --------
    >>> import contextlib
    >>> with contextlib.redirect_stderr(sys.stdout), shown_notices():
    ...     notice("compiling")
    compiling
    """
    if not wanted or _HANDLER in _LOG.handlers:
        yield
        return
    level = _LOG.level
    _LOG.addHandler(_HANDLER)
    _LOG.setLevel(logging.INFO)
    try:
        yield
    finally:
        _LOG.setLevel(level)
        _LOG.removeHandler(_HANDLER)
