"""The certified reference tables: unharmed, complete, and, for a few points, computed again."""

import importlib
import math
import sys
from fractions import Fraction
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

FOLDER = Path(__file__).parents[1] / "reference"
PROGRAMS = ("step", "ramp", "ramp_hold")
#: Regimes of the load that each table must hold.
REGIMES = {
    "step": {
        "below",
        "just_below_critical",
        "critical",
        "bottleneck",
        "middle",
        "almost_at_once",
        "instant_limit",
        "at_once",
    },
    "ramp": {"very_slow", "slow", "comparable", "fast"},
    "ramp_hold": {
        f"{ramp}_ramp_{load}"
        for ramp in ("very_slow", "slow", "comparable", "fast")
        for load in ("just_below_critical", "critical", "bottleneck", "fails_rising")
    }
    | {"comparable_ramp_middle", "fast_ramp_middle"},
}
FILMS = {"elastic", "nearly_elastic", "moderate", "large"}


@pytest.fixture(scope="module")
def module():
    """Import the modules of the generator, which are no package."""
    sys.path.insert(0, str(FOLDER))
    yield importlib.import_module
    sys.path.remove(str(FOLDER))


@pytest.fixture(scope="module")
def table(module) -> ModuleType:
    return module("table")


@pytest.mark.parametrize("program", PROGRAMS)
def test_table_is_complete(table, program):
    data = table.load(program)
    assert len(data["outcome"]) >= 300
    loads, films = (set(part) for part in zip(*(name.split("/") for name in data["regime"]), strict=True))
    assert loads >= REGIMES[program]
    assert films == FILMS
    m, outcome = data["modulus_ratio"], data["outcome"]
    assert m.min() == 1 and m.max() == 1000
    if "rate" in data:
        assert data["rate"].min() == 1e-6 and data["rate"].max() == 1e5
    failing = outcome > 0
    for name in ("time_to_failure", "critical_stretch", "critical_internal_stretch", "critical_field"):
        assert np.array_equal(np.isfinite(data[name]), failing)
    assert np.array_equal(np.isfinite(data["final_stretch"]), ~failing)
    assert np.all(data["agreed_digits"] >= 24)
    assert np.all(data["condition_stretch"] >= 0)
    assert np.all(data["critical_field"][failing] <= 1.5 * np.sqrt(m[failing]))


@pytest.mark.parametrize("program", PROGRAMS)
def test_outcomes_follow_the_exact_rules(table, program):
    for row in table.read(program):
        m = Fraction(float(row["modulus_ratio"]))
        field = Fraction(float(row["field"])) if row["field"] else None
        if program == "step" and field**2 >= m:
            expected = 2
        elif field is not None and (field < 1 or (field == 1 and m > 1)):
            expected = 0
        else:
            expected = 1
        assert int(row["outcome"]) == expected, row


@pytest.mark.parametrize("program", PROGRAMS)
def test_numbers_read_back_to_the_same_doubles(table, program):
    for row in table.read(program):
        for name in table.INPUTS:
            assert not row[name] or repr(float(row[name])) == row[name]


def test_class_boundaries_are_there(table):
    step = table.load("step")
    for m in (2.0, 3.85, 4.0, 1000.0):
        root = math.sqrt(m)
        here = set(step["field"][step["modulus_ratio"] == m])
        assert here >= {1.0, 1 + 1e-12, 1 - 1e-12, math.nextafter(1, 0), math.nextafter(1, 2)}
        assert here >= {root, math.nextafter(root, 0), math.nextafter(root, 10 * m), root * (1 - 1e-12)}


def test_both_sides_of_corners_are_there(module, table):
    """Ramps held just above and just below the field at which they fail."""
    rows = [row for row in table.read("ramp_hold") if float(row["field"]) > 1]
    for m, rate in module("points").CORNERS:
        here = [row for row in rows if (float(row["modulus_ratio"]), float(row["rate"])) == (m, rate)]
        fails_rising = {"fails_rising" in row["regime"] for row in here}
        assert fails_rising == {True, False}, (m, rate)


def test_a_changed_table_is_refused(table, tmp_path, monkeypatch):
    text = (FOLDER / "ramp.csv").read_text(encoding="utf-8")
    monkeypatch.setattr(table, "FOLDER", tmp_path)
    for harmed in (text.replace(",1,1", ",1,2", 1), text[:-1], text.replace("sha256", "sha-256")):
        (tmp_path / "ramp.csv").write_text(harmed, encoding="utf-8")
        with pytest.raises(ValueError, match="does not match its hash"):
            table.read("ramp")


@pytest.mark.parametrize(
    ("program", "regime"),
    [
        ("step", "middle/moderate"),
        ("step", "almost_at_once/large"),
        ("step", "bottleneck/nearly_elastic"),
        ("ramp", "fast/moderate"),
        ("ramp_hold", "fast_ramp_middle/moderate"),
    ],
)
def test_a_row_of_the_table_is_found_again(module, table, program, regime):
    stored = next(row for row in table.read(program) if row["regime"] == regime)
    assert module("generate").confirmed(program, stored)


@pytest.mark.parametrize(
    ("field", "time", "stretch"),
    [
        ("1.01", "26.29974290", "1.836637644"),
        ("1.05", "9.028237529", "1.794411933"),
        ("1.1", "5.063810275", "1.745635208"),
        ("1.2", "2.443625636", "1.659354969"),
        ("1.5", "0.5463781327", "1.464347835"),
        ("1.9", "0.04174466466", "1.292932009"),
    ],
)
def test_steps_known_from_elsewhere(module, field, time, stretch):
    model, outcomes = module("model"), module("outcomes")
    inputs = model.Inputs("step", Fraction(4), field=Fraction(field))
    for solve in (outcomes.failure_a, outcomes.failure_b):
        results = outcomes.results_of(solve(inputs))
        assert float(results.time) == pytest.approx(float(time), rel=1e-9)
        assert float(results.stretch) == pytest.approx(float(stretch), rel=1e-9)


@pytest.mark.parametrize(
    ("rate", "time", "stretch"),
    [
        ("0.001", "1020.124077", "1.825660206"),
        ("0.01", "107.7277738", "1.767283822"),
        ("0.1", "12.44370088", "1.625152786"),
        ("1", "1.581172717", "1.423228766"),
        ("100", "0.01987195524", "1.263978016"),
    ],
)
def test_ramps_known_from_elsewhere(module, rate, time, stretch):
    model, outcomes = module("model"), module("outcomes")
    results = outcomes.results_of(outcomes.failure_b(model.Inputs("ramp", Fraction(4), rate=Fraction(rate))))
    assert float(results.time) == pytest.approx(float(time), rel=1e-9)
    assert float(results.stretch) == pytest.approx(float(stretch), rel=1e-9)
    assert float(results.field) == pytest.approx(float(time) * float(rate), rel=1e-9)
