"""What can become of a film, what ends its loading first, and whether a question has an answer: the flags of files.

The values are those of the variables ``outcome``, ``first_limit``, ``limit`` and ``reason``, in one byte each; the
words are those of ``flag_meanings``.
"""

from enum import IntEnum
from typing import Any


class Outcome(IntEnum):
    """The values of ``outcome``."""

    SURVIVES = 0
    FAILS_LATER = 1
    FAILS_AT_ONCE = 2
    UNRESOLVED = 3


class Limit(IntEnum):
    """The values of ``first_limit`` and ``limit``, beside an electrical breakdown."""

    NONE = 0
    INSTABILITY = 1
    BREAKDOWN = 2
    UNRESOLVED = 3


class GeneralLimit(IntEnum):
    """The values of ``first_limit`` of the general model, whose films may lose their tension."""

    NONE = 0
    INSTABILITY = 1
    TENSION_LOSS = 2
    UNRESOLVED = 3


class Reason(IntEnum):
    """The values of ``reason`` of an inverse question."""

    ANSWERED = 0
    ALWAYS = 1
    NEVER = 2
    BEYOND_RATES = 3
    UNRESOLVED = 4
    BREAKS_DOWN = 5


def words_of(flags: type[IntEnum]) -> tuple[str, ...]:
    """Return the words for the values 0, 1, 2, ... of a variable of flags.

    Examples
    --------
    >>> words_of(Outcome)
    ('survives', 'fails_later', 'fails_at_once', 'unresolved')
    """
    return tuple(flag.name.lower() for flag in flags)


def flag_attributes(flags: type[IntEnum]) -> dict[str, Any]:
    """Return the CF attributes of a variable of flags.

    Examples
    --------
    >>> flag_attributes(Limit)["flag_meanings"]
    'none instability breakdown unresolved'
    """
    import numpy as np  # the command line reads the words before any library is loaded

    return {"flag_values": np.arange(len(flags), dtype=np.int8), "flag_meanings": " ".join(words_of(flags))}
