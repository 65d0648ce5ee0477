"""The table of pieces that the kernels take, read back as a field against time."""

import numpy as np
import pytest

import dea_maps as dm
from dea_maps.pieces import Hold, Jump, Linear, Share, Sine
from dea_maps.programs import (
    BiasedSine,
    Overdrive,
    Pulse,
    PulseTrain,
    Sequence,
    Trapezoid,
    TriangleTrain,
    Waveform,
)
from dea_maps.sweeps.loading import field_at, loading_time, repetition_starts, repetitions_before, table_of

VALUES = {
    "field": 1.2, "rate": 0.5, "hold_time": 2.0, "fall_rate": 2.0, "width": 1.5, "overdrive_field": 1.8,
    "overdrive_time": 0.5, "period": 2.0, "duty": 0.25, "bias": 1.0, "amplitude": 1.5, "modulus_ratio": 4.0,
}  # fmt: skip
TIMES = np.linspace(0.0, 11.0, 401) + 1e-3  # beside all jumps


def found(program, times=TIMES, **values):
    values = {**VALUES, **values}
    given = {name: np.array([values[name]]) for name in (*program.parameters, "modulus_ratio")}
    return field_at(program, given, times)[0]


# Formulas of the public interface, written out.
FORMULAS = {
    dm.Step(): lambda t, v: np.full(t.shape, v["field"]),
    dm.Ramp(): lambda t, v: v["rate"] * t,
    dm.RampHold(): lambda t, v: np.minimum(v["rate"] * t, v["field"]),
    Pulse(): lambda t, v: np.where(t < v["width"], v["field"], 0.0),
    Trapezoid(): lambda t, v: np.clip(
        np.minimum(v["rate"] * t, v["field"] - v["fall_rate"] * (t - v["field"] / v["rate"] - v["hold_time"])),
        0.0, v["field"],
    ),
    Overdrive(): lambda t, v: np.where(t < v["overdrive_time"], v["overdrive_field"], v["field"]),
    PulseTrain(): lambda t, v: np.where(t % v["period"] < v["duty"] * v["period"], v["field"], 0.0),
    TriangleTrain(): lambda t, v: v["field"] * (1.0 - abs(2.0 * (t % v["period"]) / v["period"] - 1.0)),
    BiasedSine(): lambda t, v: v["bias"] + v["amplitude"] * np.sin(2.0 * np.pi * t / v["period"]),
}  # fmt: skip


@pytest.mark.parametrize("program", FORMULAS, ids=lambda program: program.name)
def test_the_field_follows_the_formula_of_the_program(program):
    np.testing.assert_allclose(found(program), FORMULAS[program](TIMES, VALUES), rtol=0, atol=1e-12)


@pytest.mark.parametrize("repeat", [False, True])
def test_a_waveform_is_interpolated_held_or_repeated(repeat):
    times, values = [0.0, 1.0, 2.5, 3.0], [0.0, 1.0, -0.5, 0.25]
    at = TIMES % 3.0 if repeat else TIMES
    expected = 1.2 * np.interp(at, times, values)
    np.testing.assert_allclose(found(Waveform(times, values, repeat)), expected, rtol=0, atol=1e-12)


def test_a_sequence_repeated_some_times_holds_its_last_field():
    program = Sequence([Jump("x"), Hold(1.0), Jump(0.5), Hold(1.0)], repeat=3)
    got = found(program, np.array([0.5, 1.5, 4.5, 5.5, 6.5, 99.0]), x=2.0)
    np.testing.assert_allclose(got, [2.0, 0.5, 2.0, 0.5, 0.5, 0.5])


def test_a_repetition_begins_at_the_field_reached():
    program = Sequence([Linear("x", time=1.0), Hold(1.0), Linear(0.5, rate=1.5)], repeat=2)
    times = np.array([0.5, 1.5, 2.5, 3.0, 3.5, 4.5, 5.5, 6.5])
    np.testing.assert_allclose(found(program, times, x=2.0), [1.0, 2.0, 1.25, 0.5, 1.25, 2.0, 1.25, 0.5])
    assert loading_time(program, {"x": np.array([2.0]), "modulus_ratio": np.array([4.0])}) == 6.0


def test_a_repeated_hold_stays_at_the_field_reached():
    program = Sequence([Hold(1.0), Jump("x"), Hold(1.0)], repeat=True)
    np.testing.assert_allclose(found(program, np.array([0.5, 1.5, 2.5, 9.5]), x=2.0), [0.0, 2.0, 2.0, 2.0])
    train = Sequence([Jump("x"), Hold(1.0), Jump(0.0), Hold(1.0)], repeat=True)
    assert (table_of(program).once, table_of(train).once) == (2 + 1, 0)


def test_a_sine_begins_at_the_field_reached():
    program = Sequence([Linear(1.0, time=1.0), Sine(0.5, 4.0, cycles=1.25), Hold(1.0)])
    np.testing.assert_allclose(found(program, np.array([0.5, 1.0, 2.0, 4.0, 6.0, 6.5])), [0.5, 1.0, 1.5, 0.5, 1.5, 1.5])


def test_a_million_samples_take_one_column():
    program = Waveform(np.arange(1e6), np.ones(1_000_000))
    table = table_of(program)
    assert len(table.columns) == 2
    assert table.scale.shape == (999_999, 4)


def test_columns_are_shared_between_pieces():
    program = Sequence([Linear("x", rate="k"), Hold(Share("d", "T")), Linear(0.0, rate="k"), Hold(Share("d", "T"))])
    assert len(table_of(program).columns) == 5  # 1, x, up, the share, down


def test_repetitions_by_time_where_the_first_is_longer():
    program = Sequence([Linear("field", rate=1.0), Hold(1.0), Linear(0.5, rate=1.0)], repeat=True)
    given = {name: np.full(4, value) for name, value in {"field": 1.5, "modulus_ratio": 4.0}.items()}
    # The first takes 1.5 + 1 + 1, each of the others 1 + 1 + 1.
    np.testing.assert_allclose(repetition_starts(program, given, np.array([0.0, 1.0, 2.0, 3.0])), [0.0, 3.5, 6.5, 9.5])
    np.testing.assert_array_equal(repetitions_before(program, given, np.array([0.0, 3.4, 3.6, 9.6])), [0, 0, 1, 3])
