"""Films under dead loads: what pre-stretch, relaxation, unequal loads and strain stiffening do to failure.

    python studies/prestretch/run.py [--quick] [--output FOLDER]

writes, in out/prestretch unless told where, map.png, starts.png, lifetime.png, unequal.png, stiffening.png and
prestretch.nc, and prints every table behind README.md.
"""

import sys
from pathlib import Path

sys.path.insert(1, str(Path(__file__).resolve().parents[1]))

import charts
import criteria
import films
import numpy as np
import stiffening
import unequal
import xarray as xr
from common.machine import describe_machine
from common.options import study_parser

SHARES, QUICK_SHARES = [1e-3, 0.01, 0.03, 0.1, 0.2, 0.3, 0.5, 0.75, 1.0], [0.3]
ELASTIC = [1.0, 1.25, 1.5, 2.0, 3.0, 4.0]


def main() -> None:
    """Compute, draw, write, print."""
    options = study_parser(__file__, __doc__, quick="coarser maps and curves, one difference of stresses").parse_args()
    places, across, limits, shares = (20, 17, 6, QUICK_SHARES) if options.quick else (121, 73, 41, SHARES)

    ramps = films.ramp_map(places, places)
    starts = films.relaxed_and_fresh(across, across)
    life = films.lifetimes(places)
    loads = unequal.measure(shares)
    stiff = stiffening.measure(places, limits)
    compared = criteria.measure(ELASTIC)

    charts.ramp_map(ramps, options.output / "map.png")
    charts.relaxed_and_fresh(starts, options.output / "starts.png")
    charts.lifetimes(life, options.output / "lifetime.png")
    charts.unequal(loads, options.output / "unequal.png")
    charts.stiffening(stiff, options.output / "stiffening.png")
    whole = xr.merge([ramps, starts, life, loads, stiff, compared])
    whole.attrs = {"title": "Failure of dielectric-elastomer films under dead loads"}
    zipped = {"zlib": True, "complevel": 4}
    whole.to_netcdf(
        options.output / "prestretch.nc",
        encoding={name: zipped | {"dtype": "float32"} for name in ("map_field", "map_stretch")},
    )

    print_ramps(ramps)
    print_starts(starts)
    print_lifetimes(life)
    print_unequal(loads)
    print_stiffening()
    print_criteria(compared)
    print(describe_machine("NumPy", "SciPy", "Numba", "dea_maps"))


def table(title: str, heads: list[str], rows: list[list[str]]) -> None:
    """Print a Markdown table."""
    print(f"{title}\n\n|", " | ".join(heads), "|\n|" + "---|" * len(heads))
    for row in rows:
        print("|", " | ".join(row), "|")
    print()


def print_ramps(data: xr.Dataset) -> None:
    """Print the field at failure at a few pre-stretches and rates, between its limits."""
    rates = data.map_rate.sel(map_rate=[1e-3, 0.1, 1.0, 10.0, 1e3], method="nearest").values
    rows = []
    for prestretch in data.map_prestretch.sel(map_prestretch=[1.0, 1.5, 2.0, 3.0, 4.0], method="nearest").values:
        part = data.sel(map_prestretch=prestretch)
        values = [part.map_relaxed, *(part.map_field.sel(map_rate=rate) for rate in rates), part.map_instant]
        rows.append([f"{prestretch:.2f}", *(f"{float(value):.4f}" for value in values)])
    heads = ["pre-stretch", "relaxed threshold", *(f"rate {rate:.2g}" for rate in rates), "instant threshold"]
    table("Field at failure in a ramp, E/Ec", heads, rows)


def print_starts(data: xr.Dataset) -> None:
    """Print fresh over relaxed: fields at failure in ramps, times under held fields."""
    rates = data.rate.sel(rate=[1e-3, 0.1, 1.0, 10.0, 1e3], method="nearest").values
    excesses = data.excess.sel(excess=[0.01, 0.1, 0.5], method="nearest").values
    rows = []
    for load in data["load"].values:
        fields, times = (data[name].sel(load=load) for name in ("start_field", "start_time"))
        field, time = (one.sel(start="fresh") / one.sel(start="relaxed") for one in (fields, times))
        cells = [f"{float(field.sel(rate=rate)):.3f}" for rate in rates]
        rows.append([f"{load:g}", *cells, *(_ratio(time.sel(excess=excess)) for excess in excesses)])
    heads = ["load of", *(f"field, rate {rate:.2g}" for rate in rates)]
    table("Fresh over relaxed", heads + [f"time, held {1.0 + excess:.3f}" for excess in excesses], rows)


def _ratio(times: xr.DataArray) -> str:
    """Return fresh over relaxed, or that the relaxed film fails at once."""
    return f"{float(times):.3f}" if np.isfinite(times) else "relaxed: at once"


def print_lifetimes(data: xr.Dataset) -> None:
    """Print times to failure."""
    excesses = data.life_excess.sel(life_excess=[1e-4, 0.01, 0.1, 0.2, 0.5], method="nearest").values
    rows = []
    for prestretch in data.prestretch.values:
        part = data.sel(prestretch=prestretch)
        ratio = float(part.instant_threshold / part.relaxed_threshold)
        times = [float(part.life_time.sel(life_excess=excess)) for excess in excesses]
        cells = ["at once" if np.isnan(time) else f"{time:.4g}" for time in times]
        rows.append([f"{prestretch:g}", f"{float(part.relaxed_threshold):.4f}", f"{ratio:.3f}", *cells])
    heads = ["pre-stretch", "relaxed threshold", "instant over relaxed"]
    table("Time to failure, tau", heads + [f"held {1.0 + excess:.5g}" for excess in excesses], rows)


def print_unequal(data: xr.Dataset) -> None:
    """Print what the equibiaxial film says too much under unequal loads."""
    rows = []
    for mean in data["mean"].values:
        for share in data.share.values:
            part = data.sel(mean=mean, share=share)
            errors = [float(part[name]) for name in ("field_error", "stretch_error", "time_error")]
            time = "survives" if errors[2] == -1.0 else f"{errors[2]:+.1e}"
            rows.append([f"{mean:g}", f"{share:g}", f"{errors[0]:+.1e}", f"{errors[1]:+.1e}", time])
    table("Equibiaxial over general model, less 1", ["mean", "share", "field", "stretch", "time"], rows)
    print(f"both models at equal stresses: {float(data.equal.max()):.0e} apart at most\n")


def print_stiffening() -> None:
    """Print until which pre-stretch there is an instability, and by how much stiffening shifts it before."""
    limits, shares = (50.0, 100.0, 200.0, 1000.0), (0.01, 0.05, 0.1)
    rows = []
    for limit in limits:
        off = [f"{stiffening.prestretch_off(limit, share):.2f}" for share in shares]
        last = f"{stiffening.last_prestretch(limit):.4f}"
        rows.append([f"{limit:g}", f"{stiffening.locking_stretch(limit):.3f}", *off, last])
    heads = ["J", "locking stretch", *(f"field off by {share:.0%}" for share in shares), "no instability beyond"]
    table("Gent's films: pre-stretches", heads, rows)
    prestretches = (1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0)
    rows = []
    for prestretch in prestretches:
        plain = stiffening.instability(prestretch, np.inf)[1]
        cells = [stiffening.instability(prestretch, limit)[1] / plain - 1.0 for limit in limits]
        rows.append([f"{prestretch:g}", *("none" if np.isnan(cell) else f"{cell:.1%}" for cell in cells)])
    table("Field of Gent's film over the neo-Hookean one, less 1", ["pre-stretch", *(f"J {x:g}" for x in limits)], rows)


def print_criteria(data: xr.Dataset) -> None:
    """Print stretch and field of elastic films by both criteria."""
    rows = []
    for prestretch in data.elastic_prestretch.values:
        part = data.sel(elastic_prestretch=prestretch)
        values = [part[name].sel(criterion=kind) for kind in ("nominal", "true") for name in data.data_vars]
        rows.append([f"{prestretch:g}", *(f"{float(value):.4f}" for value in values)])
    table("Elastic films", ["pre-stretch", "det H: stretch", "field", "tangent modulus: stretch", "field"], rows)


if __name__ == "__main__":
    main()
