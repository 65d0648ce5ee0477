"""Radau IIA collocation with many stages for one scalar differential equation, in arbitrary precision.

Spectral in the panel and L-stable: a panel may be many relaxation times long once the transient has died out.
Newton's matrix is the exact Jacobian in double precision, the residual is in working precision, so an
iteration gains up to 14 digits. Panels are as long as the last Legendre coefficients of the slope allow.
"""

from collections.abc import Callable

import numpy as np
from model import mp, mpf

STAGES = 32
#: Size of the last coefficients; the end of a panel converges about twice as fast as these fall.
TOLERANCE = mpf(10) ** -28
CONVERGED = mpf(10) ** -42

#: Slope and its derivative (a double) at (x, y).
Slope = Callable[[mpf, mpf], tuple[mpf, float]]


class OutOfDomainError(ArithmeticError):
    """The slope is not defined at a trial point."""


def legendre(x: mpf, degree: int) -> list[mpf]:
    """Return P_0(x) .. P_degree(x)."""
    values = [mpf(1), x]
    for n in range(2, degree + 1):
        values.append(((2 * n - 1) * x * values[-1] - (n - 1) * values[-2]) / n)
    return values[: degree + 1]


class Radau:
    """The Radau IIA method: nodes on (0, 1], integration matrix, and the rows of the highest coefficients."""

    def __init__(self, stages: int) -> None:
        self.stages = stages
        # zeros of P_(s-1) - P_s: starting values from double precision, then Newton
        series = np.zeros(stages + 1)
        series[stages - 1 :] = 1, -1
        points = []
        for guess in sorted(np.polynomial.legendre.legroots(series))[:-1]:
            x = mpf(float(guess))
            for _ in range(8):
                P = legendre(x, stages)
                slopes = [n * (P[n - 1] - x * P[n]) / (1 - x * x) for n in (stages - 1, stages)]
                x -= (P[stages - 1] - P[stages]) / (slopes[0] - slopes[1])
            points.append(x)
        points.append(mpf(1))
        tables = [legendre(x, stages) for x in points]
        weights = [(1 + x) / (stages * P[stages - 1]) ** 2 for x, P in zip(points, tables, strict=True)]
        integrals = [
            [1 + x] + [(P[n + 1] - P[n - 1]) / 2 for n in range(1, stages)] for x, P in zip(points, tables, strict=True)
        ]
        for row in integrals:
            row[0] /= 2
        self.nodes = [(1 + x) / 2 for x in points]
        self.matrix = [
            [w * mp.fdot(row, P[:stages]) / 2 for w, P in zip(weights, tables, strict=True)] for row in integrals
        ]
        self.matrix_double = np.array([[float(a) for a in row] for row in self.matrix])
        self.tails = [
            [(n + mpf(1) / 2) * w * P[n] for w, P in zip(weights, tables, strict=True)]
            for n in (stages - 1, stages - 2)
        ]

    def panel(self, slope: Slope, x: mpf, y: mpf, width: mpf) -> tuple[mpf, mpf] | None:
        """Return y at the end of the panel and the size of the last coefficients; None if Newton fails."""
        try:
            start = slope(x, y)[0]
            abscissas = [x + width * c for c in self.nodes]
            values = [y + width * c * start for c in self.nodes]
            for _ in range(14):
                evaluated = [slope(a, b) for a, b in zip(abscissas, values, strict=True)]
                slopes = [f for f, _ in evaluated]
                residual = np.array(
                    [
                        float(y + width * mp.fdot(row, slopes) - value)
                        for row, value in zip(self.matrix, values, strict=True)
                    ]
                )
                jacobian = np.eye(self.stages) - float(width) * self.matrix_double * [g for _, g in evaluated]
                change = np.linalg.solve(jacobian, residual)
                values = [value + mpf(float(d)) for value, d in zip(values, change, strict=True)]
                if np.abs(change).max() < CONVERGED:
                    tail = max(abs(mp.fdot(row, slopes)) for row in self.tails)
                    return values[-1], abs(width) * tail
        except OutOfDomainError:
            pass
        return None

    def integrate(self, slope: Slope, x: mpf, y: mpf, end: mpf, width: mpf) -> mpf:
        """Return y at ``end``, from y at x, with panels adapted to the tail of the slope's expansion."""
        accepted = width
        while x < end:
            width = min(width, end - x)
            result = self.panel(slope, x, y, width)
            if result is None:
                width /= 3
                continue
            following, tail = result
            factor = mp.power(TOLERANCE / (tail + mpf(10) ** -60), mpf(1) / self.stages) * mpf("0.95")
            if tail <= 2 * TOLERANCE:
                x, y = (end if width == end - x else x + width), following
                # panels that shrink towards a singularity go on shrinking
                factor *= min(1, width / accepted)
                accepted = width
            width *= min(max(factor, mpf("0.1")), mpf(4))
        return y
