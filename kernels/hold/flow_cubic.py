"""The root z = u r of z**3 + h z = 1: the square of internal over total stretch at a rate of flow, (26)."""

from .._jit import device


@device
def flow_root(h):
    """Root z of z**3 + h z = 1 for 0 <= h <= 1.2: a polynomial, error 3e-8, then Newton's method once."""
    z = 0.9999999736083967 + h * (
        -0.33333051649367645
        + h
        * (
            -4.9443331870961736e-05
            + h
            * (
                0.012676699321454703
                + h
                * (
                    0.0030295499225060957
                    + h * (0.0019106457627000863 + h * (-0.0023985218388849483 + h * 0.0004894012574153466))
                )
            )
        )
    )
    square = z * z
    return (2.0 * square * z + 1.0) / (3.0 * square + h)
