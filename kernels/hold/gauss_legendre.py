"""The ladder of rules of Gauss and Legendre that the quadrature climbs until one is accurate enough."""

import numpy as np

# The ladder of rules: number of nodes on each rung, and the rtol below which to begin on the next one.
LADDER = (5, 6, 8, 10, 12, 16, 20, 28, 40, 64)
EXPECTED = (1e-4, 1e-5, 3e-8, 1e-9, 1e-11)
RUNGS = len(LADDER)
DONE = RUNGS  # instead of a rung: as accurate as asked


def gauss_legendre(nodes: int) -> np.ndarray:
    """Nodes, weights, and the weights that give the Legendre coefficients of degrees 1, nodes - 2 and nodes - 1.

    Returns
    -------
    (5, nodes) ndarray
    """
    x, weights = np.polynomial.legendre.leggauss(nodes)
    basis = np.polynomial.legendre.Legendre.basis
    tails = [weights * basis(degree)(x) * (degree + 0.5) for degree in (1, nodes - 2, nodes - 1)]
    return np.array([x, weights, *tails])


NODES = np.hstack([gauss_legendre(nodes) for nodes in LADDER])
OFFSETS = (0, *(int(end) for end in np.cumsum(LADDER)))
