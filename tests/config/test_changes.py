"""Changes by path: each reaches the vehicle and nothing else does; what cannot be changed is refused by name."""

from __future__ import annotations

import numpy as np
import pytest

from levelone.config.changes import changed
from levelone.config.vehicle_file import load_vehicle
from levelone.errors import InputError

NOMINAL = load_vehicle("reference-evtol")


def test_numbers_are_changed_in_the_unit_of_the_file():
    craft = load_vehicle("reference-evtol", {"controller.pitch_rate.Kp": 6.5, "controller.attitude_limit": 20.0})
    assert craft.controller.pitch_rate.Kp == 6.5
    assert craft.controller.attitude_limit == pytest.approx(np.radians(20.0))
    assert craft.controller.pitch_rate.Ki == NOMINAL.controller.pitch_rate.Ki
    assert craft.airframe.mass == NOMINAL.airframe.mass


def test_points_are_stretched_and_the_controller_is_designed_for_it():
    craft = load_vehicle("reference-evtol", {"rotors.position.x": 1.5})
    np.testing.assert_array_equal(craft.airframe.rotors.position, NOMINAL.airframe.rotors.position * [1.5, 1.0, 1.0])
    assert craft.controller.design is craft.airframe


def test_texts_and_optional_numbers_can_be_changed():
    craft = load_vehicle("reference-evtol", {"rotors.velocity": "local", "rotors.throttle_exponent": 0.7})
    assert craft.airframe.rotors.local_velocity
    assert craft.airframe.rotors.throttle_exponent == 0.7
    assert NOMINAL.airframe.rotors.throttle_exponent == 1.0


def test_all_changes_of_a_file_share_its_rotor_table():
    assert load_vehicle("reference-evtol", {"rotors.motor_lag": 0.02}).airframe.rotors.table is NOMINAL.airframe.rotors.table


def test_the_content_itself_stays_as_it_was():
    content = {"a": {"b": {"value": 1.0, "unit": "m"}}}
    assert changed(content, {"a.b": 2.0})["a"]["b"]["value"] == 2.0
    assert content["a"]["b"]["value"] == 1.0


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        (
            {"controller.pitch_rte.Kp": 1.0},
            r"reference-evtol\.toml: controller: unknown name 'pitch_rte'; did you mean 'pitch_rate'",
        ),
        ({"controler.pitch": 1.0}, r"unknown name 'controler'; did you mean 'controller'"),
        ({"controller.pitch_rate": 1.0}, r"controller\.pitch_rate: is no single number or text"),
        ({"rotors.spin": 1.0}, r"rotors\.spin: is no single number or text"),
        ({"controller.pitch": "much"}, r"controller\.pitch: is 'much', must be a number"),
        ({"rotors.spin.x": 2.0}, r"rotors\.spin\.x: is no list of points"),
        ({"rotors.motor_lag": -0.1}, r"rotors\.motor_lag: must not be negative"),
        ({"rotors.velocity": "global"}, r"rotors\.velocity: 'global' is not among the choices"),
    ],
)
def test_what_cannot_be_changed_is_refused(changes, text):
    with pytest.raises(InputError, match=text):
        load_vehicle("reference-evtol", changes)
