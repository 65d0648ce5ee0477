"""A film under a dead load: the largest loads that it carries, relaxed and at first, and equilibrium between them."""

import math

import numpy as np

from .._jit import device
from ..model import CRITICAL_LOAD
from . import doubled

# e_C = (3/4) 4**(-1/3) less its float: what is missing of its digits.
_CRITICAL_LOAD_LOW = 1.8043325458252013e-17
# Loads that differ by less than this, relative to themselves, are equal: the rounding of sums of two floats.
TIE = 1e-28
# Iterations of Newton's method for one unknown, from guesses within its range: measured on all films of the region, all
# digits are there after one less. Loops over lanes become vector instructions, since no lane ends before another.
_NEWTON = 6
_FROM_NEARBY = 3
# The same for the state at failure, and its last step, relative, from which all digits follow; lanes that are not there
# are taken one by one.
_QUICK = 5
_SQUARED = 1e-8
_ITERATIONS = 60
_SETTLED = 1e-15

# Rows of what is known of a cell before any integration.
W_T = 0  # w of the relaxed film under its largest load, and its field, in Ec
FIELD_T = 1
W_I = 2  # the same of the film at first
FIELD_I = 3
LOAD_T = 4  # e_t
GAP_T = 5  # e - e_t, and e_i - e, of the given field
GAP_I = 6
FILM = 7


@device
def _above_sixth_root(x):
    """Return a little more than the sixth root of x <= 1, by square roots, which vectorise: x**(85/512)."""
    eighth = np.sqrt(np.sqrt(np.sqrt(x)))
    last = np.sqrt(np.sqrt(eighth))
    total = eighth * last
    last = np.sqrt(np.sqrt(last))
    return total * last * np.sqrt(np.sqrt(last))


@device
def unstable_w(A, B, sigma):
    """W at D = 0: of a convex increasing function, by Newton's method from above."""
    w = min(_above_sixth_root(0.25 * A / B), 2.0 * A / (3.0 * sigma + 1e-300))
    for _ in range(_NEWTON):
        square = w * w
        fifth = B * square * square * w
        w = w - (8.0 * fifth * w + 3.0 * sigma * w - 2.0 * A) / (48.0 * fifth + 3.0 * sigma)
    return w


@device
def _carried(w, A, A_low, B, B_low, sigma):
    """Load at a stretch, ``w**2 (A - B w**6 - sigma w)``; next to its largest value an error of w does not count."""
    u, u_low = doubled.product(w, w)
    v, v_low = doubled.multiply(u, u_low, u, u_low)
    v, v_low = doubled.multiply(v, v_low, u, u_low)
    v, v_low = doubled.multiply(v, v_low, B, B_low)
    s, s_low = doubled.product(sigma, w)
    total, low = doubled.add(A, A_low, -v, -v_low)
    total, low = doubled.add(total, low, -s, -s_low)
    return doubled.multiply(total, low, u, u_low)


@device
def describe(film, cell, field, p, start, sigma):
    """Fill in a column of ``film``, (FILM, cells), for a film of internal stretch ``start`` at first."""
    r, r_low = doubled.product(start, start)
    A, A_low = doubled.quotient(p, r, r_low)
    A, A_low = doubled.add(1.0, 0.0, A, A_low)
    B, B_low = doubled.multiply(r, r_low, r, r_low)
    B, B_low = doubled.multiply(p, 0.0, B, B_low)
    B, B_low = doubled.add(1.0, 0.0, B, B_low)
    relaxed = unstable_w(1.0, 1.0, sigma)
    at_first = unstable_w(A, B, sigma)
    load_t, load_t_low = _carried(relaxed, 1.0, 0.0, 1.0, 0.0, sigma)
    load_i, load_i_low = _carried(at_first, A, A_low, B, B_low, sigma)
    load, load_low = doubled.product(field, field)
    load, load_low = doubled.multiply(load, load_low, CRITICAL_LOAD, _CRITICAL_LOAD_LOW)
    above, above_low = doubled.add(load, load_low, -load_t, -load_t_low)
    below, below_low = doubled.add(load_i, load_i_low, -load, -load_low)
    film[W_T, cell] = relaxed
    film[FIELD_T, cell] = np.sqrt(load_t / CRITICAL_LOAD)
    film[W_I, cell] = at_first
    film[FIELD_I, cell] = np.sqrt(load_i / CRITICAL_LOAD)
    film[LOAD_T, cell] = load_t
    film[GAP_T, cell] = above + above_low if abs(above) > TIE * load_t else 0.0
    film[GAP_I, cell] = below + below_low if abs(below) > TIE * load_i else 0.0


@device
def curvature(d, w, A, B, sigma):
    """G of ``d**2 G(d)``: what the load at w + d lacks of its largest value, that at w; and dG/dd."""
    square = w * w
    cube = square * w
    value = (
        B * cube * cube * 28.0
        - A
        + 3.0 * sigma * w
        + d
        * (
            sigma
            + B
            * (
                cube * square * 56.0
                + d * (square * square * 70.0 + d * (cube * 56.0 + d * (square * 28.0 + d * (8.0 * w + d))))
            )
        )
    )
    slope = sigma + B * (
        cube * square * 56.0
        + d * (square * square * 140.0 + d * (cube * 168.0 + d * (square * 112.0 + d * (40.0 * w + 6.0 * d))))
    )
    return value, slope


@device
def relaxed_stiffness(d, w_t, sigma):
    """K of ``-g'/w = d K``, the stiffness of the relaxed film."""
    w = w_t + d
    return 8.0 * (w * w * w + w_t * w_t * w_t) * (w * w + w * w_t + w_t * w_t) + 3.0 * sigma


@device
def stable_side(gap, w, A, B, sigma):
    """Return d > 0 at which ``d**2 G(d)`` is a gap of the load: convex, by Newton's method from above."""
    first, _ = curvature(0.0, w, A, B, sigma)
    gap = max(gap, 0.0)
    d = np.sqrt(gap / first)
    for _ in range(_NEWTON):
        G, slope = curvature(d, w, A, B, sigma)
        d = d - (d * d * G - gap) / (d * (2.0 * G + d * slope) + 1e-300)
    return d


@device
def _nearer(p, a, r, w_t, sigma, d):
    """Return d after one iteration of Newton's method for D = 0, without its cancelling terms; and the step."""
    w = w_t + d
    square = w * w
    fifth = square * square * w
    miss = d * relaxed_stiffness(d, w_t, sigma) + 8.0 * p * r * r * fifth * w - 2.0 * p * a
    step = miss / (48.0 * (1.0 + p * r * r) * fifth + 3.0 * sigma)
    return d - step, step


@device
def unstable_d(p, a, w_t, sigma, d):
    """D = w - w_t at the instability at r = 1/a, from any guess."""
    r = 1.0 / a
    for _ in range(_ITERATIONS):
        d, step = _nearer(p, a, r, w_t, sigma, d)
        if abs(step) <= _SETTLED * (w_t + d):
            break
    return d


@device
def spare_load(p, a, w_t, sigma, gap_t, d):
    """Return by how much the largest load at r = 1/a, carried at ``d``, exceeds the load, e_t + gap_t, uncancelled."""
    u = (w_t + d) * (w_t + d)
    G, _ = curvature(d, w_t, 1.0, 1.0, sigma)
    return p * u * (a - u * u * u / (a * a)) - d * d * G - gap_t


@device
def equilibrium_d(p, a, w_t, sigma, gap_t, guess):
    """Return d in equilibrium with a load at r = 1/a; that of the instability where the film does not carry it."""
    d = unstable_d(p, a, w_t, sigma, guess)
    spare = spare_load(p, a, w_t, sigma, gap_t, d)
    return d + stable_side(spare, w_t + d, 1.0 + p * a, 1.0 + p / (a * a), sigma)


@device
def first_d(p, start, w_t, sigma, w_i, gap_i):
    """Return w - w_t of the film at first, and w_i - w_t, where the load lacks ``gap_i`` of its largest value."""
    a = 1.0 / (start * start)
    unstable = w_i - w_t
    for _ in range(_FROM_NEARBY):
        unstable, _ = _nearer(p, a, start * start, w_t, sigma, unstable)
    return unstable + stable_side(gap_i, w_i, 1.0 + p * a, 1.0 + p / (a * a), sigma), unstable


@device
def guess_of_failure(w_t, a_first, d_first, share):
    """Return a and d between those of a film at first and, roughly, of one that fails just above e_t."""
    a = min(0.5 * w_t * w_t, a_first)
    return a + (a_first - a) * share, d_first * share


@device
def _step_of_failure(p, a, w_t, sigma, load, gap_t, d):
    """Return by how much a is to fall, and the spare load: Newton's method for the root of the largest load over a."""
    spare = spare_load(p, a, w_t, sigma, gap_t, d)
    u = (w_t + d) * (w_t + d)
    slope = p * u * (1.0 + 2.0 * u * u * u / (a * a * a))
    return 2.0 * spare / ((1.0 + np.sqrt(load / max(load + spare, 0.25 * load))) * slope), spare


@device
def quick_failure(p, w_t, sigma, load, gap_t, a_first, a, d):
    """Do what `failure` does in a few iterations from a guess, without a bracket; also whether they suffice."""
    step = 0.0
    for _ in range(_QUICK):
        r = 1.0 / a
        for _ in range(_FROM_NEARBY):
            d, _ = _nearer(p, a, r, w_t, sigma, d)
        step, _ = _step_of_failure(p, a, w_t, sigma, load, gap_t, d)
        a = a - step
    for _ in range(_FROM_NEARBY):
        d, _ = _nearer(p, a, 1.0 / a, w_t, sigma, d)
    return a, d, (abs(step) <= _SQUARED * a) & (a > 0.0) & (a <= a_first)


@device
def failure(p, w_t, sigma, load, gap_t, a_first, d_first, share):
    """Return a = 1/r and d at the instability under a held load, where the film's largest load has fallen to it.

    Newton's method for the square root of the largest load over a, within a bracket; its derivative follows from the
    envelope theorem. ``share`` is the field's place between those at which a relaxed film and one at first fail.

    Returns
    -------
    a, d : float
        Those of a film at first where it does not carry the load, within the accuracy of ``a_first``; NaN where the
        iteration did not end.
    """
    d = unstable_d(p, a_first, w_t, sigma, d_first)
    if spare_load(p, a_first, w_t, sigma, gap_t, d) <= 0.0:
        return a_first, d
    high, low = a_first, 0.0
    a, d = guess_of_failure(w_t, a_first, d_first, share)
    for _ in range(_ITERATIONS):
        d = unstable_d(p, a, w_t, sigma, d)
        step, spare = _step_of_failure(p, a, w_t, sigma, load, gap_t, d)
        if abs(step) <= _SETTLED * 10.0 * a:
            return a, d
        if spare > 0.0:
            high = a
        else:
            low = a
        a = a - step
        if not low < a < high:
            a = np.sqrt(low * high) if low > 0.0 else 0.25 * high
    return math.nan, math.nan
