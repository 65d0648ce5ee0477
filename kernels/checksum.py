"""The sums of Fletcher's checksum, for the chunks of files: in NumPy they take as long as compressing the chunk."""

from functools import cache

from ._jit import Kernel


@cache
def sums() -> Kernel:
    """Return the compiled ``sums(words)`` of (n,) uint16, at most 2**23: ``sum(w[i])`` and ``sum((n - i) w[i])``.

    J. G. Fletcher (1982), IEEE Transactions on Communications 30, 247-252; not yet modulo 65535.
    """

    def sums(words):
        total = places = 0
        for i in range(words.size):
            total += words[i]
            places += i * words[i]
        return total, words.size * total - places

    return Kernel(sums, "uint16[::1],")
