"""From a tensile fit or the preset to a design decision for films like VHB, 50 and 100 um thick.

    python studies/actuator/run.py [--tension CURVES.csv] [--quick] [--output FOLDER]

reads design.toml and ramp_hold.toml, writes, in out/actuator unless told where, fit.png, design.png, map.png,
ramps.png, held.png, windows.png, agreement.png, their data beside them as .nc, and tension.csv, and prints the tables
of README.md.
"""

import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(1, str(Path(__file__).resolve().parents[1]))

import agreement
import charts
import decision
import films
import numpy as np
import tables
from common.internals import read_curves
from common.machine import describe_machine
from common.options import study_parser

import dea_maps as dm


def main() -> None:
    """Fit, answer, draw, write, print."""
    parser = study_parser(__file__, __doc__, quick="coarser charts, two accuracies")
    parser.add_argument("--tension", type=Path, metavar="CURVES.csv", help="design with a fit to these, not the preset")
    options = parser.parse_args()
    folder, quick = options.output, options.quick

    if options.tension is None:
        films.write_tension(folder / "tension.csv")
    fit = dm.fit_uniaxial(read_curves(options.tension or folder / "tension.csv"), noise="proportional")
    charts.fit(fit, options.tension is not None, folder / "fit.png")
    print(f"{fit.summary()}\n")
    materials = films.materials(None if options.tension is None else fit.material)
    film = replace(materials[films.GROWING], name="VHB" if options.tension is None else options.tension.stem)

    borne = films.borne(materials, np.append(np.geomspace(1.0, 604800.0, 9 if quick else 41), np.inf))
    charts.design(borne, folder / "design.png")
    tables.borne(materials)
    tables.margins(film)
    tables.haste(film)

    without, broken = films.ramp_map(film, 12 if quick else 90)
    charts.map_in_volts(without, broken, folder / "map.png")
    ramps = films.ramps(film, 13 if quick else 61)
    charts.ramps(ramps, folder / "ramps.png")
    tables.ramps(film)

    windows = decision.windows(film, np.linspace(0.05, 0.40, 8 if quick else 36))
    charts.windows(windows, folder / "windows.png")
    tables.windows(windows.sel(area_strain=[0.05, 0.10, 0.15, 0.20, 0.25, 0.30, 0.40], method="nearest"))
    decided = decision.decided(film)
    tables.decided(film, decided)
    tables.errors(film, decided)
    long, short = charts.held(film, decided * films.THIN, 61 if quick else 241, folder / "held.png")
    tables.after_fit(film, films.as_fitted(film, fit.material))

    rtols = agreement.RTOLS[::3] if quick else agreement.RTOLS
    agreed = agreement.measure(film.strength, 4 if quick else 25, rtols)
    charts.agreement(agreed, folder / "agreement.png")
    tables.agreement(agreed)

    data = {
        "design": borne,
        "ramps": ramps,
        "held_long": long,
        "held_short": short,
        "windows": windows,
        "agreement": agreed,
    }
    data |= {"map": broken[list(films.KEPT)]}
    for name, ds in data.items():
        ds.to_netcdf(folder / f"{name}.nc")
    print(describe_machine("NumPy", "SciPy", "Numba", "dea_maps"))


if __name__ == "__main__":
    main()
