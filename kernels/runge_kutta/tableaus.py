"""Explicit Runge-Kutta tableaus as data that check themselves at import.

Nodes are not stored: every formulation here is autonomous or carries time as a state.
"""

from dataclasses import dataclass
from fractions import Fraction

Row = tuple[float, ...]


@dataclass(frozen=True)
class Tableau:
    """An explicit Runge-Kutta method with its embedded error weights.

    Attributes
    ----------
    name : str
        As in the public interface.
    order : int
        Order of the solution that is carried on.
    rows : tuple of tuple of float
        ``rows[i]`` combines the derivatives of stages 0..i to the state of stage i + 1.
    weights : tuple of float
        Of the solution that is carried on.
    errors : tuple of tuple of float
        Weights of the embedded error estimates, on the stages and, last, the derivative at the new state.
        Empty for a method without one; two for a pair of estimates that are blended (Hairer's DOP853).
    error_order : int
        Order in the step size to which the (blended) error estimate vanishes.
    source : str
        Where the coefficients come from.
    """

    name: str
    order: int
    rows: tuple[Row, ...]
    weights: Row
    errors: tuple[Row, ...]
    error_order: int
    source: str

    @property
    def stages(self) -> int:
        """Number of stages, the derivative at the new state not counted."""
        return len(self.weights)

    def __post_init__(self) -> None:
        """Check shapes and the quadrature conditions sum b_i c_i**(j-1) = 1/j for j up to the order."""
        if [len(row) for row in self.rows] != list(range(1, self.stages)):
            raise ValueError(f"tableau {self.name}: row i must have i + 1 coefficients")
        nodes = (0.0, *(sum(row) for row in self.rows))
        for power in range(self.order):
            moment = sum(b * c**power for b, c in zip(self.weights, nodes, strict=True))
            if abs(moment - 1.0 / (power + 1)) > 1e-14:
                raise ValueError(f"tableau {self.name}: moment {power} of the weights is {moment}")
        for error in self.errors:
            if len(error) != self.stages + 1 or abs(sum(error)) > 1e-14:
                raise ValueError(f"tableau {self.name}: error weights must have one more entry and sum to zero")


def _floats(*numbers: float | int | str) -> Row:
    return tuple(float(Fraction(number)) if isinstance(number, str) else float(number) for number in numbers)


def _differences(weights: Row, *others: Row) -> tuple[Row, ...]:
    """Error weights of solutions of lower order that use the derivative at the new state last."""
    padded = (*weights, 0.0)
    return tuple(tuple(b - o for b, o in zip(padded, other, strict=True)) for other in others)


RK4 = Tableau(
    name="rk4",
    order=4,
    rows=(_floats("1/2"), _floats(0, "1/2"), _floats(0, 0, 1)),
    weights=_floats("1/6", "1/3", "1/3", "1/6"),
    errors=(),
    error_order=0,
    source="Kutta 1901; Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, table II.1.2",
)

_DOPRI5_WEIGHTS = _floats("35/384", 0, "500/1113", "125/192", "-2187/6784", "11/84")

DOPRI5 = Tableau(
    name="dopri5",
    order=5,
    rows=(
        _floats("1/5"),
        _floats("3/40", "9/40"),
        _floats("44/45", "-56/15", "32/9"),
        _floats("19372/6561", "-25360/2187", "64448/6561", "-212/729"),
        _floats("9017/3168", "-355/33", "46732/5247", "49/176", "-5103/18656"),
    ),
    weights=_DOPRI5_WEIGHTS,
    errors=_differences(
        _DOPRI5_WEIGHTS,
        _floats("5179/57600", 0, "7571/16695", "393/640", "-92097/339200", "187/2100", "1/40"),
    ),
    error_order=5,
    source="Dormand and Prince 1980, J. Comput. Appl. Math. 6, 19-26",
)

# fmt: off
_DOP853_WEIGHTS = _floats(
    0.054293734116568765, 0, 0, 0, 0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
    0.3111643669578199, -0.1521609496625161, 0.20136540080403034, 0.04471061572777259,
)

DOP853 = Tableau(
    name="dop853",
    order=8,
    rows=(
        _floats(0.05260015195876773),
        _floats(0.0197250569845379, 0.0591751709536137),
        _floats(0.02958758547680685, 0, 0.08876275643042054),
        _floats(0.2413651341592667, 0, -0.8845494793282861, 0.924834003261792),
        _floats(0.037037037037037035, 0, 0, 0.17082860872947386, 0.12546768756682242),
        _floats(0.037109375, 0, 0, 0.17025221101954405, 0.06021653898045596, -0.017578125),
        _floats(
            0.03709200011850479, 0, 0, 0.17038392571223998, 0.10726203044637328, -0.015319437748624402,
            0.008273789163814023,
        ),
        _floats(
            0.6241109587160757, 0, 0, -3.3608926294469414, -0.868219346841726, 27.59209969944671,
            20.154067550477894, -43.48988418106996,
        ),
        _floats(
            0.47766253643826434, 0, 0, -2.4881146199716677, -0.590290826836843, 21.230051448181193,
            15.279233632882423, -33.28821096898486, -0.020331201708508627,
        ),
        _floats(
            -0.9371424300859873, 0, 0, 5.186372428844064, 1.0914373489967295, -8.149787010746927,
            -18.52006565999696, 22.739487099350505, 2.4936055526796523, -3.0467644718982196,
        ),
        _floats(
            2.273310147516538, 0, 0, -10.53449546673725, -2.0008720582248625, -17.9589318631188,
            27.94888452941996, -2.8589982771350235, -8.87285693353063, 12.360567175794303,
            0.6433927460157636,
        ),
    ),
    weights=_DOP853_WEIGHTS,
    errors=(
        _floats(
            0.01312004499419488, 0, 0, 0, 0, -1.2251564463762044, -0.4957589496572502, 1.6643771824549864,
            -0.35032884874997366, 0.3341791187130175, 0.08192320648511571, -0.022355307863886294, 0,
        ),
        _floats(
            -0.18980075407240762, 0, 0, 0, 0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
            -0.4226823213237919, -0.1521609496625161, 0.20136540080403034, 0.02265179219836082, 0,
        ),
    ),
    error_order=8,
    source="Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., section II.10 (DOP853)",
)
# fmt: on

TABLEAUS = {tableau.name: tableau for tableau in (RK4, DOPRI5, DOP853)}
