"""Files of any kind: written beside and moved into place whole, and read with errors that name them."""

import os
import secrets
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

PathLike = str | os.PathLike[str]


def check_writable(path: PathLike) -> Path:
    """Check that a file can be written, before anything is computed for it.

    Parameters
    ----------
    path : str or path-like
        The file; its folder must exist. A symbolic link is followed.

    Returns
    -------
    Path
        The file itself, behind all links.

    Raises
    ------
    OSError
        If the folder is absent or no folder, if no file can be made in it, or if `path` is a folder, a device or
        anything else that is no file, a loop of links, or a file that may not be written.

    Examples
    --------
    >>> check_writable("nowhere/map.nc")
    Traceback (most recent call last):
    ...
    FileNotFoundError: cannot write nowhere/map.nc: there is no folder nowhere
    """
    target = Path(os.path.realpath(path)) if os.path.islink(path) else Path(path)
    folder = target.parent
    refused = f"cannot write {os.fspath(path)}"
    if os.path.isdir(path):
        raise IsADirectoryError(f"{refused}: it is a folder")
    try:
        mode = os.stat(path).st_mode
    except FileNotFoundError:
        if not folder.exists():
            raise FileNotFoundError(f"{refused}: there is no folder {folder}") from None
    except NotADirectoryError:
        raise NotADirectoryError(f"{refused}: {folder} is not a folder") from None
    except OSError as error:  # a loop of links, or a folder that may not be entered
        raise type(error)(f"{refused}: {error.strerror}") from None
    else:
        if not stat.S_ISREG(mode):
            raise OSError(f"{refused}: it is a device, a pipe or a socket, not a file")
        # Renaming asks for the rights of the folder alone, and an administrator has every right.
        if not (mode & 0o222 and os.access(target, os.W_OK)):
            raise PermissionError(f"{refused}: it is read-only")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise type(error)(f"{refused}: {error.strerror} in the folder {folder}") from None
    return Path(os.path.realpath(target))


def move_into_place(temporary: Path, target: Path) -> None:
    """Let a complete file take the place of another, with its permissions, once the bytes are on the disk."""
    with suppress(FileNotFoundError):
        temporary.chmod(stat.S_IMODE(target.stat().st_mode))
    sync(temporary)
    os.replace(temporary, target)
    sync(target.parent)


@contextmanager
def naming(path: PathLike) -> Iterator[None]:
    """Name the file in what the system says on writing it, as where the disk is full."""
    try:
        yield
    except OSError as error:
        if error.errno is None or error.strerror is None:  # names it already
            raise
        raise type(error)(f"cannot write {os.fspath(path)}: {error.strerror}") from error


def existing(path: PathLike) -> Path:
    """Return a file that is to be read, once it is known to be there and no folder.

    Raises
    ------
    OSError
        If it is not.

    Examples
    --------
    >>> existing("nowhere.toml")
    Traceback (most recent call last):
    ...
    FileNotFoundError: there is no file nowhere.toml
    """
    file = Path(path)
    if not file.exists():
        raise FileNotFoundError(f"there is no file {file}")
    if file.is_dir():
        raise IsADirectoryError(f"{file} is not a file")
    return file


def read_text(path: PathLike, kind: str) -> str:
    """Return the text of a file in UTF-8, without the byte-order mark that some editors put before it.

    Parameters
    ----------
    path : str or path-like
        The file.
    kind : str
        What it should be, for the message if it is not even text.

    Raises
    ------
    OSError
        If it is absent, a folder or cannot be read.
    ValueError
        If it is not in UTF-8.
    """
    file = existing(path)
    try:
        return file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{file} is not {kind}: it is not text in UTF-8") from None
    except OSError as error:
        raise type(error)(f"cannot read {file}: {error.strerror}") from None


@contextmanager
def replacing(path: PathLike) -> Iterator[Path]:
    """Hand out a temporary file in the same folder that takes the place of `path` if all goes well.

    The bytes are on the disk before the name changes, so that `path` is only ever absent, the old file or the
    complete new one, with the permissions of the old. Whatever goes wrong, an interrupt too, the temporary file is
    removed and the old file stays.

    Parameters
    ----------
    path : str or path-like
        The file to replace; a symbolic link is followed.

    Yields
    ------
    Path
        Where to write, with the same suffix.

    Raises
    ------
    OSError
        As `check_writable`, or if the file cannot be moved.

    Examples
    --------
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with replacing(Path(folder, "note.txt")) as temporary:
    ...         _ = temporary.write_text("whole")
    ...     Path(folder, "note.txt").read_text()
    'whole'
    """
    target = check_writable(path)
    temporary = target.with_name(f".{target.stem}.{secrets.token_hex(4)}{target.suffix}")
    try:
        with naming(target):
            yield temporary
            move_into_place(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)


def sync(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    windows = os.name == "nt"
    if windows and path.is_dir():  # there it cannot be opened, and the system keeps its names by a journal
        return
    descriptor = os.open(path, os.O_RDWR if windows else os.O_RDONLY)  # Windows asks for the right to write
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
