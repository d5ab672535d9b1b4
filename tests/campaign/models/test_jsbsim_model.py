"""Aircraft of JSBSim: a turning body against its closed form, what is checked and said, and the F450 quadrotor."""

from __future__ import annotations

import math
import pickle
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from levelone.campaign.models.build import build
from levelone.campaign.models.jsbsim import JsbsimSource
from levelone.campaign.models.jsbsim_properties import check_factor_units
from levelone.campaign.models.protocol import ModelFailure
from levelone.config.model_study import load_model_study
from levelone.config.model_table import Channel, JsbsimTable
from levelone.errors import InputError
from levelone.handling.bandwidth import bandwidth
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.identification import identify
from levelone.handling.manoeuvres import step, sweep
from levelone.status import Status

pytest.importorskip("jsbsim", reason="JSBSim flies the aircraft: pip install levelone[jsbsim]")

SLUG_FT2 = 14.593902937206365 * 0.3048**2
# A body that falls freely and turns under a moment of the stick and one against its pitch rate, both in lbf ft.
BODY = """<?xml version="1.0"?>
<fdm_config name="body" version="2.0" release="ALPHA">
  <fileheader/>
  <metrics>
    <wingarea unit="FT2">1</wingarea><wingspan unit="FT">1</wingspan><chord unit="FT">1</chord>
    <location name="AERORP" unit="IN"><x>0</x><y>0</y><z>0</z></location>
  </metrics>
  <mass_balance>
    <ixx unit="SLUG*FT2">2</ixx><iyy unit="SLUG*FT2">2</iyy><izz unit="SLUG*FT2">2</izz>
    <emptywt unit="LBS">32</emptywt>
    <location name="CG" unit="IN"><x>0</x><y>0</y><z>0</z></location>
  </mass_balance>
  <ground_reactions>
    <contact type="STRUCTURE" name="foot">
      <location unit="IN"><x>0</x><y>0</y><z>-10</z></location>
      <static_friction>0.5</static_friction><dynamic_friction>0.5</dynamic_friction>
      <spring_coeff unit="LBS/FT">1000</spring_coeff><damping_coeff unit="LBS/FT/SEC">100</damping_coeff>
    </contact>
  </ground_reactions>
  <flight_control name="body">
    <property value="10.0">body/damping</property>
    <property value="4.0">body/power</property>
    <channel name="noise">
      <fcs_function name="body/noise"><function><random/></function></fcs_function>
    </channel>
  </flight_control>
  <aerodynamics>
    <axis name="PITCH">
      <function name="body/stick">
        <product><property>body/power</property><property>fcs/elevator-cmd-norm</property></product>
      </function>
      <function name="body/against">
        <product><value>-1</value><property>body/damping</property><property>velocities/q-rad_sec</property></product>
      </function>
    </axis>
  </aerodynamics>
</fdm_config>
"""
STEP = step("delta_lon", 0.5, trim_speed=0.0, flight_mode="direct", duration=2.0, dt=0.01, controller_rate=100.0)
NONE = np.array([])


@pytest.fixture
def body(tmp_path: Path) -> JsbsimTable:
    folder = tmp_path / "body"
    folder.mkdir()
    (folder / "body.xml").write_text(BODY)
    return JsbsimTable(
        kind="jsbsim",
        fixed=(),
        inputs=(Channel("delta_lon", "fcs/elevator-cmd-norm", "1", 1.0, 1, None),),
        outputs=(Channel("q", "velocities/q-rad_sec", "rad/s", 1.0, 1), Channel("altitude", "position/h-sl-ft", "ft", 0.3048, 1)),
        aircraft="body",
        folder=tmp_path,
        step=0.001,
        initial=(("ic/h-sl-ft", 10_000.0),),
        set=(),
        engines_running=False,
        settle=0.0,
        random_seed=0,
    )


def _change(table: JsbsimTable, **options: Any) -> JsbsimTable:
    return replace(table, **options)


@pytest.mark.theory
def test_a_turning_body_follows_its_closed_form(body: JsbsimTable) -> None:
    """q = P u / D (1 - (1 - D h / I)^n), n frames of h after the input, which is JSBSim's Euler rule for exp(-D t / I).

    The command acts from the sample at which it is set, without a frame of delay.
    """
    source = JsbsimSource(_change(body, initial=()), ("body/damping", "ic/h-sl-ft"))
    damping, frame = 8.0, 0.001
    record = source.fly(np.array([damping, 5000.0]), STEP)
    frames = np.maximum(np.round((record.time - 1.0) / frame), 0.0)
    expected = 4.0 * 0.5 / damping * (1.0 - (1.0 - damping * frame / 2.0) ** frames)
    np.testing.assert_allclose(record.channels["q"][0], expected, rtol=0.0, atol=1e-8)
    assert record.channels["altitude"][0, 0] == pytest.approx(5000.0 * 0.3048, abs=1e-3)
    assert record.time[-1] == pytest.approx(2.0)


def test_signs_units_and_trim(body: JsbsimTable) -> None:
    inputs = (Channel("delta_lon", "fcs/elevator-cmd-norm", "1", 1.0, -1, 0.25),)
    outputs = (
        Channel("q", "velocities/q-rad_sec", "rad/s", 1.0, -1),
        Channel("theta", "attitude/theta-deg", "deg", math.pi / 180.0, -1),
    )
    there = JsbsimSource(_change(body, inputs=inputs, outputs=outputs, settle=3.0), ()).fly(NONE, STEP)
    plain = JsbsimSource(body, ()).fly(NONE, STEP)
    assert there.trim["q"][0] == pytest.approx(-4.0 * 0.25 / 10.0, rel=1e-5)
    np.testing.assert_allclose(there.change("q"), plain.change("q"), atol=1e-6)
    rate = np.gradient(there.channels["theta"][0], there.dt)[1:-1]
    assert rate[:50] == pytest.approx(there.channels["q"][0, 1:51], abs=1e-4)


def test_two_runs_are_the_same_to_the_last_bit_and_the_seed_decides_noise(body: JsbsimTable) -> None:
    noisy = _change(body, outputs=(*body.outputs, Channel("theta", "body/noise", "rad", 1.0, 1)))
    one = JsbsimSource(noisy, ())
    first, second = one.fly(NONE, STEP), pickle.loads(pickle.dumps(one)).fly(NONE, STEP)  # noqa: S301  # our own
    for name, values in first.channels.items():
        np.testing.assert_array_equal(values, second.channels[name])
    assert np.std(first.channels["theta"]) > 0.1
    other = JsbsimSource(_change(noisy, random_seed=7), ()).fly(NONE, STEP)
    assert (other.channels["theta"] != first.channels["theta"]).all()


def test_the_ground_ends_a_flight_and_not_a_stand(body: JsbsimTable) -> None:
    low = _change(body, initial=(("ic/h-agl-ft", 30.0),))
    with pytest.raises(ModelFailure, match=r"touches the ground at t = 1\.[0-9]") as caught:
        JsbsimSource(low, ()).fly(NONE, STEP)
    assert caught.value.status is Status.DIVERGED
    with pytest.raises(ModelFailure, match=r"touches the ground while it settles, after 1\.[0-9]+ s: begin higher") as caught:
        JsbsimSource(_change(low, settle=4.0), ()).fly(NONE, STEP)
    assert caught.value.status is Status.DIVERGED
    standing = _change(body, initial=(("ic/h-agl-ft", 0.5),), set=(("body/power", 0.0),))
    assert JsbsimSource(standing, ()).fly(NONE, STEP).time.size == 201
    assert JsbsimSource(_change(standing, settle=1.0), ()).fly(NONE, STEP).time.size == 201


def test_numbers_that_are_not_finite(body: JsbsimTable) -> None:
    with pytest.raises(ModelFailure) as caught:
        JsbsimSource(body, ("body/damping",)).fly(np.array([-1e9]), STEP)
    assert caught.value.status in (Status.OUTPUT_NOT_FINITE, Status.MODEL_FAILED)


@pytest.mark.parametrize(
    ("options", "targets", "words"),
    [
        ({}, ("body/dampng",), "factor.target: unknown name 'body/dampng'; did you mean 'body/damping'"),
        ({}, ("velocities/q-rad_sec",), "factor.target: property 'velocities/q-rad_sec' cannot be set"),
        ({"set": (("body/damping", 1.0),)}, ("body/damping",), "'body/damping' is set twice"),
        ({"set": (("body/damping[0]", 1.0),)}, ("body/damping",), "'body/damping' is set twice"),
        ({"initial": (("ic/h-sl-feet", 1.0),)}, (), "model.initial: unknown name 'ic/h-sl-feet'; did you mean"),
        ({"aircraft": "bodi"}, (), "model.aircraft: no aircraft 'bodi' in .*; did you mean 'body'"),
        (
            {"inputs": (Channel("delta_lon", "attitude/phi-rad", "rad", 1.0, 1),)},
            (),
            "model.inputs.delta_lon.name: .* cannot be set",
        ),
        (
            {"outputs": (Channel("q", "velocities/q-rad_sec", "deg/s", math.pi / 180.0, 1),)},
            (),
            "model.outputs.q.unit: is 'deg/s', but the name of property 'velocities/q-rad_sec' says 'rad/s'",
        ),
        (
            {"outputs": (Channel("altitude", "position/h-sl-ft", "m", 1.0, 1),)},
            (),
            "model.outputs.altitude.unit: is 'm', but the name of property 'position/h-sl-ft' says 'ft'",
        ),
        (
            {"outputs": (Channel("theta", "velocities/u-fps", "rad", 1.0, 1),)},
            (),
            "model.outputs.theta.unit: is 'rad', but the name of property 'velocities/u-fps' says 'ft/s'",
        ),
    ],
)
def test_what_does_not_fit_the_aircraft(body: JsbsimTable, options: dict[str, Any], targets: tuple[str, ...], words: str) -> None:
    with pytest.raises(InputError, match=words):
        JsbsimSource(_change(body, **options), targets)


@pytest.mark.parametrize(
    ("target", "unit", "own"),
    [
        ("ic/h-sl-ft", "m", "'ft'"),
        ("ic/psi-true-deg", "rad", "'deg'"),
        ("velocities/u-fps", "kt", "'ft/s'"),
        ("inertia/pointmass-weight-lbs[1]", "kg", "'lbf' or 'lb'"),
        ("fcs/elevator-cmd-norm", "%", "'1'"),
    ],
)
def test_the_unit_of_a_factor_is_that_of_its_property(target: str, unit: str, own: str) -> None:
    with pytest.raises(InputError, match=re.escape(f"factor.unit: is '{unit}', but the name of property '{target}' says {own}")):
        check_factor_units(("body/power", target), ("whatever", unit))


def test_units_of_factors_that_a_property_does_not_contradict() -> None:
    """A text that is no unit here says nothing against the name."""
    targets = (
        "body/power",
        "ic/h-sl-ft",
        "inertia/pointmass-weight-lbs",
        "inertia/pointmass-weight-lbs[1]",
        "ic/vc-kts",
        "ic/h-agl-ft",
    )
    check_factor_units(targets, ("lbf ft", "ft", "lbf", "lb", "knot", "feet above the pad"))


def test_an_aircraft_that_cannot_be_read(body: JsbsimTable) -> None:
    assert body.folder is not None
    (body.folder / "body" / "body.xml").write_text("<fdm_config><x></fdm_config>")
    with pytest.raises(InputError, match=r"model\.aircraft: JSBSim cannot read 'body'"):
        JsbsimSource(body, ())


def test_a_step_that_does_not_divide_the_interval(body: JsbsimTable) -> None:
    source = JsbsimSource(_change(body, step=0.003), ())
    with pytest.raises(InputError, match=r"model\.step: a sampling interval of 0\.01 s is no whole number of steps"):
        source.fly(NONE, STEP)


def test_the_key_follows_the_files(body: JsbsimTable) -> None:
    assert body.folder is not None
    before = JsbsimSource(body, ()).key
    assert JsbsimSource(body, ()).key == before
    assert JsbsimSource(_change(body, random_seed=1), ()).key != before
    (body.folder / "body" / "body.xml").write_text(BODY.replace("4.0", "4.1"))
    assert JsbsimSource(body, ()).key != before


def test_nothing_is_printed_or_written(
    body: JsbsimTable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """An aircraft may ask for files of its own; a campaign's folder is no place for them."""
    assert body.folder is not None
    output = '<output name="canary.csv" type="CSV" rate="10"><velocities>ON</velocities></output></fdm_config>'
    (body.folder / "body" / "body.xml").write_text(BODY.replace("</fdm_config>", output))
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    assert JsbsimSource(body, ()).fly(NONE, STEP).time.size == 201
    assert list(here.iterdir()) == []
    assert capfd.readouterr() == ("", "")


def f450() -> JsbsimTable:
    """As studies/f450 describes it, its factors at their nominal values."""
    return JsbsimTable(
        kind="jsbsim",
        fixed=(),
        inputs=(Channel("delta_lon", "fcs/elevator-cmd-norm", "1", 1.0, 1, None),),
        outputs=(Channel("q", "velocities/q-rad_sec", "rad/s", 1.0, 1),),
        aircraft="F450",
        folder=None,
        step=0.002,
        initial=(("ic/h-sl-ft", 1000.0),),
        set=(("fcs/ScasEngage", 1.0), ("fcs/throttle-cmd-norm", 0.42)),
        engines_running=True,
        settle=2.0,
        random_seed=0,
    )


SWEEP = sweep("delta_lon", 0.15, trim_speed=0.0, flight_mode="direct", dt=0.002, controller_rate=500.0,
              omega_min=1.0, omega_max=200.0, length=90.0, settle=4.0)  # fmt: skip


@pytest.mark.oracle
def test_bandwidth_of_the_f450_from_a_rate_sweep() -> None:
    """Against a run of JSBSim 1.3 and a spectral analysis made apart from this package: 33.1 and 59.9 rad/s, 0.0050 s."""
    record = JsbsimSource(f450(), ()).fly(NONE, SWEEP)
    rate = identify(record, "q", omega_min=1.0, omega_max=200.0)
    reading = bandwidth(FrequencyResponse(rate.omega, rate.value / (1j * rate.omega), rate.coherence), "rate_command")
    assert float(reading.omega_bw_phase[0]) == pytest.approx(33.1, rel=0.02)
    assert float(reading.omega_180[0]) == pytest.approx(59.9, rel=0.02)
    assert float(reading.tau_p[0]) == pytest.approx(0.0050, rel=0.10)
    assert rate.coherence is not None
    assert rate.coherence[0][rate.omega < 2.0 * reading.omega_180[0]].min() > 0.99


def test_the_study_that_ships_flies_the_same_sweep() -> None:
    study = load_model_study(Path(__file__).parents[3] / "studies" / "f450" / "study.toml")
    model = build(study)
    assert study.targets == ("fcs/ScasEngage", "fcs/throttle-cmd-norm", "ic/h-sl-ft")
    assert study.nominal.tolist() == [1.0, 0.42, 1000.0]
    (test,) = study.tests
    assert (test.output, test.integrate, test.response_type) == ("q", True, "rate_command")
    assert replace(test.manoeuvre, name=SWEEP.name) == SWEEP
    assert set(study.read) < set(model.names)
    same = replace(f450(), set=(), initial=(), outputs=study.model.outputs)
    assert study.model == same
