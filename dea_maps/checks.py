"""What error messages and checks of arguments share."""

import reprlib


def brief(value: object) -> str:
    """Return a short representation of anything, on one line, for an error message.

    Examples
    --------
    >>> brief(list(range(1000)))
    '[0, 1, 2, 3, 4, 5, ...]'
    """
    return " ".join(reprlib.repr(value).split())
