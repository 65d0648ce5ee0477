"""The command line: ``dea-maps sweep``, ``plot``, ``info`` and ``fit``."""

import argparse
import os
import shlex
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NoReturn

_ERROR = "dea-maps: error:"
_COULD_NOT_FINISH, _BAD_INPUT, _INTERRUPTED = 1, 2, 130

_HELP = """\
Phase diagrams of dielectric-elastomer actuators: when, and at what stretch, a film under voltage collapses.

  dea-maps sweep SPEC.toml -o OUT.nc     solve every combination of parameters of a specification
  dea-maps plot OUT.nc -o CHART.png      draw what was found (.png, .svg or .pdf)
  dea-maps info OUT.nc                   say what was found
  dea-maps fit DATA.csv [-o FIT.png]     fit a material to curves of uniaxial tension
"""

_EXAMPLE = """\
a specification:
  [program]
  name = "ramp_hold"     # step: field at once; ramp: rate * t; ramp_hold: min(rate * t, field)
  [grid]                 # each a number, a list, or {start, stop, num, spacing = "linear" | "log"}
  field = { start = 0.8, stop = 2.2, num = 100 }                    # over the relaxed critical field Ec
  rate = { start = 1e-3, stop = 1e3, num = 100, spacing = "log" }   # in Ec per relaxation time
  modulus_ratio = [2.0, 3.85, 10.0]                                 # unrelaxed over relaxed shear modulus
  [accuracy]             # optional
  rtol = 1e-6            # relative error of the results, 1e-12 to 1e-3
                         # also: method, formulation, and step for a method with fixed steps
step takes field, ramp takes rate, ramp_hold takes both, and all take modulus_ratio; OUT.nc is NetCDF-4.

exit status: 0 done, 1 could not finish, 2 bad input, 130 interrupted
"""


class _InputError(Exception):
    """Input that was refused before any computing."""


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and where help is, and leave."""
        self.exit(_BAD_INPUT, f"{_ERROR} {message} (see {self.prog} --help)\n")


class _Version(argparse.Action):
    """An action that looks for the version only when asked, so that ``--help`` does not wait for it."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        """Print the version, and leave."""
        from . import __version__

        print(f"dea-maps {__version__}")
        parser.exit()


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments; by default those of the process.

    Returns
    -------
    int
        Exit status: 0 done, 1 could not finish, 2 bad input, 130 interrupted.

    Examples
    --------
    >>> import contextlib, sys
    >>> with contextlib.redirect_stderr(sys.stdout):
    ...     main(["info", "nowhere.nc"])
    dea-maps: error: there is no file nowhere.nc
    2
    """
    try:
        arguments = _parser().parse_args(argv)
        arguments.run(arguments)
        sys.stdout.flush()
    except SystemExit as stop:  # argparse has said all there is to say
        return stop.code if isinstance(stop.code, int) else 0
    except _InputError as error:
        return _fail(_BAD_INPUT, str(error))
    except KeyboardInterrupt as interrupt:
        words = sys.argv[1:] if argv is None else argv
        again = f"; {interrupt}; to go on: {shlex.join(['dea-maps', *words])}" if interrupt.args else ""
        return _fail(_INTERRUPTED, f"interrupted{again}")
    except BrokenPipeError:  # whoever read standard output has gone: nothing more to tell them
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _COULD_NOT_FINISH
    except (OSError, MemoryError) as error:
        return _fail(_COULD_NOT_FINISH, str(error))
    except Exception as error:  # a fault of this package; whoever mends it asks Python for the traceback
        return _fail(_COULD_NOT_FINISH, f"{type(error).__name__}: {error}")
    return 0


def _fail(status: int, message: str) -> int:
    print(_ERROR, " ".join(message.split()), file=sys.stderr)
    return status


@contextmanager
def _checking_input() -> Iterator[None]:
    """Take errors for refusals of what the user gave."""
    try:
        yield
    except (OSError, TypeError, ValueError) as error:
        raise _InputError(str(error)) from error


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="dea-maps",
        description=_HELP,
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and stop")
    verbs = parser.add_subparsers(metavar="VERB", required=True, title="verbs")

    sweep = verbs.add_parser("sweep", help="solve every combination of parameters of a specification")
    sweep.add_argument("specification", metavar="SPEC.toml", help="see dea-maps --help for an example")
    sweep.add_argument("-o", "--output", metavar="OUT.nc", required=True, help="NetCDF file to write or replace")
    sweep.add_argument("--variables", metavar="NAME,NAME", help="variables to store (default: all)")
    sweep.add_argument("--dtype", choices=("float64", "float32"), default="float64", help="what maps are stored as")
    sweep.add_argument("--engine", choices=("threads", "dask"), default="threads", help="what computes")
    sweep.add_argument("--scheduler", metavar="ADDR", help="of a Dask cluster (default: one on this machine)")
    sweep.add_argument("--memory", metavar="SIZE", help="to be used at most, as 2GiB (default: 1GiB)")
    sweep.add_argument("--fresh", action="store_true", help="do not go on from the parts of an interrupted run")
    sweep.add_argument("--quick", action="store_true", help="thin the grid to 10 values a parameter, for a first look")
    sweep.add_argument("--dry-run", action="store_true", help="check all, say how much it is and takes, and stop")
    sweep.add_argument("--quiet", action="store_true", help="print nothing but errors")
    sweep.set_defaults(run=_sweep)

    plot = verbs.add_parser("plot", help="draw what a sweep found")
    plot.add_argument("map", metavar="OUT.nc", help="file written by dea-maps sweep")
    plot.add_argument("-o", "--output", metavar="CHART.png", required=True, help=".png, .svg or .pdf")
    plot.set_defaults(run=_plot)

    info = verbs.add_parser("info", help="say what a sweep found")
    info.add_argument("map", metavar="OUT.nc", help="file written by dea-maps sweep")
    info.set_defaults(run=_info)

    fit = verbs.add_parser("fit", help="fit both moduli and the relaxation time to curves of uniaxial tension")
    fit.add_argument("data", metavar="DATA.csv", help="columns stretch_rate (1/s), stretch and nominal_stress (Pa)")
    fit.add_argument("-o", "--output", metavar="FIT.png", help="chart of data and fit: .png, .svg or .pdf")
    fit.add_argument(
        "--noise", choices=("constant", "proportional"), default="constant", help="what the scatter of the stress is"
    )
    fit.set_defaults(run=_fit)
    return parser


def _sweep(arguments: argparse.Namespace) -> None:
    from .disk import planned_file, sweep_to_netcdf
    from .spec import read_specification, thinned
    from .storage import open_map
    from .summary import describe_plan, one_line

    storing: dict[str, Any] = {key: getattr(arguments, key) for key in ("dtype", "engine", "scheduler", "memory")}
    with _checking_input():
        spec = read_specification(arguments.specification)
        if arguments.variables is not None:
            storing["variables"] = arguments.variables.split(",")
        parameters = thinned(spec.parameters) if arguments.quick else spec.parameters
        asked = {**parameters, **spec.accuracy, **storing}
        plan = planned_file(arguments.output, spec.program, **asked)
        if os.path.exists(arguments.output) and os.path.samefile(arguments.output, arguments.specification):
            raise ValueError(f"cannot write {arguments.output}: it is the specification itself")
    if arguments.dry_run:
        print(describe_plan(plan))
        return
    progress = sys.stderr.isatty() and not arguments.quiet
    with warnings.catch_warnings():
        warnings.simplefilter("always", UserWarning)
        warnings.showwarning = lambda message, *_, **__: print("dea-maps: warning:", message, file=sys.stderr)
        sweep_to_netcdf(arguments.output, spec.program, **asked, fresh=arguments.fresh, progress=progress)
    if not arguments.quiet:
        with open_map(arguments.output) as ds:
            print(f"{arguments.output}: {one_line(ds)}")


def _plot(arguments: argparse.Namespace) -> None:
    from .charts import check_chart_path, draw, save
    from .storage import open_map

    with _checking_input():
        check_chart_path(arguments.output)
        with open_map(arguments.map) as ds:
            figure = draw(ds)
    save(figure, arguments.output)


def _info(arguments: argparse.Namespace) -> None:
    from .storage import open_map
    from .summary import describe

    with _checking_input():
        ds = open_map(arguments.map)
    with ds:
        print(describe(ds))


def _fit(arguments: argparse.Namespace) -> None:
    from .charts import check_chart_path, save
    from .fit_chart import draw_fit
    from .fitting import fit_uniaxial
    from .tension_curves import read_curves

    with _checking_input():
        curves = read_curves(arguments.data)
        if arguments.output is not None:
            check_chart_path(arguments.output)
    fit = fit_uniaxial(curves, noise=arguments.noise)
    print(fit.summary())
    if arguments.output is not None:
        save(draw_fit(fit), arguments.output)
