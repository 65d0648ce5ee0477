"""The command line of ``dea-maps``: its arguments, its help, and how it ends."""

import argparse
import shlex
import sys
from collections.abc import Sequence
from typing import NoReturn

from .. import __version__
from ..charts.choices import CHARTS, SIZES
from ..notices import shown_notices
from ..printable import printable
from . import commands as run
from . import streams
from .commands import InputError

_ERROR = "dea-maps: error:"
_WARNING = "dea-maps: warning:"
_COULD_NOT_FINISH, _BAD_INPUT, _INTERRUPTED, _TERMINATED = 1, 2, 130, 143

_HELP = """\
Phase diagrams of dielectric-elastomer actuators: when, and at what stretch, a film under voltage collapses.

  dea-maps sweep SPEC.toml -o OUT.nc     solve every combination of parameters of a specification
  dea-maps plot OUT.nc -o CHART.png      draw what was found (.png, .svg or .pdf)
  dea-maps info OUT.nc                   say what was found
  dea-maps explore OUT.nc -o PAGE.html   make an interactive HTML page
  dea-maps design SPEC.toml [-o CH.png]  the allowable voltages of films for given times
  dea-maps fit DATA.csv [-o FIT.png]     fit a material to curves of uniaxial tension
"""

_EXAMPLE = """\
a specification:
  [program]
  name = "ramp_hold"     # step: field at once; ramp: rate * t; ramp_hold: min(rate * t, field)
  [grid]                 # each a number, a list, or {start, stop, num, spacing = "linear" | "log"}
  field = { start = 0.8, stop = 2.2, num = 100 }                    # in units of the relaxed critical field Ec
  rate = { start = 1e-3, stop = 1e3, num = 100, spacing = "log" }   # in Ec per relaxation time
  modulus_ratio = [2.0, 3.85, 10.0]                                 # unrelaxed over relaxed shear modulus
  [accuracy]             # optional
  rtol = 1e-6            # relative error of the results, 1e-12 to 1e-3
                         # also: method, formulation, and step for a method with fixed steps
step takes field, ramp takes rate, ramp_hold takes both, and all take modulus_ratio; OUT.nc is NetCDF-4.

in volts and seconds, add a film; then [grid] may have voltage (V) and voltage_rate (V/s), and needs no modulus_ratio:
  [material]
  preset = "VHB"         # or unrelaxed_modulus, relaxed_modulus (Pa), relaxation_time (s), relative_permittivity
  thickness = 100e-6     # m, undeformed
  # breakdown_strength = 50e6  # V/m, true field, or {at_rest, exponent}: also find what comes first (first_limit)

for design, [material], or several [[material]], and
  [design]
  holding_time = [1, 60, 3600]       # s, constant voltage; the thickness may be a list too
                         # with breakdown_strength in [material] (V/m) the true field is limited as well

exit status: 0 done, 1 could not finish, 2 bad input, 130 interrupted, 143 terminated
"""


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and where help is, and leave."""
        self.exit(_BAD_INPUT, f"{_ERROR} {printable(message)} (see {self.prog} --help)\n")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments; by default those of the process.

    Returns
    -------
    int
        Exit status: 0 done, 1 could not finish, 2 bad input, 130 interrupted, 143 terminated.

    Examples
    --------
    >>> import contextlib, sys
    >>> with contextlib.redirect_stderr(sys.stdout):
    ...     main(["info", "nowhere.nc"])
    dea-maps: error: there is no file nowhere.nc
    2
    """
    streams.prepare()
    try:
        with streams.terminable() as terminated, streams.warnings_as_lines(_WARNING):
            status = _status(sys.argv[1:] if argv is None else argv, terminated)
        streams.settle()
    except streams.OutputError as error:
        if isinstance(error.__cause__, BrokenPipeError):  # whoever read it has gone: nothing more to tell them
            return _COULD_NOT_FINISH
        return _fail(_COULD_NOT_FINISH, f"cannot write to standard output: {error.__cause__}")
    return status


def _status(words: Sequence[str], terminated: list[int]) -> int:
    """Do what is asked, and return the exit status."""
    try:
        arguments = _parser().parse_args(words)
        with shown_notices(not getattr(arguments, "quiet", False)):
            arguments.run(arguments)
    except SystemExit as stop:  # argparse has said all there is to say
        return stop.code if isinstance(stop.code, int) else 0
    except InputError as error:
        return _fail(_BAD_INPUT, str(error))
    except KeyboardInterrupt as interrupt:
        ended, status = ("terminated", _TERMINATED) if terminated else ("interrupted", _INTERRUPTED)
        again = f"; {interrupt}; to resume: {shlex.join(['dea-maps', *words])}" if interrupt.args else ""
        return _fail(status, f"{ended}{again}")
    except streams.OutputError:
        raise
    except (OSError, MemoryError) as error:
        return _fail(_COULD_NOT_FINISH, str(error))
    except Exception as error:  # a fault of this package; whoever mends it asks Python for the traceback
        return _fail(_COULD_NOT_FINISH, f"{type(error).__name__}: {error}")
    return 0


def _fail(status: int, message: str) -> int:
    streams.complain(f"{_ERROR} {message}")
    return status


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="dea-maps",
        description=_HELP,
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    version = f"dea-maps {__version__}"
    parser.add_argument("--version", action="version", version=version, help="print the version and stop")
    choices = parser.add_subparsers(metavar="VERB", required=True, title="verbs")

    sweep = choices.add_parser("sweep", help="solve every combination of parameters of a specification")
    sweep.add_argument("specification", metavar="SPEC.toml", help="see dea-maps --help for an example")
    sweep.add_argument("-o", "--output", metavar="OUT.nc", required=True, help="NetCDF file to write or replace")
    sweep.add_argument("--variables", metavar="NAME,NAME", help="variables to store (default: all)")
    sweep.add_argument("--dtype", choices=("float64", "float32"), default="float64", help="what maps are stored as")
    sweep.add_argument("--engine", choices=("threads", "dask"), default="threads", help="what computes")
    sweep.add_argument("--scheduler", metavar="ADDR", help="of a Dask cluster (default: one on this machine)")
    sweep.add_argument("--memory", metavar="SIZE", help="to be used at most, as 2GiB (default: 1GiB)")
    sweep.add_argument("--fresh", action="store_true", help="do not resume from the parts of an interrupted run")
    sweep.add_argument("--quick", action="store_true", help="thin the grid to 10 values a parameter, for a first look")
    sweep.add_argument("--dry-run", action="store_true", help="check all, print size and estimated run time, and stop")
    sweep.add_argument("--quiet", action="store_true", help="print nothing but errors")
    sweep.set_defaults(run=run.sweep)

    plot = choices.add_parser("plot", help="draw what a sweep found")
    plot.add_argument("map", metavar="OUT.nc", help="file written by dea-maps sweep; or of dm.trajectory or dm.design")
    plot.add_argument("-o", "--output", metavar="CHART.png", required=True, help=".png, .svg or .pdf")
    plot.add_argument("--chart", choices=CHARTS, default="auto", help="which (default: what suits the map)")
    plot.add_argument("--size", choices=SIZES, default="column", help="for a column of print or a slide")
    plot.set_defaults(run=run.plot)

    info = choices.add_parser("info", help="say what a sweep found")
    info.add_argument("map", metavar="OUT.nc", help="file written by dea-maps sweep")
    info.set_defaults(run=run.info)

    explore = choices.add_parser("explore", help="make an interactive HTML page of a map")
    explore.add_argument("map", metavar="OUT.nc", help="file written by dea-maps sweep")
    explore.add_argument("-o", "--output", metavar="PAGE.html", required=True, help="one file that needs no network")
    explore.set_defaults(run=run.explore)

    design = choices.add_parser("design", help="find the allowable voltages of films for given times")
    design.add_argument("specification", metavar="SPEC.toml", help="see dea-maps --help for an example")
    design.add_argument("-o", "--output", metavar="CHART.png", help="chart of them: .png, .svg or .pdf")
    design.add_argument("--size", choices=SIZES, default="column", help="for a column of print or a slide")
    design.set_defaults(run=run.design)

    fit = choices.add_parser("fit", help="fit both moduli and the relaxation time to curves of uniaxial tension")
    fit.add_argument("data", metavar="DATA.csv", help="columns stretch_rate (1/s), stretch and nominal_stress (Pa)")
    fit.add_argument("-o", "--output", metavar="FIT.png", help="chart of data and fit: .png, .svg or .pdf")
    fit.add_argument("--material", metavar="FILM.toml", help="file for the table [material] of a specification")
    fit.add_argument(
        "--noise", choices=("constant", "proportional"), default="constant", help="what the scatter of the stress is"
    )
    fit.set_defaults(run=run.fit)
    return parser
