"""The loading programs by name, for studies that go through all of them."""

import dea_maps as dm

PROGRAMS = {"step": dm.Step(), "ramp": dm.Ramp(), "ramp_hold": dm.RampHold()}
