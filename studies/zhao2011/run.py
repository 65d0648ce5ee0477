"""The figures of Zhao, Koh and Suo (2011) computed anew, with the claims of the text beside what is computed.

    python studies/zhao2011/run.py [--quick] [--output FOLDER]

writes, in out/zhao2011 unless told where, mechanics.png (Figs. 2 and 4), constant_field.png (Fig. 5(b)), ramps.png
(Fig. 6(b)-(d)) and zhao2011.nc, and prints the table of claims of README.md.
"""

import sys
from pathlib import Path

sys.path.insert(1, str(Path(__file__).resolve().parents[1]))

import charts
import numpy as np
import scenes
import xarray as xr
from common.machine import describe_machine
from common.options import study_parser

COMPARED = (1.01, 1.05, 1.2, 1.5, 1.9)  # fields at which both models are solved


def main() -> None:
    """Compute, draw, write, print."""
    options = study_parser(__file__, __doc__, quick="fewer points on every curve").parse_args()
    nodes, compared = (60, (1.2,)) if options.quick else (400, COMPARED)

    mechanics = xr.merge([scenes.relaxation(nodes), scenes.tension(nodes)], compat="override")
    held = scenes.constant_field(nodes)
    ramp = scenes.ramps(nodes // 2)
    charts.mechanics(mechanics, options.output / "mechanics.png")
    charts.constant_field(held, options.output / "constant_field.png")
    charts.ramps(ramp, options.output / "ramps.png")

    claims = scenes.claims(ramp)
    data = xr.merge([mechanics, held, ramp], compat="override", combine_attrs="drop")
    for name in ("says", "computed"):
        data[f"claim_{name}"] = ("claim", [getattr(claim, name) for claim in claims])
    data["claim_holds"] = ("claim", np.array([claim.holds for claim in claims], np.int8))
    data.attrs = {"title": "Figures of Zhao, Koh and Suo (2011) computed from its equations"}
    data.to_netcdf(options.output / "zhao2011.nc")

    print("| where | the paper | its equations | holds |\n|---|---|---|---|")
    for claim in claims:
        print("|", " | ".join([claim.where, claim.says, claim.computed, "yes" if claim.holds else "no"]), "|")
    apart = scenes.full_against_reduced(compared)
    print(f"\nfive states against one equibiaxial film, at failure: {apart:.1e} at worst\n")
    print(describe_machine("NumPy", "SciPy", "dea_maps"))


if __name__ == "__main__":
    main()
