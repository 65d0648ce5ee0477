"""Rules of Gauss and Legendre of increasing order, tried one after the other until one is accurate enough."""

import numpy as np

# Number of nodes of each rule, about a factor 1.3 apart: a rule too high by one costs less than a rule tried in vain.
NODE_COUNTS = (5, 6, 8, 10, 12, 16, 20, 28, 40, 64)
# The rtol below which to begin with the next rule: measured, the rule that satisfies most cells (studies/tolerance). It
# bears on the cost alone: what is accepted is decided by the estimated error.
NEXT_RULE_BELOW = (1e-4, 1e-5, 3e-8, 1e-9, 1e-11)
RULES = len(NODE_COUNTS)
DONE = RULES  # instead of a rule: the time is as accurate as asked


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


NODES = np.hstack([gauss_legendre(nodes) for nodes in NODE_COUNTS])
OFFSETS = (0, *(int(end) for end in np.cumsum(NODE_COUNTS)))
