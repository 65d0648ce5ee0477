"""The only place with Numba options, each with its reason, and the fingerprint of the kernel sources."""

import gc
import hashlib
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.extending import register_jitable

from ._cache import MachineCode

F = TypeVar("F", bound=Callable[..., Any])

# No signed zeros is all of LLVM's fast-math that is safe here: "nnan" and "ninf" break isnan and isinf, "reassoc" and
# "arcp" the compensated products in model.py, and "contract", into fused multiply-adds, gives other bits in a block of
# another width, or on another processor, for a tenth of the time.
FASTMATH = {"nsz"}


def _fingerprint() -> str:
    """Hash of every kernel source file, so that no cached machine code outlives the source it came from."""
    digest = hashlib.sha256()
    folder = Path(__file__).parent
    for name in sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*.py")):
        source = (folder / name).read_bytes()
        digest.update(f"{name}\0{len(source)}\0".encode() + source)
    return digest.hexdigest()[:16]


FINGERPRINT = _fingerprint()


def device(function: F) -> F:
    """Mark a plain function as callable from compiled code, always inlined into its caller.

    The function stays plain Python: only the outermost sweep is compiled and cached, because a dispatcher in a
    closure would keep the on-disk cache from ever being hit.
    """
    # forceinline: loops over lanes vectorise only when no call is left in them.
    # No wrappers: Python never calls it, and they take a tenth of the time of compiling.
    # error_model="numpy": a division by zero gives inf instead of raising; the check would be a branch in every loop.
    marked: F = register_jitable(
        forceinline=True, error_model="numpy", fastmath=FASTMATH, no_cpython_wrapper=True, no_cfunc_wrapper=True
    )(function)
    return marked


@contextmanager
def _no_garbage_collection() -> Iterator[None]:
    """Leave out what takes a tenth of the time of compiling: Numba makes many objects, and few of them are garbage."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


class Kernel:
    """An outermost kernel, compiled or loaded from disk at its first call; plain Python with the JIT off.

    Parameters
    ----------
    function : callable
        The kernel as plain Python.
    signature : str
        The types of its arguments, with commas between or after. One signature alone: Numba would compile again for
        every layout of the arrays.

    Attributes
    ----------
    py_func : callable
        `function`.
    """

    def __init__(self, function: Callable[..., Any], signature: str) -> None:
        self.py_func = function
        self._signature = signature
        self._lock = threading.Lock()
        # nogil: Python threads run parts of a sweep side by side, without Numba's threading layers and their limits
        # (one caller at a time, no fork), and the interpreter sees Ctrl-C between parts.
        self._machine = numba.njit(nogil=True, error_model="numpy", fastmath=FASTMATH)(function)
        self._ready = self._machine is function  # the JIT is off
        if not self._ready:
            self._machine._cache = MachineCode(function, FINGERPRINT)

    def __call__(self, *arguments: Any) -> Any:
        """Run it."""
        self.prepare()
        return self._machine(*arguments)

    def prepare(self) -> None:
        """Compile it, or load it from disk, unless that is done."""
        if self._ready:
            return
        with self._lock:
            if not self._ready:
                cache = self._machine._cache
                with cache.one_at_a_time(self._signature, self._machine.targetctx), _no_garbage_collection():
                    self._machine.compile(self._signature)
                self._machine.disable_compile()
                self._ready = True

    def needs_compiling(self) -> bool:
        """Return whether its machine code is neither in this process nor on disk."""
        return not (self._ready or self._machine._cache.holds(self._signature, self._machine.targetctx))
