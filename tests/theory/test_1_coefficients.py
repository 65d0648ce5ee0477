"""Butcher tableaus: every order condition by rooted trees, the embedded estimates, and the check at import."""

import math
from dataclasses import replace
from functools import cache
from itertools import combinations_with_replacement

import numpy as np
import pytest
from scipy.integrate import DOP853 as SCIPY_DOP853
from scipy.integrate import RK45 as SCIPY_DOPRI5

from dea_maps.kernels.runge_kutta.tableaus import DOP853, DOPRI5, RK4, TABLEAUS, Tableau

# A rooted tree is the sorted tuple of the trees that hang on its root; () is the single node.
Tree = tuple
ROOTED_TREES = (1, 1, 2, 4, 9, 20, 48, 115, 286)  # how many of 1, 2, ... nodes there are (Cayley)
ROUNDING = 5e-14  # of a sum over the largest coefficients, which reach 43


@cache
def forests(nodes: int, largest: int) -> tuple[Tree, ...]:
    """All multisets of trees with this many nodes in all, none with more than ``largest``."""
    if nodes == 0:
        return ((),)
    if largest == 0:
        return ()
    found = []
    for count in range(nodes // largest + 1):
        for rest in forests(nodes - count * largest, largest - 1):
            found += [tuple(sorted(rest + several)) for several in repeated(largest, count)]
    return tuple(found)


def repeated(nodes: int, count: int) -> list[Tree]:
    """All multisets of ``count`` trees of one size."""
    return list(combinations_with_replacement(trees(nodes), count)) if count else [()]


def trees(nodes: int) -> tuple[Tree, ...]:
    """All rooted trees with this many nodes."""
    return forests(nodes - 1, nodes - 1)


def size(tree: Tree) -> int:
    return 1 + sum(map(size, tree))


def density(tree: Tree) -> int:
    """Product, over all nodes, of the number of nodes on and above them."""
    return size(tree) * math.prod(map(density, tree))


def matrix(tableau: Tableau) -> np.ndarray:
    """Coefficients of all stages and, last, of the derivative at the new state."""
    A = np.zeros((tableau.stages + 1, tableau.stages + 1))
    for stage, row in enumerate((*tableau.rows, tableau.weights), start=1):
        A[stage, : len(row)] = row
    return A


@cache
def derivative_weights(tableau: Tableau, tree: Tree) -> np.ndarray:
    """Elementary weights of the stages: one for a leaf, the coefficients applied for every branch."""
    A = matrix(tableau)
    return math.prod((A @ derivative_weights(tableau, branch) for branch in tree), start=np.ones(len(A)))


def violations(tableau: Tableau, weights: np.ndarray, order: int) -> list[float]:
    """How far every condition of one order is from being met."""
    return [abs(weights @ derivative_weights(tableau, tree) - 1 / density(tree)) for tree in trees(order)]


def order_of(tableau: Tableau, weights: np.ndarray) -> int:
    """The largest order up to which every condition is met."""
    order = 0
    while max(violations(tableau, weights, order + 1)) < ROUNDING:
        order += 1
    return order


def carried(tableau: Tableau) -> np.ndarray:
    return np.array((*tableau.weights, 0.0))


def test_rooted_trees_are_all_there():
    assert [len(set(trees(nodes))) for nodes in range(1, 10)] == list(ROOTED_TREES)
    bushy, tall = ((),) * 3, ((((),),),)
    assert (density(bushy), density(tall)) == (4, 24)  # b c**3 = 1/4, b A A c = 1/24


@pytest.mark.parametrize("tableau", TABLEAUS.values(), ids=TABLEAUS)
def test_every_order_condition_is_met_and_none_of_the_next_order_is_claimed(tableau):
    assert order_of(tableau, carried(tableau)) == tableau.order


@pytest.mark.parametrize(("tableau", "orders"), [(DOPRI5, [4]), (DOP853, [5, 3])], ids=["dopri5", "dop853"])
def test_embedded_solutions_have_the_orders_of_their_authors(tableau, orders):
    embedded = [carried(tableau) - np.array(errors) for errors in tableau.errors]
    assert [order_of(tableau, weights) for weights in embedded] == orders


def test_error_order_is_that_of_the_estimate():
    assert RK4.errors == ()
    assert DOPRI5.error_order == 4 + 1
    fifth, third = 5 + 1, 3 + 1  # estimates of orders 5 and 3 blend to a**2/b
    assert DOP853.error_order == 2 * fifth - third


@pytest.mark.parametrize(
    ("tableau", "reference", "errors"),
    [
        (DOPRI5, SCIPY_DOPRI5, [-SCIPY_DOPRI5.E]),
        (DOP853, SCIPY_DOP853, [SCIPY_DOP853.E5, SCIPY_DOP853.E3]),
    ],
    ids=["dopri5", "dop853"],
)
def test_coefficients_are_those_in_scipy(tableau, reference, errors):
    stages = tableau.stages
    np.testing.assert_allclose(matrix(tableau)[:stages, : stages - 1], reference.A[:stages, : stages - 1], rtol=1e-15)
    np.testing.assert_allclose(tableau.weights, reference.B, rtol=1e-15)
    np.testing.assert_allclose(tableau.errors, errors, rtol=1e-13, atol=1e-16)


def test_nodes_of_dop853_are_those_of_the_book():
    root = math.sqrt(6)
    first = (12 - 2 * root) / 135, (6 - root) / 45, (6 - root) / 30, (6 + root) / 30
    nodes = [0, *first, 1 / 3, 1 / 4, 4 / 13, 127 / 195, 3 / 5, 6 / 7, 1, 1]
    np.testing.assert_allclose(matrix(DOP853).sum(axis=1), nodes, rtol=1e-14, atol=1e-16)


def test_classical_method_is_kuttas():
    assert RK4.rows == ((0.5,), (0.0, 0.5), (0.0, 0.0, 1.0))
    assert RK4.weights == (1 / 6, 1 / 3, 1 / 3, 1 / 6)


def nudged(row: tuple[float, ...], place: int = 0) -> tuple[float, ...]:
    return tuple(value + 1e-9 * (index == place) for index, value in enumerate(row))


@pytest.mark.parametrize("tableau", TABLEAUS.values(), ids=TABLEAUS)
def test_broken_tableau_is_refused(tableau):
    assert replace(tableau) == tableau
    with pytest.raises(ValueError, match=rf"{tableau.name}: moment 0 of the weights is 1\.0{{6,}}"):
        replace(tableau, weights=nudged(tableau.weights))
    with pytest.raises(ValueError, match=f"{tableau.name}: moment 1 of the weights"):
        replace(tableau, rows=(*tableau.rows[:-1], nudged(tableau.rows[-1])))
    with pytest.raises(ValueError, match=f"{tableau.name}: moment"):
        replace(tableau, order=tableau.order + 1)
    with pytest.raises(ValueError, match=f"{tableau.name}: row i must have i \\+ 1 coefficients"):
        replace(tableau, rows=(*tableau.rows[:-1], (*tableau.rows[-1], 0.0)))
    with pytest.raises(ValueError, match=f"{tableau.name}: row i must have i \\+ 1 coefficients"):
        replace(tableau, rows=tableau.rows[:-1])


@pytest.mark.parametrize("tableau", [DOPRI5, DOP853], ids=["dopri5", "dop853"])
def test_broken_error_weights_are_refused(tableau):
    for broken in (nudged(tableau.errors[-1]), tableau.errors[-1][:-1]):
        with pytest.raises(ValueError, match=f"{tableau.name}: error weights must have one more entry and sum to zero"):
            replace(tableau, errors=(*tableau.errors[:-1], broken))
