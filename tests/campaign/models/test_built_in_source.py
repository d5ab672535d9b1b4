"""The built-in vehicle behind the door of other models gives what it gives by itself."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest

from levelone.campaign.models.built_in_source import BuiltInSource
from levelone.campaign.models.builtin import BuiltinModel
from levelone.campaign.models.programme import HistoryModel
from levelone.campaign.models.protocol import ModelFailure
from levelone.config.model_table import BuiltInTable, Test
from levelone.config.vehicle_file import load_vehicle, vehicle_path
from levelone.errors import InputError
from levelone.status import Status

TARGETS = ("M", "I_y")
OMEGA = tuple(np.geomspace(0.1, 300.0, 400))
PATH = vehicle_path("reference-evtol")
TABLE = BuiltInTable("built-in", (), (), (), load_vehicle(PATH), PATH, 5.0, "velocity", "own trim")
MODEL = BuiltinModel(TABLE.vehicle, TARGETS)
NOMINAL = (TABLE.vehicle.airframe.mass.mass, TABLE.vehicle.airframe.mass.I_yy)
POINTS = np.array([NOMINAL, (NOMINAL[0] * 1.2, NOMINAL[1] * 0.7)])


def bandwidth(name: str, output: str, sign: int) -> Test:
    given = {"output": output, "sign": sign, "method": "linear", "omega": OMEGA, "response_type": "attitude_command"}
    return Test(name, "bandwidth", "pitch", MODEL.step, **given)


TESTS = (
    Test("quick", "attitude_quickness", "pitch", MODEL.step),
    Test("free", "dynamic_stability", "pitch", MODEL.pulse),
    Test("rise", "translational_rate", None, MODEL.step),
    bandwidth("rate", "q", 1),
    bandwidth("attitude", "theta", -1),
)


def through_the_door(source: BuiltInSource) -> HistoryModel:
    return HistoryModel(source, TESTS, source.targets, NOMINAL, MODEL.boundaries)


def test_the_same_numbers_statuses_and_levels():
    model = through_the_door(BuiltInSource(TABLE, TARGETS))
    answer, own = model.evaluate(POINTS), MODEL.assess(POINTS)
    same = {name: name for name in own.responses.names if name in model.names}
    assert len(same) == 9
    same |= {"omega_bw": "omega_bw_phase_rate", "tau_p": "tau_p_rate"}
    for theirs, ours in same.items():
        column, there = model.names.index(ours), own.responses.names.index(theirs)
        np.testing.assert_array_equal(answer.values[:, column], own.responses.values[:, there], err_msg=theirs)
        np.testing.assert_array_equal(answer.status[:, column], own.responses.status[:, there], err_msg=theirs)
    criteria = ("attitude_quickness", "dynamic_stability", "translational_rate", "bandwidth")
    assert model.judged == ("quick", "free", "rise", "attitude")
    np.testing.assert_array_equal(answer.levels, np.column_stack([own.levels[name] for name in criteria]))


def test_a_flight_outside_the_aerodynamics_keeps_its_caution():
    narrow = replace(TABLE.vehicle, validity=replace(TABLE.vehicle.validity, alpha=(-0.01, 0.01)))
    answer = through_the_door(BuiltInSource(replace(TABLE, vehicle=narrow), TARGETS)).evaluate(POINTS[:1])
    flown = answer.status[0, :7]
    assert flown.tolist() == [Status.INCIDENCE_OUTSIDE] * 7
    assert np.isfinite(answer.values[0, :7]).all()


@pytest.mark.parametrize(
    ("targets", "point", "status", "words"),
    [
        (("M", "I_y"), (-1.0, 1.0), Status.MODEL_FAILED, "must be positive"),
        (("tau_d", "I_y"), (9.0, NOMINAL[1]), Status.MODEL_FAILED, "longer than the delay buffer"),
        (("M", "I_y"), (1e6, NOMINAL[1]), Status.TRIM_FAILED, "no trim found"),
    ],
)
def test_a_point_that_cannot_fly_is_a_failure_of_its_own(targets, point, status, words):
    source = BuiltInSource(TABLE, targets)
    with pytest.raises(ModelFailure, match=words) as caught:
        source.fly(np.array(point), MODEL.step)
    assert caught.value.status is status


def test_a_manoeuvre_that_no_vehicle_flies_is_a_mistake():
    source = BuiltInSource(TABLE, TARGETS)
    with pytest.raises(InputError, match="controller_rate"):
        source.fly(POINTS[0], replace(MODEL.step, controller_rate=100.0, dt=0.005))
    with pytest.raises(InputError, match="did you mean 'C_malpha'"):
        BuiltInSource(TABLE, ("C_m_alpha",))


def test_key_is_that_of_the_vehicles_numbers_and_travels():
    source = BuiltInSource(TABLE, TARGETS)
    assert json.loads(json.dumps(source.key)) == pickle.loads(pickle.dumps(source)).key  # noqa: S301
    heavier = replace(TABLE.vehicle, airframe=replace(TABLE.vehicle.airframe, mass=replace(TABLE.vehicle.airframe.mass, mass=9.0)))
    for other in (replace(TABLE, vehicle=heavier), replace(TABLE, start="design trim"), replace(TABLE, trim_speed=6.0)):
        assert BuiltInSource(other, TARGETS).key != source.key
