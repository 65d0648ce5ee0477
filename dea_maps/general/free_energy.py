"""The general model: free energy, equations of state, flow and Hessian at unequal stretches.

Zhao, Koh and Suo (2011), sections 2 to 4; equation numbers refer to the paper. Everything is dimensionless, normalised:
stresses and energy densities by ``mu_R``, time by ``tau``, the nominal electric displacement by ``sqrt(eps mu_R)`` and
the nominal field by ``sqrt(mu_R/eps)``; `CRITICAL_FIELD` is ``Ec``, the relaxed critical field, so normalised;
``p = mu_U/mu_R - 1``.
All functions but `scaled_hessian` take floats or arrays of one shape.
"""

from math import sqrt
from typing import Generic, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

CRITICAL_FIELD = (0.75 * 4.0 ** (-1.0 / 3.0)) ** 0.5
"""The relaxed critical field ``Ec`` over ``sqrt(mu_R/eps)``, 0.6874: the paper prints 0.69."""

Real = TypeVar("Real", float, npt.NDArray[np.float64])


class State(NamedTuple, Generic[Real]):
    """Independent variables of the free energy, (3) and (17).

    Attributes
    ----------
    stretch_1, stretch_2 : float or ndarray
        Stretches of the film in its plane.
    electric_displacement : float or ndarray
        Nominal electric displacement over ``sqrt(eps mu_R)``.
    internal_stretch_1, internal_stretch_2 : float or ndarray
        Stretches of the dashpot.
    """

    stretch_1: Real
    stretch_2: Real
    electric_displacement: Real
    internal_stretch_1: Real
    internal_stretch_2: Real


class Hessian(NamedTuple, Generic[Real]):
    """Entries of the symmetric matrix (13): 1 and 2 for the stretches, 3 for the electric displacement."""

    h11: Real
    h22: Real
    h33: Real
    h12: Real
    h13: Real
    h23: Real


class Coupling(NamedTuple, Generic[Real]):
    """Derivatives of the two stresses by the two internal stretches, the last term of (12)."""

    c11: Real
    c12: Real
    c21: Real
    c22: Real


class Scaled(NamedTuple):
    """The Hessian scaled to a unit diagonal, over what is not prescribed, and its determinant."""

    roots: tuple[float, float, float]
    c12: float
    c13: float
    c23: float
    phi: float


def free_energy(state: State[Real], p: float) -> Real:
    """Return the density of the Helmholtz free energy over ``mu_R``, (17).

    Parameters
    ----------
    state : State
        Floats or arrays of one shape.
    p : float
        Modulus ratio less one.

    Examples
    --------
    >>> free_energy(State(1.0, 1.0, 0.5, 1.0, 1.0), p=3.0)
    0.125
    """
    l1, l2, d, x1, x2 = state
    v = 1.0 / (l1 * l1 * l2 * l2)
    e1, e2 = l1 / x1, l2 / x2
    network = l1 * l1 + l2 * l2 + v - 3.0
    viscous = e1 * e1 + e2 * e2 + v * (x1 * x1 * x2 * x2) - 3.0
    return 0.5 * (network + p * viscous + d * d * v)


def equations_of_state(state: State[Real], p: float) -> tuple[Real, Real, Real]:
    """Return the loads in equilibrium with a state: stresses ``s1``, ``s2`` (18), (19) and field ``E`` (20).

    Parameters
    ----------
    state : State
        Floats or arrays of one shape.
    p : float
        Modulus ratio less one.

    Examples
    --------
    >>> equations_of_state(State(2.0, 2.0, 0.0, 1.0, 1.0), p=3.0)
    (7.875, 7.875, 0.0)
    """
    l1, l2, d, x1, x2 = state
    v = 1.0 / (l1 * l1 * l2 * l2)
    thickness = v * (1.0 + p * (x1 * x1 * x2 * x2) + d * d)
    s1 = l1 * (1.0 + p / (x1 * x1)) - thickness / l1
    s2 = l2 * (1.0 + p / (x2 * x2)) - thickness / l2
    return s1, s2, v * d


def flow(state: State[Real]) -> tuple[Real, Real]:
    """Return the rates of the two internal stretches per relaxation time, (21) and (22).

    Parameters
    ----------
    state : State
        Floats or arrays of one shape.

    Examples
    --------
    >>> flow(State(2.0, 1.0, 0.0, 1.0, 1.0))
    (3.75, 0.75)
    """
    l1, l2, _, x1, x2 = state
    v = 1.0 / (l1 * l1 * l2 * l2)
    return l1 * l1 / (x1 * x1 * x1) - v * x1 * x2 * x2, l2 * l2 / (x2 * x2 * x2) - v * x2 * x1 * x1


def hessian(state: State[Real], p: float) -> Hessian[Real]:
    """Return the second derivatives of the free energy by the stretches and the electric displacement, (13).

    Parameters
    ----------
    state : State
        Floats or arrays of one shape.
    p : float
        Modulus ratio less one.

    Examples
    --------
    >>> hessian(State(1.0, 1.0, 0.0, 1.0, 1.0), p=0.0)
    Hessian(h11=4.0, h22=4.0, h33=1.0, h12=2.0, h13=-0.0, h23=-0.0)
    """
    l1, l2, d, x1, x2 = state
    v = 1.0 / (l1 * l1 * l2 * l2)
    thickness = v * (1.0 + p * (x1 * x1 * x2 * x2) + d * d)
    return Hessian(
        h11=1.0 + p / (x1 * x1) + 3.0 * thickness / (l1 * l1),
        h22=1.0 + p / (x2 * x2) + 3.0 * thickness / (l2 * l2),
        h33=v,
        h12=2.0 * thickness / (l1 * l2),
        h13=-2.0 * v * d / l1,
        h23=-2.0 * v * d / l2,
    )


def coupling(state: State[Real], p: float) -> Coupling[Real]:
    """Return the second derivatives of the free energy by a stretch and an internal stretch, in (12).

    Parameters
    ----------
    state : State
        Floats or arrays of one shape.
    p : float
        Modulus ratio less one.

    Examples
    --------
    >>> coupling(State(1.0, 1.0, 0.0, 1.0, 1.0), p=1.0)
    Coupling(c11=-4.0, c12=-2.0, c21=-2.0, c22=-4.0)
    """
    l1, l2, _, x1, x2 = state
    twice = 2.0 * p / (l1 * l1 * l2 * l2)
    by_1, by_2 = twice * x1 * x2 * x2, twice * x2 * x1 * x1
    return Coupling(
        c11=-2.0 * p * l1 / (x1 * x1 * x1) - by_1 / l1,
        c12=-by_2 / l1,
        c21=-by_1 / l2,
        c22=-2.0 * p * l2 / (x2 * x2 * x2) - by_2 / l2,
    )


def det_hessian(state: State[Real], p: float) -> Real:
    """Return the determinant of (13), in ``mu_R**2/eps``: zero at the instability, (14).

    Parameters
    ----------
    state : State
        Floats or arrays of one shape.
    p : float
        Modulus ratio less one.

    Examples
    --------
    >>> det_hessian(State(1.0, 1.0, 0.0, 1.0, 1.0), p=0.0)
    12.0
    """
    h11, h22, h33, h12, h13, h23 = hessian(state, p)
    return h11 * (h22 * h33 - h23 * h23) - h12 * (h12 * h33 - h23 * h13) + h13 * (h12 * h23 - h22 * h13)


def scaled_hessian(state: State[float], p: float, held: tuple[bool, bool]) -> Scaled:
    """Scale the Hessian (13) to a unit diagonal and find its determinant.

    Parameters
    ----------
    state : State of float
        Where.
    p : float
        Modulus ratio less one.
    held : tuple of bool
        Directions whose stretch is prescribed: their rows and columns are left out.

    Examples
    --------
    >>> round(scaled_hessian(State(1.0, 1.0, 0.0, 1.0, 1.0), 0.0, (False, False)).phi, 12)
    0.75
    """
    h11, h22, h33, h12, h13, h23 = hessian(state, p)
    roots = sqrt(h11), sqrt(h22), sqrt(h33)
    free_1, free_2 = not held[0], not held[1]
    c12 = h12 / (roots[0] * roots[1]) if free_1 and free_2 else 0.0
    c13 = h13 / (roots[0] * roots[2]) if free_1 else 0.0
    c23 = h23 / (roots[1] * roots[2]) if free_2 else 0.0
    return Scaled(roots, c12, c13, c23, 1.0 + 2.0 * c12 * c13 * c23 - c12 * c12 - c13 * c13 - c23 * c23)


def dissipation_rate(state: State[Real], p: float) -> Real:
    """Return the energy dissipated per volume and time, (11) with (21) and (22), in ``mu_R/tau``.

    Parameters
    ----------
    state : State
        Floats or arrays of one shape.
    p : float
        Modulus ratio less one.

    Examples
    --------
    >>> dissipation_rate(State(2.0, 1.0, 0.0, 1.0, 1.0), p=1.0)
    14.625
    """
    rate_1, rate_2 = flow(state)
    return p * (rate_1 * rate_1 + rate_2 * rate_2)
