"""The command line of ``dea-maps``: its arguments, its help, and how it ends."""

import argparse
import shlex
import sys
import textwrap
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

from .. import __version__
from ..charts.choices import CHARTS, SIZES
from ..notices import shown_notices
from ..printable import printable
from . import commands as run
from . import streams
from .commands import InputError
from .quantities import Quantity

Act = Callable[[argparse.Namespace], None]
"""What a verb does with its arguments."""

_ERROR = "dea-maps: error:"
_WARNING = "dea-maps: warning:"
_COULD_NOT_FINISH, _BAD_INPUT, _INTERRUPTED, _TERMINATED = 1, 2, 130, 143

_HELP = """\
Phase diagrams of dielectric-elastomer actuators: when, and at what stretch, a film under voltage loses its stability.

  dea-maps ask --thickness 100um --voltage 2kV   how long one film lasts
  dea-maps sweep SPEC.toml -o OUT.nc     solve every combination of parameters
  dea-maps plot OUT.nc -o CHART.png      draw what was found (.png, .svg, .pdf)
  dea-maps info OUT.nc                   print what was found
  dea-maps explore OUT.nc -o PAGE.html   make an interactive HTML page
  dea-maps trajectory SPEC.toml --until 600 -o OUT.csv   follow films in time
  dea-maps design SPEC.toml [-o CH.png]  the allowable voltages of films
  dea-maps fit DATA.csv [-o FIT.png]     fit a material to uniaxial tension
"""

_EXAMPLE = """\
a specification:
  [program]
  name = "ramp_hold"  # step: field at once; ramp: rate * t; or min of both
  [grid]    # a number, a list or {start, stop, num, spacing = "linear" | "log"}
  field = { start = 0.8, stop = 2.2, num = 100 }  # in Ec, the relaxed critical field
  rate = { start = 1e-3, stop = 1e3, num = 100, spacing = "log" }  # Ec per tau
  modulus_ratio = [2.0, 3.85, 10.0]  # unrelaxed over relaxed shear modulus
  [accuracy]          # optional
  rtol = 1e-6         # relative error of the results, 1e-12 to 1e-3
                      # also: method, formulation; step for fixed steps
step takes field, ramp takes rate, ramp_hold takes both, and all take modulus_ratio; OUT.nc is NetCDF-4. The guide on \
programs has the others.

in volts and seconds, add a film; then [grid] may have voltage (V) and voltage_rate (V/s), and needs no modulus_ratio:
  [material]
  preset = "VHB"      # or unrelaxed_modulus, relaxed_modulus (Pa),
                      # relaxation_time (s), relative_permittivity
  thickness = 100e-6  # m, undeformed
  # breakdown_strength = 50e6  # V/m, true field, or {at_rest, exponent}:
                      # also find what comes first (first_limit)

for design, [material], or several [[material]], and
  [design]
  holding_time = [1, 60, 3600]  # s; the thickness may be a list too; with
                      # breakdown_strength the true field is limited as well

exit status: 0 done, 1 could not finish, 2 bad input, 130 interrupted, 143 terminated
"""

_ASK = """\
Answers a question about one film. Numbers are in SI units, or have a unit: 2kV, 50V/s, 10min, 100um.

  dea-maps ask --thickness 100um --voltage 2kV
      how long it lasts under a voltage that is applied at once and held
  dea-maps ask --thickness 100um --hold 10min
      the largest voltage that it sustains for 10 minutes
  dea-maps ask --thickness 100um --voltage 2.2kV --rate 50V/s
      under a voltage that rises at 50 V/s and is then held
  dea-maps ask --thickness 100um --voltage 2kV --rise 2s --hold 60s --rest 60s
      2 s up, 60 s hold, 60 s off; with --repeat, again and again
"""


class _Formatter(argparse.ArgumentDefaultsHelpFormatter):
    """Wraps prose at the width of the terminal, leaves indented lines as they are, and shows defaults."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return "\n".join(
            line if line.startswith(" ") else "\n".join(textwrap.wrap(line, width)) for line in text.split("\n")
        )

    def _get_help_string(self, action: argparse.Action) -> str | None:
        shown = action.default not in (None, False, argparse.SUPPRESS) and "(default:" not in (action.help or "")
        return super()._get_help_string(action) if shown else action.help


class _Completion(argparse.Action):
    """Prints what a shell needs to complete the words of a command."""

    def __call__(self, parser: argparse.ArgumentParser, *given: Any) -> NoReturn:
        """Print it, and leave."""
        try:
            import shtab
        except ImportError:
            parser.error("completion needs the package shtab: pip install 'dea-maps[completion]'")
        streams.say(shtab.complete(parser, given[1]))
        parser.exit()


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
    parser = _Parser(prog="dea-maps", description=_HELP, epilog=_EXAMPLE, formatter_class=_Formatter)
    version = f"dea-maps {__version__}"
    parser.add_argument("-V", "--version", action="version", version=version, help="print the version and stop")
    parser.add_argument(
        "--print-completion", action=_Completion, choices=("bash", "zsh", "tcsh"), help="print a script for a shell"
    )
    verbs = parser.add_subparsers(metavar="VERB", required=True, title="verbs")

    def verb(name: str, what: str, act: Act, description: str | None = None) -> argparse.ArgumentParser:
        made = verbs.add_parser(name, help=what, description=description or what, formatter_class=_Formatter)
        made.set_defaults(run=act)
        return made

    ask = verb("ask", "answer a question about one film, without a map", run.ask, _ASK)
    ask.add_argument("--material", metavar="NAME", default="VHB", help="VHB, or a file with a table [material]")
    ask.add_argument("--thickness", type=Quantity("thickness"), required=True, help="of the undeformed film")
    ask.add_argument("--voltage", type=Quantity("voltage"), help="(default: asks for the largest one)")
    ask.add_argument("--rate", type=Quantity("rate"), help="at which the voltage is reached (default: at once)")
    ask.add_argument("--rise", metavar="TIME", type=Quantity("time"), help="in which it is reached, instead of a rate")
    ask.add_argument("--hold", metavar="TIME", type=Quantity("time"), help="how long it is held (default: without end)")
    ask.add_argument("--fall", metavar="TIME", type=Quantity("time"), help="in which it then falls (default: at once)")
    ask.add_argument("--rest", metavar="TIME", type=Quantity("time"), help="how long it is then off")
    ask.add_argument(
        "--repeat", metavar="N", nargs="?", type=int, const=True, default=False, help="without end, or N times"
    )
    ask.add_argument("--prestretch", metavar="LAMBDA", type=float, help="stretch under a dead load before the voltage")
    ask.add_argument("--json", action="store_true", help="print the answer as JSON, in SI units")

    sweep = verb("sweep", "solve every combination of parameters of a specification", run.sweep)
    sweep.add_argument("specification", metavar="SPEC.toml", help="see dea-maps --help for an example")
    sweep.add_argument("-o", "--output", metavar="OUT.nc", required=True, help="NetCDF file to write or replace")
    sweep.add_argument("--variables", metavar="NAME,NAME", help="variables to store (default: all)")
    sweep.add_argument("--dtype", choices=("float64", "float32"), default="float64", help="what maps are stored as")
    sweep.add_argument("--digits", choices=("auto",), help="round what is stored to the bits that rtol carries")
    sweep.add_argument("--engine", choices=("threads", "dask"), default="threads", help="what computes")
    sweep.add_argument("--scheduler", metavar="ADDR", help="of a Dask cluster (default: one on this machine)")
    sweep.add_argument("--memory", metavar="SIZE", help="to be used at most, as 2GiB (default: 1GiB)")
    sweep.add_argument("--fresh", action="store_true", help="do not resume from the parts of an interrupted run")
    sweep.add_argument("--quick", action="store_true", help="thin the grid to 10 values a parameter, for a first look")
    sweep.add_argument("--dry-run", action="store_true", help="check all, print size and estimated run time, and stop")
    sweep.add_argument("--quiet", action="store_true", help="print nothing but errors")

    plot = verb("plot", "draw what a sweep found", run.plot)
    plot.add_argument("map", metavar="OUT.nc", help="file written by dea-maps sweep; or of dm.trajectory or dm.design")
    plot.add_argument("-o", "--output", metavar="CHART.png", required=True, help=".png, .svg or .pdf")
    plot.add_argument("--chart", choices=CHARTS, default="auto", help="which; auto: what suits the map")
    plot.add_argument("--size", choices=SIZES, default="column", help="for a column of print or a slide")

    info = verb("info", "print what a sweep found", run.info)
    info.add_argument("map", metavar="OUT.nc", help="file written by dea-maps sweep")
    info.add_argument("--json", action="store_true", help="print it as JSON")

    explore = verb("explore", "make an interactive HTML page of a map", run.explore)
    explore.add_argument("map", metavar="OUT.nc", help="file written by dea-maps sweep")
    explore.add_argument("-o", "--output", metavar="PAGE.html", required=True, help="one file that needs no network")

    trajectory = verb("trajectory", "follow the films of a specification in time", run.trajectory)
    trajectory.add_argument("specification", metavar="SPEC.toml", help="as of a sweep, with few films")
    trajectory.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        required=True,
        help="data (.nc), a table (.csv) or a chart (.png, .svg, .pdf)",
    )
    trajectory.add_argument(
        "--until", metavar="TIME", type=float, required=True, help="in s with a [material], in relaxation times without"
    )
    trajectory.add_argument("--points", metavar="N", type=int, default=201, help="number of times, from 0 on")
    trajectory.add_argument("--size", choices=SIZES, default="column", help="of a chart")

    design = verb("design", "find the allowable voltages of films for given times", run.design)
    design.add_argument("specification", metavar="SPEC.toml", help="see dea-maps --help for an example")
    design.add_argument("-o", "--output", metavar="CHART.png", help="chart of them: .png, .svg or .pdf")
    design.add_argument("--size", choices=SIZES, default="column", help="for a column of print or a slide")

    fit = verb("fit", "fit both moduli and the relaxation time to curves of uniaxial tension", run.fit)
    fit.add_argument("data", metavar="DATA.csv", help="columns stretch_rate (1/s), stretch and nominal_stress (Pa)")
    fit.add_argument("-o", "--output", metavar="FIT.png", help="chart of data and fit: .png, .svg or .pdf")
    fit.add_argument("--material", metavar="FILM.toml", help="file for the table [material] of a specification")
    fit.add_argument(
        "--noise", choices=("constant", "proportional"), default="constant", help="what the scatter of the stress is"
    )
    return parser
