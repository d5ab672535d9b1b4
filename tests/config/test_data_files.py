"""Files of recorded data: every format gives what was written, mapped, on one clock; what is wrong is said in one line."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from levelone.config.column_mapping import by_name, parse_columns, read_mapping, series
from levelone.config.data_files import DataFile, name_and_unit, read_data
from levelone.config.data_table import Table, tabulate
from levelone.config.data_ulog import euler
from levelone.errors import InputError

TIME = np.arange(40) * 0.05
ANGLE = np.round(3.0 * np.sin(2.0 * TIME), 6)
STICK = np.round(0.4 * np.cos(TIME), 6)


def written(folder: Path, text: str, name: str = "run.csv") -> DataFile:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return read_data(path)


def rows(*columns: np.ndarray, between: str = ",", point: str = ".") -> str:
    return "\n".join(between.join(f"{x!r}".replace(".", point) for x in row) for row in np.column_stack(columns).tolist())


def table_of(file: DataFile, columns: str, **options) -> Table:
    return tabulate(file, parse_columns(columns), **options)


@pytest.mark.parametrize(
    ("header", "between", "point"),
    [
        ("time,pitch [deg],stick", ",", "."),
        ("time;pitch (deg);stick", ";", ","),
        ("time\tpitch[deg]\tstick", "\t", "."),
        ('"time","pitch [deg]","stick"', ",", "."),
        ("# name = first\ntime,pitch,stick\n[s],[deg],[-]", ",", "."),
    ],
)
def test_text_tables_in_the_forms_that_tools_write(tmp_path, header, between, point):
    file = written(tmp_path, f"{header}\n{rows(TIME, ANGLE, STICK, between=between, point=point)}\n")
    assert list(file.columns) == ["time", "pitch", "stick"]
    assert file.columns["pitch"].unit == "deg"
    np.testing.assert_array_equal(file.columns["pitch"].values, ANGLE)
    assert file.attributes == ({"name": "first"} if header.startswith("#") else {})


def test_a_column_of_words_matters_only_when_it_is_used(tmp_path):
    body = "\n".join(f"{t!r},{x!r},HOLD" for t, x in zip(TIME.tolist(), ANGLE.tolist(), strict=True))
    file = written(tmp_path, f"time,pitch,mode\n{body}\n")
    np.testing.assert_array_equal(table_of(file, "theta=pitch[deg]").channels["theta"], np.radians(ANGLE))
    with pytest.raises(InputError, match=r"mode.*line 2 holds 'HOLD'"):
        table_of(file, "theta=mode[deg]")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1,2\n3,4\n5,6\n", "line 1.*names of the columns"),
        ("time,a\n0,1\n1\n2,3\n", "line 3.*1 cells.*2"),
        ("time,a,a\n0,1,2\n1,2,3\n", "two columns are called 'a'"),
        ("time,a\n0,1\n", "holds no record"),
        ("time,,b\n0,1,2\n1,2,3\n", "column 2 has no name"),
    ],
)
def test_text_tables_that_cannot_be_read(tmp_path, text, words):
    with pytest.raises(InputError, match=words):
        written(tmp_path, text)


def test_parquet_with_units_in_metadata_names_and_types(tmp_path):
    arrow = pytest.importorskip("pyarrow", reason="pyarrow reads Parquet")
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow reads Parquet")
    clock = np.datetime64("2024-05-01T10:00:00", "us") + np.round(TIME * 1e6).astype("timedelta64[us]")
    angle = [None if k == 3 else float(x) for k, x in enumerate(ANGLE)]
    schema = arrow.schema([
        ("time", arrow.timestamp("us")), arrow.field("pitch", arrow.float32(), metadata={"unit": "deg"}),
        ("stick [percent]", arrow.float64()), ("mode", arrow.string()),
    ])  # fmt: skip
    data = [clock, angle, 100.0 * STICK, ["A"] * len(TIME)]
    parquet.write_table(arrow.table(data, schema=schema), tmp_path / "run.parquet")
    file = read_data(tmp_path / "run.parquet")
    assert [(name, column.unit) for name, column in file.columns.items()] == [("time", "s"), ("pitch", "deg"), ("stick", "percent")]
    np.testing.assert_allclose(file.columns["time"].values, TIME, atol=1e-6)
    table = table_of(file, "theta=pitch, delta_lon=stick", start=0.2)
    np.testing.assert_allclose(table.channels["theta"], np.radians(ANGLE[4:]), atol=1e-6)
    np.testing.assert_allclose(table.channels["delta_lon"], STICK[4:], rtol=1e-14)
    with pytest.raises(InputError, match=r"theta has 1 missing values, the first at 0.15 s"):
        table_of(file, "theta=pitch")


def test_matlab_5_with_structures_and_matrices(tmp_path):
    from scipy.io import savemat

    content = {
        "log": {"t": TIME, "att": {"theta": ANGLE[:, None]}},
        "both": np.column_stack([ANGLE, STICK]),
        "note": "text",
        "one": 3.0,
    }
    savemat(tmp_path / "run.mat", content)
    file = read_data(tmp_path / "run.mat")
    assert set(file.columns) == {"log.t", "log.att.theta", "both.1", "both.2"}
    table = table_of(file, "time=log.t[s], theta=log.att.theta[deg], delta_lon=both.2")
    np.testing.assert_array_equal(table.channels["theta"], np.radians(ANGLE))
    np.testing.assert_array_equal(table.channels["delta_lon"], STICK)


def test_matlab_7_3_and_no_link_to_another_file_is_followed(tmp_path):
    h5py = pytest.importorskip("h5py", reason="h5py reads MATLAB 7.3")
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["secret"] = STICK
    with h5py.File(tmp_path / "run.mat", "w", userblock_size=512) as made:
        made["log/t"], made["log/theta"] = TIME[None, :], ANGLE[None, :]
        made["log/stolen"] = h5py.ExternalLink("other.h5", "secret")
        made["stolen"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "secret")
        layout = h5py.VirtualLayout(shape=STICK.shape, dtype="f8")
        layout[:] = h5py.VirtualSource(str(tmp_path / "other.h5"), "secret", shape=STICK.shape)
        made.create_virtual_dataset("log/virtual", layout)
        made.create_dataset("log/raw", shape=STICK.shape, dtype="f8", external=[(str(tmp_path / "other.h5"), 0, 8 * STICK.size)])
        made.create_group("#refs#")
    file = read_data(tmp_path / "run.mat")
    assert set(file.columns) == {"log.t", "log.theta"}
    np.testing.assert_array_equal(table_of(file, "time=log.t, theta=log.theta[deg]").channels["theta"], np.radians(ANGLE))


def ulog(path: Path, topics: dict[str, tuple[str, np.ndarray, np.ndarray]], start: int = 5_000_000) -> None:
    """A ULog file by the format's documentation: header, flag bits, formats, subscriptions, data; clocks in s."""

    def message(kind: bytes, body: bytes) -> bytes:
        return struct.pack("<HB", len(body), kind[0]) + body

    parts = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", start), message(b"B", bytes(40))]
    for name, (fields, _, _) in topics.items():
        parts.append(message(b"F", f"{name}:uint64_t timestamp;{fields}".encode()))
    parts += [message(b"A", struct.pack("<BH", 0, k) + name.encode()) for k, name in enumerate(topics)]
    for k, (_, clock, values) in enumerate(topics.values()):
        for time, row in zip(clock, np.atleast_2d(values.T).T, strict=True):
            parts.append(message(b"D", struct.pack(f"<HQ{len(row)}f", k, start + round(time * 1e6), *row)))
    path.write_bytes(b"".join(parts))


def test_ulog_topics_of_different_rates_come_to_one_clock(tmp_path):
    pytest.importorskip("pyulog", reason="pyulog reads ULog")
    slow = np.arange(25) * 0.1
    attitude = np.column_stack([np.cos(0.5 * TIME), 0.0 * TIME, np.sin(0.5 * TIME), 0.0 * TIME])  # theta = t
    ulog(tmp_path / "run.ulg", {
        "vehicle_attitude": ("float[4] q;", TIME, attitude), "vehicle_angular_velocity": ("float[3] xyz;", TIME, attitude[:, :3]),
        "manual_control_setpoint": ("float pitch;", slow, slow),
    })  # fmt: skip
    file = read_data(tmp_path / "run.ulg")
    assert {"phi", "theta", "psi", "p", "q", "r", "vehicle_attitude.q[2]", "manual_control_setpoint.pitch"} <= set(file.columns)
    table = table_of(file, "theta=theta, q=vehicle_angular_velocity.xyz[1], delta_lon=manual_control_setpoint.pitch*-1")
    early = table.time < 1.5  # theta folds at a quarter turn
    np.testing.assert_allclose(table.channels["theta"][early], table.time[early], atol=1e-6)
    np.testing.assert_allclose(table.channels["delta_lon"], -table.time, atol=1e-6)
    assert table.dt == pytest.approx(0.05, rel=1e-9)
    assert any("delta_lon is recorded at 10 Hz" in note and "31.4 rad/s" in note for note in table.notes)


@pytest.mark.theory
@given(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0))
def test_angles_of_a_quaternion_are_those_it_was_made_of(phi, theta, psi):
    def turn(angle: float, axis: int) -> np.ndarray:
        part = np.zeros(4)
        part[0], part[1 + axis] = np.cos(angle / 2), np.sin(angle / 2)
        return part

    def times(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.concatenate([[a[0] * b[0] - a[1:] @ b[1:]], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])])

    found = euler(*times(times(turn(psi, 2), turn(theta, 1)), turn(phi, 0)))
    np.testing.assert_allclose(found, (phi, theta, psi), atol=1e-7)


def test_a_mapping_in_a_line(tmp_path):
    file = written(tmp_path, f"time,pitch,a/2,stick[in]\n{rows(TIME, ANGLE, STICK, 5.0 * STICK)}\n")
    found = parse_columns("theta = pitch[deg] * -1 , q=a/2, delta_lon=stick[in]/5, V_lon=pitch[ft/s]")
    assert found["theta"].factor == -1.0
    table = tabulate(file, {name: source for name, source in found.items() if name != "q"})
    np.testing.assert_array_equal(table.channels["theta"], np.radians(-ANGLE))
    np.testing.assert_allclose(table.channels["delta_lon"], STICK, rtol=1e-15)
    np.testing.assert_allclose(table.channels["V_lon"], 0.3048 * ANGLE, rtol=1e-15)
    assert table.units == {"time": "", "theta": "deg", "delta_lon": "in", "V_lon": "ft/s"}


def test_a_mapping_in_a_file(tmp_path):
    (tmp_path / "map.toml").write_text(
        '[columns.theta]\nname = "pitch"\nunit = "deg"\nsign = -1\noffset = 2.0\n[columns.q]\nname = "a"\nscale = 0.5\n'
    )
    file = written(tmp_path, f"time,pitch,a\n{rows(TIME, ANGLE, STICK)}\n")
    table = tabulate(file, read_mapping(tmp_path / "map.toml"))
    np.testing.assert_array_equal(table.channels["theta"], np.radians(2.0 - ANGLE))
    np.testing.assert_array_equal(table.channels["q"], 0.5 * STICK)


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ("theta", "is not CHANNEL=COLUMN"),
        ("tehta=pitch", "did you mean 'theta'"),
        ("theta=pitch, theta=stick", "given twice"),
        ("theta=pitsh", "no column 'pitsh'; did you mean 'pitch'"),
        ("theta=pitch[m]", "unit 'm' does not fit, expected rad"),
        ("theta=pitch*0", "must be finite and not zero"),
        ("theta=pitch/0", "must be finite and not zero"),
        ("delta_lon=stick[in]", "divide by it, delta_lon=stick.in./5"),
    ],
)
def test_a_mapping_that_cannot_be_meant(tmp_path, columns, words):
    file = written(tmp_path, f"time,pitch,stick\n{rows(TIME, ANGLE, STICK)}\n")
    with pytest.raises(InputError, match=words):
        table_of(file, columns)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[column.theta]\nname='a'\n", "did you mean 'columns'"),
        ("[columns.theta]\nunit='deg'\n", r"theta.name: is None"),
        ("[columns.theta]\nname='a'\nsign=2\n", "sign: is 2, must be 1 or -1"),
        ("[columns.theta]\nname='a'\nsacle=2\n", "did you mean 'scale'"),
        ("columns=3\n", "names no channel"),
        ("[columns\n", "is not a TOML file"),
    ],
)
def test_a_mapping_file_that_cannot_be_read(tmp_path, text, words):
    (tmp_path / "map.toml").write_text(text)
    with pytest.raises(InputError, match=words):
        read_mapping(tmp_path / "map.toml")


def test_channels_by_their_names_and_units_that_are_taken_for_granted(tmp_path):
    file = written(tmp_path, f"t,theta[deg],q,mode\n{rows(TIME, ANGLE, STICK, STICK)}\n")
    assert set(by_name(file)) == {"theta", "q"}
    assert series(file, by_name(file)["q"])[2] == ""
    assert tabulate(file, by_name(file)).units == {"time": "", "theta": "deg", "q": ""}


def test_uneven_samples_are_brought_to_the_median_interval_along_straight_lines(tmp_path):
    rng = np.random.default_rng(4)
    uneven = TIME + 0.01 * rng.uniform(-1.0, 1.0, TIME.size)
    heading = (350.0 + 20.0 * uneven) % 360.0
    file = written(tmp_path, f"time,a,heading\n{rows(uneven, 2.0 * uneven + 1.0, heading)}\n")
    table = table_of(file, "q=a, psi=heading[deg]")
    assert table.resampled
    assert table.dt == pytest.approx(float(np.median(np.diff(uneven))), rel=1e-12)
    np.testing.assert_allclose(table.channels["q"], 2.0 * table.time + 1.0, atol=1e-12)  # a straight line is kept
    np.testing.assert_allclose(np.degrees(table.channels["psi"]), 350.0 + 20.0 * table.time, atol=1e-9)
    assert table.largest_gap == pytest.approx(np.diff(uneven).max())
    assert "resampled" in table.notes[0]


def test_even_samples_are_left_as_they_are(tmp_path):
    file = written(tmp_path, f"time,a\n{rows(1.7e9 + TIME, STICK)}\n")
    table = table_of(file, "q=a")
    assert not table.resampled
    np.testing.assert_array_equal(table.channels["q"], STICK)
    assert table.time[0] == 0.0
    assert "counted from there" in table.notes[0]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.__setitem__(7, t[6]), r"0.3 s \(sample 7\) stands twice"),
        (lambda t: t.__setitem__(7, 0.1), r"0.3 s \(sample 7\) is followed by 0.1 s"),
        (lambda t: t.__setitem__(slice(20, None), t[20:] + 0.5), r"no sample for 0.55 s after 0.95 s, 11.0 intervals"),
        (lambda t: t.__setitem__(5, np.nan), "1 times are missing, the first at sample 6"),
    ],
)
def test_a_clock_that_cannot_be_trusted(tmp_path, change, words):
    time = TIME.copy()
    change(time)
    file = written(tmp_path, f"time,a\n{rows(time, STICK)}\n")
    with pytest.raises(InputError, match=words):
        table_of(file, "q=a")


def test_a_window_leaves_out_what_is_wrong_elsewhere(tmp_path):
    time, values = TIME.copy(), STICK.copy()
    time[30:] += 3.0
    values[2] = np.nan
    file = written(tmp_path, f"time,a\n{rows(time, values)}\n")
    table = table_of(file, "q=a", start=0.2, end=1.0)
    np.testing.assert_array_equal(table.channels["q"], STICK[4:21])
    assert table_of(file, "q=a", start=0.2, largest_gap=70.0).time[-1] == pytest.approx(time[-1])
    with pytest.raises(InputError, match="holds 0 samples from 50 to inf s"):
        table_of(file, "q=a", start=50.0)


def test_names_with_units_and_with_indices():
    assert name_and_unit("a b [deg/s]") == ("a b", "deg/s")
    assert name_and_unit("a (deg)") == ("a", "deg")
    assert name_and_unit("f(x)") == ("f(x)", "")
    assert name_and_unit("q[0]") == ("q[0]", "")


def test_an_ending_that_no_reader_knows(tmp_path):
    (tmp_path / "a.csvv").write_text("time,a\n")
    with pytest.raises(InputError, match=r"did you mean '.csv'"):
        read_data(tmp_path / "a.csvv")
    with pytest.raises(InputError, match="No such file"):
        read_data(tmp_path / "none.csv")


MAGIC = {
    "csv": b"time,a\n0,1\n",
    "mat": b"MATLAB 5.0 MAT-file" + b" " * 105 + b"\x00\x01IM",
    "ulg": b"ULog\x01\x12\x35\x01" + bytes(8),
    "parquet": b"PAR1",
}


@pytest.mark.parametrize("ending", sorted(MAGIC))
@settings(max_examples=60)
@given(data=st.data())
def test_damaged_files_end_in_one_line(tmp_path_factory, ending, data):
    """Whatever a file holds: numbers come out, or an error of the package, nothing else."""
    body = data.draw(st.binary(max_size=400))
    magic = MAGIC[ending] if data.draw(st.booleans()) else b""
    path = tmp_path_factory.getbasetemp() / f"damaged.{ending}"
    path.write_bytes(magic + body + (b"PAR1" if ending == "parquet" else b""))
    try:
        columns = read_data(path).columns
    except InputError:
        return
    assert all(column.values.dtype == np.float64 and column.values.ndim == 1 for column in columns.values())


def test_a_heading_that_wraps_in_trim_has_no_jumps_whether_or_not_it_is_interpolated(tmp_path):
    heading = 360.0 + 2.0 * np.sin(3.0 * TIME)
    for time in (TIME, TIME + 0.004 * np.cos(40.0 * TIME)):
        file = written(tmp_path, f"time,heading\n{rows(time, heading % 360.0)}\n")
        turned = np.degrees(table_of(file, "psi=heading[deg]").channels["psi"])
        assert np.abs(np.diff(turned)).max() < 1.0
        assert np.ptp(turned) == pytest.approx(4.0, abs=0.05)


@pytest.mark.parametrize(
    ("name", "scale", "words"),
    [
        ("timestamp", 1e6, r"its samples are 50000 apart.*time=timestamp\[us\]"),
        ("Timestamp_sample", 1e6, r"time=Timestamp_sample\[us\]"),
        ("t", 1e3, r"its samples are 50 apart.*time=t\[ms\]"),
    ],
)
def test_a_clock_of_another_unit_is_never_taken_for_seconds(tmp_path, name, scale, words):
    file = written(tmp_path, f"{name},a\n{rows(scale * TIME, STICK)}\n")
    with pytest.raises(InputError, match=words):
        table_of(file, f"time={name}, q=a")
    table = table_of(file, f"time={name}[{'us' if scale == 1e6 else 'ms'}], q=a")
    assert table.dt == pytest.approx(0.05)
    assert table.units["time"] in ("us", "ms")
    assert table.sources["time"].name.startswith(name)


def test_a_clock_that_is_slow_may_say_so(tmp_path):
    file = written(tmp_path, f"time,a\n{rows(40.0 * TIME, STICK)}\n")
    assert table_of(file, "time=time[s], q=a").dt == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("written_as", "column", "factor"),
    [
        ("gyro", 0, 1.0),
        ("gyro/2", 1, 1.0),
        ("gyro/2*-1", 1, -1.0),
        ("gyro/4", 0, 0.25),
        ("gyro*2/4", 0, 0.5),
        ("gyro/2[rad/s]", 1, 1.0),
    ],
)
def test_a_name_that_looks_like_a_division_is_a_name(tmp_path, written_as, column, factor):
    given = (ANGLE, STICK)
    file = written(tmp_path, f"time,gyro,gyro/2\n{rows(TIME, *given)}\n")
    table = table_of(file, f"q={written_as}")
    np.testing.assert_array_equal(table.channels["q"], factor * given[column])
    assert table.sources["q"].factor == factor


def test_an_element_of_an_array_is_no_unit(tmp_path):
    file = written(tmp_path, f"time,xyz[0],xyz[1],stick[1]\n{rows(TIME, ANGLE, STICK, STICK)}\n")
    assert list(file.columns) == ["time", "xyz[0]", "xyz[1]", "stick"]
    assert file.columns["stick"].unit == "1"
    np.testing.assert_array_equal(table_of(file, "q=xyz[1]").channels["q"], STICK)


@pytest.mark.parametrize(
    ("second", "units"), [("s,deg,1", ["s", "deg", "1"]), ("s,deg,", ["s", "deg", ""]), ("[s],[deg],-", ["s", "deg", "1"])]
)
def test_a_row_of_units_may_hold_ones_and_nothing(tmp_path, second, units):
    file = written(tmp_path, f"time,pitch,stick\n{second}\n{rows(TIME, ANGLE, STICK)}\n")
    assert [column.unit for column in file.columns.values()] == units
    assert file.columns["time"].values.size == TIME.size


def test_a_first_row_of_ones_and_words_is_no_row_of_units(tmp_path):
    file = written(tmp_path, "time,pitch,mode\n1,1,HOLD\n2,3,HOLD\n3,4,HOLD\n")
    np.testing.assert_array_equal(file.columns["pitch"].values, [1.0, 3.0, 4.0])


def test_parquet_with_a_clock_in_whole_nanoseconds(tmp_path):
    arrow = pytest.importorskip("pyarrow", reason="pyarrow reads Parquet")
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow reads Parquet")
    clock = 1_700_000_000_000_000_001 + np.round(TIME * 1e9).astype(np.int64)
    parquet.write_table(arrow.table({"stamp": clock, "a": STICK}), tmp_path / "run.parquet")
    table = table_of(read_data(tmp_path / "run.parquet"), "time=stamp[s]*1e-9, q=a")
    np.testing.assert_allclose(table.time, TIME, atol=2e-6)
