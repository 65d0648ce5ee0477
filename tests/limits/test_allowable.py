"""The largest value of one parameter, where electrical breakdown may come before the instability."""

import dataclasses

import numpy as np
import pytest

import dea_maps as dm
from dea_maps.outcomes import Limit, Reason

WEAK = dataclasses.replace(dm.VHB, breakdown_strength=22e6)
FILM = {"material": WEAK, "thickness": 100e-6}


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
