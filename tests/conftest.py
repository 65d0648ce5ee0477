"""Data sets that the tests of charts share; programs that tests define are forgotten."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import settings

import dea_maps as dm
from dea_maps import programs

settings.register_profile("without_deadline", deadline=None)  # no test depends on how busy the machine is
settings.load_profile("without_deadline")


@pytest.fixture
def defines_programs():
    """Forget the programs that a test defines."""
    known = set(programs.PROGRAMS)
    yield
    for name in set(programs.PROGRAMS) - known:
        del programs._DEFINED[name]


@pytest.fixture(scope="session")
def step():
    """A map of films under a step."""
    return dm.sweep(dm.Step(), field=np.linspace(0.7, 2.5, 37), modulus_ratio=np.linspace(1.5, 6.0, 31))


@pytest.fixture(scope="session")
def cube():
    """A map of three parameters."""
    fields, rates = np.linspace(0.8, 2.2, 15), np.geomspace(1e-3, 1e3, 15)
    return dm.sweep(dm.RampHold(), field=fields, rate=rates, modulus_ratio=[2.0, 3.85, 6.0, 10.0])


@pytest.fixture(scope="session")
def ramp():
    """Ramps, of few films."""
    return dm.sweep(dm.Ramp(), rate=np.geomspace(1e-3, 1e3, 31), modulus_ratio=[1.5, 2.0, 4.0, 8.0])


@pytest.fixture(scope="session")
def films():
    """Trajectories, one of a film that survives."""
    return dm.trajectory(dm.Step(), time=np.linspace(0, 8, 81), field=[0.9, 1.1, 1.5, 2.1], modulus_ratio=4.0)


@pytest.fixture(scope="session")
def designed():
    """Allowable voltages of films, of which the last has none."""
    time, films = np.geomspace(1.0, 1e9, 31), ["VHB, 100 um", "VHB, 50 um", "another, 50 um", "none, 1 um"]
    voltage = np.outer([1600.0, 800.0, 790.0, np.nan], 1.0 + 0.9 / np.sqrt(1.0 + time / 200.0))
    limit = np.ones(voltage.shape, np.int8)
    limit[0, :8] = 2
    flags = {"flag_values": np.arange(4, dtype=np.int8), "flag_meanings": "none instability breakdown unresolved"}
    dims = ("film", "holding_time")
    return xr.Dataset(
        {"allowable_voltage": (dims, voltage), "limit": (dims, limit, flags)}, {"film": films, "holding_time": time}
    )


@pytest.fixture(scope="session")
def pulses():
    """Films under repeated pulses."""
    fields, duties = np.linspace(0.9, 2.1, 13), np.array([0.2, 0.35, 0.5, 0.8])
    return dm.sweep(dm.PulseTrain(), field=fields, period=1.0, duty=duties, modulus_ratio=4.0)


@pytest.fixture(scope="session")
def cycled():
    """A film in the first three cycles and in a late one."""
    times = np.concatenate([np.linspace(0.0, 3.0, 121), np.linspace(60.0, 61.0, 41)])
    return dm.trajectory(dm.TriangleTrain(), time=times, field=1.4, period=1.0, modulus_ratio=4.0)
