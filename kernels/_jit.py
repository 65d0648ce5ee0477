"""The only place with Numba options, each with its reason, and the fingerprint of the kernel sources."""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.extending import register_jitable

F = TypeVar("F", bound=Callable[..., Any])

# No signed zeros is all of LLVM's fast-math that is safe here: "nnan" and "ninf" break isnan and isinf, "reassoc" and
# "arcp" the compensated products in model.py, and "contract", into fused multiply-adds, gives other bits in a block of
# another width, or on another processor, for a tenth of the time.
FASTMATH = {"nsz"}


def _fingerprint() -> str:
    """Hash of every kernel source file, so that no cached machine code outlives the source it came from."""
    digest = hashlib.sha256()
    folder = Path(__file__).parent
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.relative_to(folder).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


FINGERPRINT = _fingerprint()


def device(function: F) -> F:
    """Mark a plain function as callable from compiled code, always inlined into its caller.

    The function stays plain Python: only the outermost sweep is compiled and cached, because a dispatcher in a
    closure would keep the on-disk cache from ever being hit.
    """
    # forceinline: loops over lanes vectorise only when no call is left in them.
    # error_model="numpy": a division by zero gives inf instead of raising; the check would be a branch in every loop.
    marked: F = register_jitable(forceinline=True, error_model="numpy", fastmath=FASTMATH)(function)
    return marked


def compiled(function: F) -> F:
    """Compile an outermost kernel on first call; cached on disk where a folder for it can be written."""
    # nogil: Python threads run parts of a sweep side by side, without Numba's threading layers and their limits
    # (one caller at a time, no fork), and the interpreter sees Ctrl-C between parts.
    options = {"nogil": True, "error_model": "numpy", "fastmath": FASTMATH}
    try:
        return numba.njit(cache=True, **options)(function)  # type: ignore[no-any-return]
    except RuntimeError:  # neither beside the source nor in the user's cache folder can a file be written
        return numba.njit(**options)(function)  # type: ignore[no-any-return]
