"""Charts of every kind: what they show, in what units, and what is refused."""

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_rgb
from matplotlib.contour import ContourSet

import dea_maps as dm
from dea_maps import charts
from dea_maps.charts.boundaries import boundary_of, limits_of
from dea_maps.sweeps.dead_load import film_of, relaxed_threshold


def physical(ds):
    return dm.physical(ds, dm.VHB, 100e-6)


def test_volts_and_seconds(step):
    ax = charts.phase_diagram(physical(step))
    assert (ax.get_xlabel(), ax.figure.axes[1].get_ylabel()) == ("voltage (kV)", "time to failure (s)")
    assert {"100 s", "1000 s"} <= {text.get_text() for text in ax.texts}
    assert ax.get_title(loc="left").replace("\n", " ") == "step to a held voltage, VHB, 100 µm"
    plain = charts.phase_diagram(physical(step), units="tau")
    assert plain.get_xlabel() == "field $E/E_c$"
    assert plain.get_title(loc="left").replace("\n", " ") == "step to a held field"
    thin = dm.physical(step, dm.VHB, 10e-6)
    assert charts.phase_diagram(thin).get_xlabel() == "voltage (V)"


@pytest.mark.parametrize("thickness", [None, 50e-6])
def test_boundaries_are_those_of_the_theory(step, thickness):
    coarse = step.isel(field=slice(None, None, 9), modulus_ratio=slice(None, None, 10))
    unit = 1.0
    if thickness is not None:
        coarse, unit = dm.physical(coarse, dm.VHB, thickness), dm.VHB.critical_field * thickness / 1e3
    survived, at_once = charts.phase_diagram(coarse).lines
    np.testing.assert_allclose(survived.get_xdata(), unit, rtol=1e-12)
    np.testing.assert_allclose(at_once.get_xdata() / unit, np.sqrt(at_once.get_ydata()), rtol=1e-12)


def test_isochrones_go_through_their_times():
    fields, rates = np.linspace(0.8, 2.2, 100), np.geomspace(1e-3, 1e3, 100)
    ds = dm.sweep(dm.RampHold(), field=fields, rate=rates, modulus_ratio=6.0)
    logs = np.log10(ds.time_to_failure)
    lines = [artist for artist in charts.phase_diagram(ds).collections if isinstance(artist, ContourSet)]
    assert [float(line.levels[0]) for line in lines] == [0.0, 1.0, 2.0]  # others have no room for their words
    assert [[text.get_text() for text in line.labelTexts] for line in lines] == [["1"], ["10"], ["100"]]
    for line in lines:
        points = line.get_paths()[0].vertices
        middles = 0.5 * (points[1:] + points[:-1])
        field, rate = (xr.DataArray(column, dims="point") for column in middles.T)
        found = logs.interp(field=field, rate=rate)
        assert (np.abs(found.dropna("point").values - line.levels[0]) < 0.1).all()


@pytest.mark.parametrize("dead_load", [{}, {"prestretch": 1.5}, {"stress": 0.4}], ids=["none", "prestretch", "stress"])
@pytest.mark.parametrize(
    ("program", "parameter", "others"),
    [
        (dm.Step(), "field", {}),
        (dm.RampHold(), "field", {"rate": 1.0}),
        (dm.Pulse(), "width", {"field": 1.4}),
        (dm.Overdrive(), "field", {"overdrive_field": 1.3, "overdrive_time": 1.0}),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_limits_are_where_sweeps_change(program, parameter, others, dead_load):
    _, _, load = film_of(
        {"modulus_ratio": np.ones(1), **{name: np.array([value]) for name, value in dead_load.items()}}
    )
    threshold = float(relaxed_threshold(load)[0])
    others = {name: value * (threshold if "field" in name else 1.0) for name, value in others.items()}
    film = {name: np.array([value]) for name, value in {**others, "modulus_ratio": 4.0, **dead_load}.items()}
    survived, at_once, rtol = limits_of(program, parameter, film)
    near = 1.0 + 2.0 * rtol * np.array([-1.0, 1.0])
    sides = [survived * near] + ([at_once * near] if np.isfinite(at_once) else [])
    outcomes = [dm.sweep(program, **{parameter: side}, modulus_ratio=4.0, **others, **dead_load) for side in sides]
    assert [ds.outcome.values.tolist() for ds in outcomes] == [[0, 1], [1, 2]][: len(sides)]
    assert np.isfinite(at_once) == (program == dm.Step())


def test_a_map_that_the_theory_does_not_bound_is_drawn_cell_by_cell(step):
    other = step.copy(deep=True)
    other.outcome[2, 3] = 2
    assert boundary_of(step, ("field", "modulus_ratio")) is not None
    assert boundary_of(other, ("field", "modulus_ratio")) is None
    assert not charts.phase_diagram(other).lines
    assert not charts.phase_diagram(step.assign_attrs(program="pulse")).lines  # lacks its width


def test_breakdown_has_a_region(step):
    first = ((step.field > 1.2) & (step.modulus_ratio > 4.0)).astype(np.int8) * 2
    flags = {"flag_values": np.arange(4, dtype=np.int8), "flag_meanings": "none instability breakdown unresolved"}
    ds = step.assign(first_limit=first.assign_attrs(flags), breakdown_stretch=1.1 * step.critical_stretch)
    for chart in (charts.phase_diagram, charts.stretch_chart):
        (name,) = [text for text in chart(ds).texts if text.get_text() == "breaks down first"]
        x, y = name.get_position()
        assert x > 1.2
        assert y > 4.0


def test_curves_at_failure(ramp):
    ax = charts.failure_curves(ramp, variable="critical_stretch")
    curves = [line for line in ax.lines if line.get_marker() != "None"]
    assert [line.get_label() for line in curves] == ["1.5", "2", "4", "8"]
    np.testing.assert_array_equal(curves[2].get_ydata(), ramp.critical_stretch.sel(modulus_ratio=4.0))
    assert ax.get_xscale() == "log"
    (limit,) = [line for line in ax.lines if line not in curves]
    np.testing.assert_allclose(limit.get_ydata(), 2 ** (1 / 3))
    fields = charts.failure_curves(physical(ramp), variable="critical_field")
    levels = {round(float(line.get_ydata()[0]), 9) for line in fields.lines if line.get_linestyle() != "-"}
    unit = dm.VHB.critical_field * 100e-6 / 1e3
    assert levels == {round(unit * level, 9) for level in (1.0, *np.sqrt([1.5, 2.0, 4.0, 8.0]))}


def test_curves_over_the_other_parameter(step):
    ax = charts.failure_curves(step, over="modulus_ratio")
    assert ax.get_xlabel() == r"modulus ratio $\mu_U/\mu_R$"
    assert ax.get_legend().get_title().get_text() == "field $E/E_c$"
    assert len([line for line in ax.lines if line.get_marker() != "None"]) == 6


def test_curves_differ_in_grey(step):
    curves = [line for line in charts.failure_curves(step).lines if line.get_marker() != "None"]
    assert len({line.get_marker() for line in curves}) == len(curves) == 6
    luminance = [np.dot([0.2126, 0.7152, 0.0722], to_rgb(line.get_color())) for line in curves]
    assert (np.diff(luminance) > 0.03).all()
    assert max(luminance) < 0.8


def test_stretches_jump_at_the_critical_field(step):
    ax = charts.stretch_chart(step.sel(modulus_ratio=3.0, method="nearest"))
    at_failure, relaxed = ax.lines
    assert (at_failure.get_label(), relaxed.get_label()) == ("at failure", "fully relaxed")
    assert np.nanmax(relaxed.get_ydata()) < 1.26
    assert np.nanmax(at_failure.get_ydata()) > 1.6


def test_trajectories_end_in_their_failure(films):
    ax = charts.trajectories(physical(films))
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time (min)", r"stretch $\lambda$")
    crosses = [line for line in ax.lines if line.get_marker() == "x"]
    failed = physical(films).isel(field=slice(1, None))
    found = np.array([(*line.get_xdata(), *line.get_ydata()) for line in crosses])
    np.testing.assert_allclose(found[:, 0], failed.seconds_to_failure / 60.0)
    np.testing.assert_allclose(found[:, 1], failed.critical_stretch)
    curves = [line for line in ax.lines if line.get_marker() != "x"]
    assert [curve.get_label() for curve in curves] == ["1.448", "1.77", "2.413", "3.379"]
    assert curves[1].get_xdata()[-1] == crosses[0].get_xdata()[0]
    assert charts.trajectories(physical(films), variable="true_field").get_ylabel() == "true field (MV/m)"
    assert charts.trajectories(films, variable="margin").get_ylabel().startswith("margin")


def test_trajectories_end_in_their_breakdown(films):
    ds = physical(dm.breakdown(films, lambda stretch: 1.6 * stretch**0.5))
    assert ds.first_limit.values.tolist() == [0, 2, 2, 2]
    assert ds.time_to_breakdown.values[-1] == 0.0
    for variable, at_end in (("stretch", "breakdown_stretch"), ("applied_field", "breakdown_voltage")):
        ax = charts.trajectories(ds, variable=variable)
        stars = [line for line in ax.lines if line.get_marker() == "*"]
        np.testing.assert_allclose([*(s.get_xdata()[0] for s in stars)], ds.seconds_to_breakdown.values[1:] / 60.0)
        unit = 1e3 if variable == "applied_field" else 1.0
        np.testing.assert_allclose([*(s.get_ydata()[0] for s in stars)], ds[at_end].values[1:] / unit)
        ends = [line.get_xdata()[-1] for line in ax.lines if line.get_marker() != "*"]
        np.testing.assert_allclose(ends[1:], ds.seconds_to_breakdown.values[1:] / 60.0)
        assert [text.get_text() for text in ax.get_legend().get_texts()][-1] == "electrical breakdown"
    margins = [line for line in charts.trajectories(ds, variable="margin").lines if line.get_marker() == "*"]
    near = films.margin[1].interp(time=ds.time_to_breakdown.values[1])
    np.testing.assert_allclose([line.get_ydata()[0] for line in margins], near, rtol=1e-12)


def test_times_over_decades_are_logarithmic():
    times = np.concatenate([[0.0], np.geomspace(1e-2, 1e2, 41)])
    ds = dm.trajectory(dm.RampHold(), time=times, field=[0.9, 1.2], rate=[0.1, 10.0], modulus_ratio=4.0)
    ax = charts.trajectories(ds)
    assert ax.get_xscale() == "log"
    words = [text.get_text() for text in ax.get_legend().get_texts()]
    assert words == ["0.9, 0.1", "0.9, 10", "1.2, 0.1", "1.2, 10", "failure"]


def test_design(designed):
    ax = charts.design_chart(designed)
    assert (ax.get_xlabel(), ax.get_ylabel(), ax.get_xscale()) == ("holding time (s)", "allowable voltage (kV)", "log")
    assert [text.get_text() for text in ax.texts] == ["VHB, 100 µm", "VHB, 50 µm", "another, 50 µm"]
    legend = [text.get_text() for text in ax.get_legend().get_texts()]
    assert legend == ["limited by instability", "by electrical breakdown", "none, 1 µm: no answer"]
    drawn = [line for line in ax.lines if line.is_dashed() and np.isfinite(line.get_ydata()).any()]
    assert len(drawn) == 1
    assert np.isfinite(drawn[0].get_ydata()).sum() == 8


def with_good(designed):
    """Return a design with the indefinitely sustained voltages, which come first there."""
    good = designed.isel(holding_time=[-1]).assign_coords(holding_time=[np.inf])
    return xr.concat([good.assign(allowable_voltage=0.9 * good.allowable_voltage), designed], "holding_time")


def test_what_is_sustained_indefinitely_is_at_the_right_edge(designed):
    ax = charts.design_chart(with_good(designed))
    assert ax.get_xlim() == (1.0, 1e9)
    marks = [line for line in ax.lines if line.get_marker() == ">"]
    levels = designed.allowable_voltage.values[:3, -1] * 0.9 / 1e3
    np.testing.assert_allclose([line.get_ydata()[0] for line in marks], levels)
    assert {tuple(line.get_xdata()) for line in marks} == {(1.0,)}
    assert marks[0].get_transform() == ax.get_yaxis_transform()
    low, high = ax.get_ylim()
    assert low < levels.min() < levels.max() < high
    assert "indefinitely" in [text.get_text() for text in ax.get_legend().get_texts()]
    only = with_good(designed).isel(holding_time=[0, 0])
    with pytest.raises(ValueError, match="a design chart needs two finite holding times or more; got 0"):
        charts.design_chart(only)


def test_long_names_of_films_are_in_the_legend(designed):
    names = [f"VHB, strength 30.6 lambda^1.13, {H} um" for H in (100, 50, 25, 12)]
    ax = charts.design_chart(designed.assign_coords(film=names))
    assert not ax.texts
    shown = [text.get_text() for text in ax.get_legend().get_texts()][:3]
    assert shown == [name.replace("um", "µm") for name in names[:3]]
    assert ax.get_window_extent().width > 0.7 * ax.figure.bbox.width
    assert ax.get_window_extent().height > 0.4 * ax.figure.bbox.height


def test_the_boundary_of_repeated_pulses_is_that_of_allowable(pulses):
    survived, at_once = charts.phase_diagram(pulses).lines
    duty = np.array([0.25, 0.6])
    wanted = dm.allowable(dm.PulseTrain(), "field", period=1.0, duty=duty, modulus_ratio=4.0).allowable
    found = np.interp(duty, survived.get_ydata(), survived.get_xdata())
    np.testing.assert_allclose(found, wanted, rtol=5e-3)
    np.testing.assert_allclose(at_once.get_xdata(), 2.0, rtol=1e-12)


def test_a_boundary_may_be_that_of_the_parameter_upwards():
    period, duty = np.geomspace(0.5, 5.0, 4), np.linspace(0.1, 0.9, 9)
    ds = dm.sweep(dm.PulseTrain(), field=1.4, period=period, duty=duty, modulus_ratio=4.0)
    ax = charts.phase_diagram(ds)
    assert (ax.get_xscale(), ax.get_ylabel()) == ("log", "duty $d$")
    wanted = dm.allowable(dm.PulseTrain(), "duty", field=1.4, period=period, modulus_ratio=4.0).allowable
    found = np.interp(np.log(period), *np.log(ax.lines[0].get_data()))
    np.testing.assert_allclose(np.exp(found), wanted, rtol=5e-3)


def test_few_values_are_curves_of_points(pulses):
    few = pulses.isel(duty=[0, 2], field=slice(None, None, 2))
    (ax,) = charts.draw(few).axes
    assert ax.get_xlabel() == "field $E/E_c$"
    curves = [line for line in ax.lines if line.get_marker() in "os"]
    assert [curve.get_label() for curve in curves] == ["0.2", "0.5"]
    assert {curve.get_linestyle() for curve in curves} == {"--"}  # as Matplotlib calls a pattern of dots
    assert curves[0].get_markevery() is None
    assert len(charts.draw(few, chart="phase_diagram").axes) == 2  # if the user asks for it


def test_cycles_to_failure(pulses):
    ax = charts.cycles_chart(pulses)
    assert (ax.get_xscale(), ax.get_yscale(), ax.get_ylabel()) == ("log", "log", "field $E/E_c$")
    curves = {line.get_label(): line for line in ax.lines if line.get_label()[0] != "_"}
    cycles = pulses.cycles_to_failure.sel(duty=0.5)
    np.testing.assert_array_equal(curves["0.5"].get_xdata(), cycles.where(cycles >= 1.0).dropna("field"))
    levels = [line.get_ydata()[0] for line in ax.lines if line.get_linestyle() == "--" and len(line.get_xdata()) == 2]
    wanted = dm.allowable(dm.PulseTrain(), "field", period=1.0, duty=pulses.duty, modulus_ratio=4.0).allowable
    np.testing.assert_allclose(levels[-4:], wanted, rtol=3e-3)


def test_loops_end_in_the_limit_cycle(cycled):
    ax = charts.hysteresis_loops(physical(cycled), cycles=2)
    first, second, last = ax.lines
    assert [line.get_label() for line in ax.lines] == ["cycle 1", "cycle 2", "limit cycle"]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("voltage (kV)", r"stretch $\lambda$")
    assert len(first.get_xdata()) == len(second.get_xdata()) == len(last.get_xdata()) == 41
    np.testing.assert_allclose(last.get_ydata().max(), cycled.steady_stretch_max, rtol=1e-4)
    assert (first.get_xdata()[-1], first.get_ydata()[-1]) == (second.get_xdata()[0], second.get_ydata()[0])
    early = charts.hysteresis_loops(cycled.sel(time=slice(0.0, 3.0)), cycles=2)
    assert early.lines[-1].get_label() == "cycle 3"


def test_loops_end_in_their_failure():
    ds = dm.trajectory(dm.TriangleTrain(), time=np.linspace(0, 4, 161), field=1.75, period=1.0, modulus_ratio=4.0)
    ax = charts.hysteresis_loops(ds)
    (cross,) = [line for line in ax.lines if line.get_marker() == "x"]
    assert (cross.get_xdata()[0], cross.get_ydata()[0]) == (ds.critical_field, ds.critical_stretch)
    assert ax.lines[-2].get_xdata()[-1] == ds.critical_field


def test_the_program_is_drawn_at_the_middle(pulses):
    ax = charts.program_chart(physical(pulses))
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time (s)", "voltage (kV)")
    time, voltage = ax.lines[0].get_data()
    assert voltage.max() == pytest.approx(1.5 * dm.VHB.critical_field * 100e-6 / 1e3)
    within = (time > 0.0) & (time < dm.VHB.relaxation_time)
    assert np.mean(voltage[within] > 0.0) == pytest.approx(0.5, abs=0.01)
    (picture,) = charts.phase_diagram(pulses).child_axes
    assert picture.lines[0].get_ydata().max() == 1.5


@pytest.mark.parametrize("chart", charts.CHARTS)
def test_the_user_chooses(chart, step, films, designed, pulses, cycled, tmp_path):
    known = {"trajectories": films, "design_chart": designed, "cycles_chart": pulses, "hysteresis_loops": cycled}
    ds = known.get(chart, step)
    charts.plot(ds, tmp_path / "chart.png", chart=chart)
    assert (tmp_path / "chart.png").stat().st_size > 5000


def test_auto_suits_the_data_set(films, designed):
    assert charts.draw(films).axes[0].get_xlabel() == r"time $t/\tau$"
    assert charts.draw(designed).axes[0].get_xlabel() == "holding time (s)"


def test_axes_are_saved_as_their_figure(step, tmp_path):
    charts.save(charts.phase_diagram(step), tmp_path / "chart.pdf")
    assert (tmp_path / "chart.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("call", "kind", "message"),
    [
        (lambda ds: charts.draw(ds, chart="pie"), ValueError, "chart must be one"),
        (lambda ds: charts.draw(ds, size="poster"), ValueError, "size must be one of column, slide; got 'poster'"),
        (lambda ds: charts.draw(3), TypeError, "ds must be a data set; got 3"),
        (lambda ds: charts.phase_diagram(ds, 3), TypeError, "ax must be a Matplotlib Axes or None; got 3"),
        (lambda ds: charts.phase_diagram(ds, units="si"), ValueError, "units must be tau for a data set without volts"),
        (lambda ds: charts.phase_diagram(ds, units="cgs"), ValueError, "units must be one of tau, si; got 'cgs'"),
        (lambda ds: charts.failure_curves(ds, variable="outcome"), ValueError, "variable must be one of time_to_fail"),
        (lambda ds: charts.failure_curves(ds, over="rate"), ValueError, "over must be one of field, modulus_ratio"),
        (lambda ds: charts.stretch_chart(ds.drop_vars("final_stretch")), ValueError, "needs the"),
        (charts.trajectories, ValueError, "a chart of trajectories needs the variable time"),
        (charts.design_chart, ValueError, "a design chart needs the variable allowable_voltage"),
        (charts.cycles_chart, ValueError, "a chart of cycles to failure needs the variable cycles_to_failure"),
        (charts.hysteresis_loops, ValueError, "a chart of hysteresis loops needs the variable time"),
        (lambda ds: charts.program_chart(ds.drop_vars("field")), ValueError, "needs the parameter field"),
    ],
)
def test_what_cannot_be_is_refused(call, kind, message, step):
    with pytest.raises(kind, match=message):
        call(step)


def test_trajectories_need_times_and_a_variable(films):
    with pytest.raises(ValueError, match=r"variable must be one of .*stretch.*; got 'outcome'"):
        charts.trajectories(films, variable="outcome")
    with pytest.raises(ValueError, match="two times or more; got 1"):
        charts.trajectories(films.isel(time=[0]))


def test_a_design_has_few_films(designed):
    with pytest.raises(ValueError, match="one to 8 films; got 9: select some"):
        charts.design_chart(designed.isel(film=[0] * 9))
