"""The largest value of one parameter: next to a folded singularity, where films are unresolved, and by breakdown."""

import dataclasses

import numpy as np
import pytest

import dea_maps as dm
from dea_maps.limits import allowable
from dea_maps.outcomes import Limit, Outcome, Reason

WEAK = dataclasses.replace(dm.VHB, breakdown_strength=22e6)
FILM = {"material": WEAK, "thickness": 100e-6}


@pytest.mark.parametrize("fall_rate", [1e-3, 0.2])
def test_next_to_a_folded_singularity(fall_rate):
    """Largest stretches of films that just survive are too sensitive there for a small tolerance; outcomes are not.

    Held to another kernel, which goes through the program in steps of time.
    """
    others = {"rate": 20.0, "hold_time": 0.0, "fall_rate": fall_rate, "modulus_ratio": 4.0}
    found = dm.allowable(dm.Trapezoid(), "field", rtol=1e-10, **others)
    assert found.reason.item() == Reason.ANSWERED
    fields = found.allowable.item() * np.array([1 - 1e-8, 1 + 1e-8])
    ds = dm.sweep(dm.Trapezoid(), field=fields, **others, method="dop853", formulation="time", rtol=1e-9)
    assert ds.outcome.values.tolist() == [Outcome.SURVIVES, Outcome.FAILS_LATER]


@pytest.mark.parametrize(("upper", "reason"), [(1.1, Reason.UNRESOLVED), (1.0 + 1e-8, Reason.ANSWERED)])
def test_where_films_are_unresolved_at_every_tolerance(monkeypatch, upper, reason):
    def fates(program, films, *_):
        field = films["field"]
        outcome = np.select([field < 1.0, field < upper], [Outcome.SURVIVES, Outcome.UNRESOLVED], Outcome.FAILS_LATER)
        return {"outcome": outcome, "time_to_failure": np.where(field < upper, np.nan, 1.0)}

    monkeypatch.setattr(allowable, "_fates", fates)
    found = dm.allowable(dm.Pulse(), "field", width=[1.0, 2.0], modulus_ratio=4.0, rtol=1e-6)
    assert (found.reason == reason).all()
    expected = 1.0 if reason == Reason.ANSWERED else np.nan
    np.testing.assert_allclose(found.allowable, [expected, expected], rtol=1e-6)


def test_constant_voltages_are_those_of_a_design():
    """Found by another root finding, on the time to failure and the strength."""
    for seconds in (1.0, 600.0, np.inf):
        found = dm.allowable(dm.Step(), "voltage", lifetime_seconds=seconds, **FILM)
        expected = dm.design(WEAK, 100e-6, seconds)
        assert found.limit.item() == expected.limit.item()
        np.testing.assert_allclose(found.allowable_voltage, expected.allowable_voltage.item(), rtol=1e-5)


def test_a_strong_film_is_limited_by_its_instability():
    strong = dataclasses.replace(dm.VHB, breakdown_strength=1e9)
    found = dm.allowable(dm.Step(), "voltage", lifetime_seconds=600.0, material=strong, thickness=100e-6)
    bare = dm.allowable(dm.Step(), "voltage", lifetime_seconds=600.0, material=dm.VHB, thickness=100e-6)
    assert found.limit.item() == Limit.INSTABILITY
    assert found.allowable.item() == pytest.approx(bare.allowable.item(), rel=1e-6)
    assert "limit" not in bare


@pytest.mark.parametrize("cycles", [None, 3.0])
def test_just_above_it_a_film_breaks_down(cycles):
    train = {"period_seconds": 120.0, "duty": 0.5}
    found = dm.allowable(dm.PulseTrain(), "voltage", cycles=cycles, rtol=1e-4, **train, **FILM)
    assert (found.reason.item(), found.limit.item()) == (Reason.ANSWERED, Limit.BREAKDOWN)
    volts = found.allowable_voltage.item() * np.array([1 - 2e-4, 1 + 2e-4])
    below, above = dm.sweep(dm.PulseTrain(), voltage=volts, **train, **FILM).transpose("field").seconds_to_breakdown
    wanted = 120.0 * (np.inf if cycles is None else cycles)
    assert not below < wanted  # NaN: it never does
    assert above < wanted
