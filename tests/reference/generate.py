"""Compute the certified reference tables, or check the stored ones.

python tests/reference/generate.py                       all tables anew
python tests/reference/generate.py --program step        one of them
python tests/reference/generate.py --check 20            20 rows of each table computed again and compared

Needs mpmath; gmpy2, if installed, makes it several times faster and changes no digit.
"""

import argparse
import sys

import outcomes
import table
from model import Inputs, mp
from points import exact, points, regime


def row_of(inputs: Inputs, point: dict[str, float]) -> dict[str, str]:
    """Return the row of a point as text."""
    certified = outcomes.certify(inputs)
    results = certified.results
    row = {name: repr(value) for name, value in point.items()}
    row |= {"outcome": str(certified.outcome), "regime": regime(inputs, certified.before_hold)}
    row["agreed_digits"] = str(int(certified.digits))
    for name, value in zip(table.RESULTS, vars(results).values(), strict=True):
        if value is not None:
            row[name] = mp.nstr(value, outcomes.STORED_DIGITS, strip_zeros=True, min_fixed=-4, max_fixed=22)
    for name, value in certified.conditions.items():
        row[f"condition_{name}"] = f"{float(value):.3e}"
    return row


def generate(program: str) -> None:
    """Compute a table and write it."""
    wanted = points(program)
    rows = []
    for number, point in enumerate(wanted, 1):
        rows.append(row_of(exact(program, point), point))
        if number % 20 == 0 or number == len(wanted):
            print(f"{program}: {number} of {len(wanted)}", file=sys.stderr, flush=True)
    worst = min(int(row["agreed_digits"]) for row in rows)
    notes = [
        f"dea_maps reference: {len(rows)} scenes of the program {program!r}, certified by two formulations",
        f"made by: python tests/reference/generate.py --program {program}",
        f"working precision: {mp.dps} digits; the formulations agree on {worst} digits or more in every row,",
        f"results are rounded to {outcomes.STORED_DIGITS}; inputs are doubles, their exact values are meant",
        "outcome: 0 survives, 1 fails_later, 2 fails_at_once; units: tau, E/Ec, stretches plain",
        "condition_*: relative change of a result per relative change of an input, largest over the inputs",
    ]
    table.write(program, notes, rows)


def confirmed(program: str, stored: dict[str, str]) -> bool:
    """Compute a row again; return whether inputs, outcome and results are what is stored."""
    point = {name: float(stored[name]) for name in table.INPUTS if stored[name]}
    found = row_of(exact(program, point), point)
    return all(found.get(name, "") == stored[name] for name in (*table.INPUTS, "outcome", *table.RESULTS))


def check(program: str, count: int) -> int:
    """Compute rows spread over a table again; return how many differ from what is stored."""
    rows = table.read(program)
    chosen = rows[:: max(1, len(rows) // count)][:count]
    differing = [row for row in chosen if not confirmed(program, row)]
    for row in differing:
        print(f"{program}: not confirmed: {row}")
    print(f"{program}: {len(chosen) - len(differing)} of {len(chosen)} rows confirmed")
    return len(differing)


def main() -> int:
    """Run the command line."""
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    parser.add_argument("--program", choices=table.PROGRAMS, help="one table only")
    parser.add_argument("--check", type=int, metavar="N", help="compare N rows of each table, write nothing")
    options = parser.parse_args()
    programs = [options.program] if options.program else table.PROGRAMS
    if options.check is not None:
        return 1 if sum(check(program, max(1, options.check)) for program in programs) else 0
    for program in programs:
        generate(program)
    return 0


if __name__ == "__main__":
    sys.exit(main())
