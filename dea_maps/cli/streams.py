"""The standard streams of the command line: closed, broken or of few characters, and the signal that ends a process."""

import io
import os
import signal
import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TextIO

from ..printable import printable


class OutputError(Exception):
    """Standard output cannot be written; the cause is the error of the system."""


def prepare() -> None:
    """Let the null device stand for streams that are closed, and escape characters that a stream cannot show."""
    for number in range(3):  # else the next file that is opened, a map perhaps, would be taken for a stream
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115 -- open as long as the process
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def say(text: str, end: str = "\n") -> None:
    """Print on standard output, at once; nothing in the text acts on the terminal.

    Raises
    ------
    OutputError
        If that is not possible.
    """
    try:
        print("\n".join(map(printable, text.split("\n"))), end=end, flush=True)
    except OSError as error:
        _discard(sys.stdout)
        raise OutputError from error


def complain(text: str) -> None:
    """Print one line on standard error; where nobody can read it, there is no one else to tell."""
    try:
        print(printable(" ".join(text.split())), file=sys.stderr, flush=True)
    except OSError:
        _discard(sys.stderr)


def settle() -> None:
    """Write what still waits in the streams, which Python would do later, with an exit status of its own.

    Raises
    ------
    OutputError
        If that is not possible on standard output.
    """
    try:
        sys.stderr.flush()
    except OSError:
        _discard(sys.stderr)
    say("", end="")


def _discard(stream: TextIO) -> None:
    """Let what still waits in a stream go nowhere."""
    with suppress(OSError):
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, stream.fileno())
        os.close(null)


@contextmanager
def warnings_as_lines(prefix: str) -> Iterator[None]:
    """Print every warning to the user once, as one line, above a progress bar if there is one."""
    said: set[str] = set()

    def show(message: Warning | str, *_: object, **__: object) -> None:
        from tqdm import tqdm

        if str(message) in said:
            return
        said.add(str(message))

        with tqdm.external_write_mode(file=sys.stderr):
            complain(f"{prefix} {message}")

    with warnings.catch_warnings():
        warnings.simplefilter("always", UserWarning)
        warnings.showwarning = show
        yield


@contextmanager
def terminable() -> Iterator[list[int]]:
    """Take SIGTERM for Ctrl-C, so that what is open is closed; yields what was received."""
    received: list[int] = []

    def stop(number: int, _: FrameType | None) -> None:
        received.append(number)
        raise KeyboardInterrupt

    ours = threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    if ours:
        signal.signal(signal.SIGTERM, stop)
    try:
        yield received
    finally:
        if ours:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
