"""From a tensile test to a drive waveform: one actuator that is driven with pulses without end.

    python studies/drive/run.py [--tension CURVES.csv] [--quick] [--output FOLDER]

writes, in out/drive unless told where, fit.png, prestretch.png, margin.png, waveform.png and their data beside them as
.nc, and prints the tables of README.md.
"""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(1, str(Path(__file__).resolve().parents[1]))

import charts
import design
import numpy as np
import tables
import xarray as xr
from common.machine import describe_machine
from common.options import study_parser

import dea_maps as dm

if TYPE_CHECKING:
    from common.internals import UniaxialFit

CURVES = Path(__file__).resolve().parents[1] / "actuator" / "tension.csv"


def main() -> None:
    """Fit, choose, check, draw, write, print."""
    parser = study_parser(__file__, __doc__, quick="fewer films, voltages and errors")
    parser.add_argument("--tension", type=Path, default=CURVES, metavar="CURVES.csv", help="default: computed curves")
    options = parser.parse_args()
    folder, quick = options.output, options.quick

    fit = design.fitted(options.tension)
    print(f"{fit.summary()}\n")
    charts.fit(fit, options.tension == CURVES, folder / "fit.png")
    nominal = design.film(fit.material)
    weak = design.film(fit.material, **design.off(**design.WEAKENS))
    strong = design.film(fit.material, **design.off(**{name: -sign for name, sign in design.WEAKENS.items()}))

    among = design.candidates(nominal, weak, (1.5,) if quick else (1.0, 1.1, 1.25, 1.5), 3 if quick else 21)
    point = voltage, duty, prestretch = design.decided(among, nominal, weak)
    charts.candidates(among, point, design.stroke(nominal, *point), folder / "prestretch.png")
    tables.candidates(among)
    tables.decision(nominal, weak, strong, point)

    margins = design_margins(fit, point, quick)
    charts.margins(margins, folder / "margin.png")
    tables.margins(margins)
    tables.beyond(nominal, point)
    tables.strengths(nominal, point)
    if not quick:
        tables.agreement(nominal, point)

    seconds = np.linspace(0.0, 10.0 * design.PERIOD, 600 if quick else 2400, endpoint=False)
    films = {"all constants off, weakest": weak, "as fitted": nominal, "all constants off, strongest": strong}
    runs = [design.followed(one, voltage, duty, prestretch, seconds) for one in films.values()]
    charts.waveform(dict(zip(films, runs, strict=True)), point, folder / "waveform.png")

    among.to_netcdf(folder / "prestretch.nc")
    margins.to_netcdf(folder / "margin.nc")
    about = {"long_name": "area strain from the pre-stretched film", "units": "1"}
    strains = xr.DataArray([one.area_strain for one in runs], {"film": list(films)}, ("film", "seconds"), attrs=about)
    strains.assign_coords(seconds=runs[0].seconds.values).to_dataset(name="area_strain").to_netcdf(
        folder / "waveform.nc"
    )
    print(describe_machine("NumPy", "SciPy", "Numba", "dea_maps"))


def design_margins(fit: "UniaxialFit", point: tuple[float, float, float], quick: bool) -> xr.Dataset:
    """Return the allowable duty with constants off: each alone, all at once, and at the ends of the fit's intervals."""
    voltage, duty, prestretch = point

    def allowed(material: dm.Material) -> float:
        return float(design.allowable_duty(material, voltage, prestretch).allowable)

    rows = {}
    for name, sign in list(design.WEAKENS.items())[: 1 if quick else None]:
        pair = [allowed(design.film(fit.material, **design.off(**{name: side * sign}))) for side in (1, -1)]
        rows[f"{name.replace('_', ' ')}, 5 % off"] = pair
    ends = [allowed(one) for one in design.ends_of(fit)[:: 7 if quick else 1]]
    rows["ends of the 95 % intervals of the fit"] = [min(ends), max(ends)]
    all_off = [allowed(design.film(fit.material, **factors)) for factors in design.corners(quick)]
    rows["all constants, 5 % off"] = [min(all_off), max(all_off)]
    about = {"long_name": "largest duty that is survived without end", "units": "1"}
    ds = xr.Dataset(
        {"allowable_duty": (("error", "side"), list(rows.values()), about)},
        {"error": list(rows), "side": ["smallest", "largest"]},
        {"voltage_in_V": voltage, "duty": duty, "prestretch": prestretch},
    )
    return ds.assign(as_fitted=((), allowed(design.film(fit.material)), about))


if __name__ == "__main__":
    main()
