from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from handling_signals import batch, decaying_sine, grid

from levelone.errors import InputError
from levelone.handling.damping import dynamic_stability
from levelone.handling.history import TimeHistory
from levelone.handling.quickness import attitude_quickness
from levelone.handling.records import record
from levelone.status import Status


def two_runs(**options):
    time = grid(6.0)
    rate, attitude = decaying_sine(time, [0.3, 0.4], [5.0, 6.0])
    return batch(rate, attitude, time=time, off=1.5, trim_rate=0.01, trim_attitude=-0.07, **options)


def full_record():
    history = two_runs(delay=[0.0, 1.0 / 3.0], status=[Status.OK, Status.TABLE_EXCEEDED])
    return dataclasses.replace(
        history,
        wind=(1.0, -0.1, 1e-17),
        extremes={"alpha_max": np.array([0.1, 0.2]), "C_D_min": np.array([np.nan, -1e-3])},
        name="pulse, 5 m/s",
    )


def assert_same_run(read, history, run):
    np.testing.assert_array_equal(read.time, history.time)
    assert list(read.channels) == list(history.channels)
    for name, values in history.channels.items():
        np.testing.assert_array_equal(read.channels[name][0], values[run])
    for group in ("trim", "extremes"):
        written = {name: values[run] for name, values in getattr(history, group).items()}
        np.testing.assert_equal({name: values[0] for name, values in getattr(read, group).items()}, written)
    for name in ("units", "input_name", "input_on", "wind", "name"):
        assert getattr(read, name) == getattr(history, name)
    np.testing.assert_equal(read.input_off, history.input_off)
    assert (read.delay[0], read.status[0]) == (history.delay[run], history.status[run])


@pytest.mark.parametrize("run", [0, 1])
def test_csv_round_trip_keeps_every_bit(tmp_path, run):
    history = full_record()
    history.to_csv(tmp_path / "run.csv", run)
    assert_same_run(TimeHistory.from_csv(tmp_path / "run.csv"), history, run)


def test_csv_round_trip_of_a_step_and_of_missing_samples(tmp_path):
    history = two_runs()
    history.channels["q"][0, 700:] = np.nan
    history = dataclasses.replace(history, input_off=np.nan)
    history.to_csv(tmp_path / "run.csv")
    assert_same_run(TimeHistory.from_csv(tmp_path / "run.csv"), history, 0)


def test_recorded_csv_gives_the_same_metrics_as_the_history_that_wrote_it(tmp_path):
    history = two_runs()
    history.to_csv(tmp_path / "run.csv", 1)
    read = TimeHistory.from_csv(tmp_path / "run.csv")
    quick, recorded = attitude_quickness(history), attitude_quickness(read)
    for name in ("quickness", "delta_theta_min", "t_second", "level", "status"):
        assert getattr(recorded, name)[0] == getattr(quick, name)[1]
    damping, recorded_damping = dynamic_stability(history), dynamic_stability(read)
    for name in ("zeta", "omega_n", "level", "status"):
        assert getattr(recorded_damping, name)[0] == getattr(damping, name)[1]


def plain_csv(path, history, *, units=True, degrees=True):
    scale, unit = (np.degrees(1.0), "deg") if degrees else (1.0, "rad")
    head = f"time [s], V_lon_ref, q[{unit}/s], theta[{unit}], gear" if units else "time,V_lon_ref,q,theta,gear"
    names = {"V_lon_ref": 1.0, "q": scale, "theta": scale}
    columns = [history.time, *(factor * history.channels[name][0] for name, factor in names.items()), 0.0 * history.time]
    lines = [head, *(",".join(map(repr, row)) for row in np.column_stack(columns).tolist())]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


@pytest.mark.parametrize(("units", "degrees"), [(True, True), (True, False), (False, False)])
def test_a_plain_flight_record_takes_its_trim_before_the_input(tmp_path, units, degrees):
    history = two_runs()
    plain_csv(tmp_path / "flight.csv", history, units=units, degrees=degrees)
    read = TimeHistory.from_csv(tmp_path / "flight.csv", input_name="V_lon_ref", input_on=1.0, input_off=1.5)
    assert read.trim["theta"][0] == pytest.approx(-0.07, rel=1e-12)
    assert read.units["theta"] == "rad"
    assert read.units["q"] == "rad/s"
    assert read.units["gear"] == ""
    assert attitude_quickness(read).quickness[0] == pytest.approx(attitude_quickness(history).quickness[0], rel=1e-9)
    given = TimeHistory.from_csv(tmp_path / "flight.csv", input_name="V_lon_ref", input_on=1.0, trim={"theta": 0.5})
    assert given.trim["theta"][0] == 0.5
    assert np.isnan(given.input_off)


def test_trim_in_a_file_has_the_unit_of_its_column(tmp_path):
    rows = "\n".join(f"{0.01 * k},{30.0 if k > 5 else 10.0}" for k in range(20))
    (tmp_path / "flight.csv").write_text(
        f"# input_name = theta\n# input_on = 0.06\n# trim.theta = 10.0\ntime,theta[deg]\n{rows}\n", encoding="utf-8"
    )
    read = TimeHistory.from_csv(tmp_path / "flight.csv")
    assert read.change("theta")[0, -1] == pytest.approx(np.radians(20.0))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,q\n0,1\n0.1,x\n", "line 3: 'x' is not a number"),
        ("time,q\n0,1\n0.1\n", "line 3: has 1 cells, the row of names has 2"),
        ("t,q\n0,1\n0.1,1\n", "no column 'time'"),
        ("time,q[ft]\n0,1\n0.1,1\n", "is in 'ft', must be in rad/s"),
        ("time[ms],q\n0,1\n0.1,1\n", "must be in s"),
        ("time,q,q\n0,1,1\n0.1,1,1\n", "two columns"),
        ("time,q[\n0,1\n0.1,1\n", "not a name"),
        ("time,q\n0,1\n", "holds no record"),
        ("time,q\n0,1\n0.1,1\n0.3,1\n", "intervals off the uniform grid"),
        ("time,q\n0,1\n0.1,1\n0.1,1\n", "off the uniform grid"),
        ("# status = 99\ntime,q\n0,1\n0.1,1\n", "99 is not a code"),
        ("# trim.theta = 1\ntime,q\n0,1\n0.1,1\n", "unknown name 'theta'"),
        ("# wind = 1, 2\ntime,q\n0,1\n0.1,1\n", "has 2 components"),
    ],
)
def test_a_bad_file_is_refused_with_its_place(tmp_path, text, message):
    (tmp_path / "bad.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        TimeHistory.from_csv(tmp_path / "bad.csv", input_name="q", input_on=0.05)


def test_what_a_file_does_not_state_is_asked_for(tmp_path):
    (tmp_path / "flight.csv").write_text("time,q\n0,1\n0.1,1\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"input_name: .* as an argument"):
        TimeHistory.from_csv(tmp_path / "flight.csv")
    with pytest.raises(InputError, match=r"input_on: .* as an argument"):
        TimeHistory.from_csv(tmp_path / "flight.csv", input_name="q")
    with pytest.raises(InputError, match="no sample before the input"):
        TimeHistory.from_csv(tmp_path / "flight.csv", input_name="q", input_on=0.0)
    with pytest.raises(InputError, match="cannot be read"):
        TimeHistory.from_csv(tmp_path / "missing.csv")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not UTF-8"):
        TimeHistory.from_csv(tmp_path / "binary.csv")


def test_writing_refuses_what_it_cannot_write(tmp_path):
    history = two_runs()
    with pytest.raises(InputError, match="not among the 2 runs"):
        history.to_csv(tmp_path / "run.csv", 2)
    with pytest.raises(InputError, match="cannot be written"):
        history.to_csv(tmp_path / "no" / "run.csv")
    odd = record([0.0, 0.1], {"a,b": [1.0, 2.0]}, input_name="a,b", input_on=0.05)
    with pytest.raises(InputError, match="comma or bracket"):
        odd.to_csv(tmp_path / "run.csv")


def test_select_keeps_the_axis_of_runs():
    history = full_record()
    for runs, expected in ((1, [1]), (-1, [1]), ([1, 0], [1, 0]), (slice(0, 1), [0]), (np.array([False, True]), [1])):
        chosen = history.select(runs)
        assert chosen.n_runs == len(expected)
        np.testing.assert_array_equal(chosen.channels["q"], history.channels["q"][expected])
        np.testing.assert_array_equal(chosen.delay, history.delay[expected])
        np.testing.assert_array_equal(chosen.extremes["alpha_max"], history.extremes["alpha_max"][expected])
    with pytest.raises(InputError, match="not among the 2 runs"):
        history.select(5)


def test_change_is_counted_from_trim():
    history = two_runs()
    np.testing.assert_allclose(history.change("theta")[:, 0], 0.0, atol=1e-15)
    with pytest.raises(InputError, match="did you mean 'theta'"):
        history.change("tetha")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"time": np.array([0.0])}, "two samples"),
        ({"time": np.array([0.0, np.nan])}, "finite"),
        ({"time": np.linspace(6.0, 0.0, 1501)}, "increase"),
        ({"time": np.linspace(0.0, 6.0, 1500)}, r"must be \[run, time\]"),
        ({"units": {}}, "units.V_lon_ref: missing"),
        ({"trim": {}}, "trim.V_lon_ref: missing"),
        ({"input_name": "V_lon"}, "did you mean 'V_lon_ref'"),
        ({"input_on": np.nan}, "finite time"),
        ({"input_off": 0.5}, "must come after"),
        ({"delay": np.array([0.0])}, r"delay: has shape \(1,\)"),
        ({"delay": np.array([0.0, -0.1])}, "zero or more"),
        ({"status": np.array([0, 17])}, "17 is not a code"),
        ({"extremes": {"alpha_max": np.zeros(3)}}, r"extremes.alpha_max: has shape \(3,\)"),
    ],
)
def test_inconsistent_records_are_refused(changes, message):
    with pytest.raises(InputError, match=message):
        dataclasses.replace(two_runs(), **changes)
