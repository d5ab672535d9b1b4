"""Deceleration to hover in a study file: the pilot, the tolerances, and what the vehicle must be able to fly."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields, replace

from levelone.config.factor_table import Inputs, check_corners
from levelone.config.manoeuvres import held_trim
from levelone.config.quantities import Quantity
from levelone.config.schema import in_section
from levelone.config.study_schema import DecelerationTable, PilotTable, ToleranceTable
from levelone.config.study_sections import Deceleration
from levelone.errors import InputError
from levelone.handling.capture import Tolerances
from levelone.handling.pilot import Pilot
from levelone.vehicle import Controller, Vehicle


def deceleration_of(table: DecelerationTable | None, inputs: Inputs, paths: Sequence[str], vehicle: Vehicle) -> Deceleration | None:
    """The deceleration to hover.

    Parameters
    ----------
    table
        The section; None gives None.
    inputs, paths
        The study's factors, and the path of each in the file: every corner must be able to fly at every speed.
    vehicle
        The nominal vehicle.

    Raises
    ------
    InputError
        Not one distance for each speed, a speed beyond the controller's trim table or the rotor table, a record too short for the
        distance, an adequate tolerance tighter than the desired one.
    """
    if table is None:
        return None
    with in_section("deceleration"):
        _check_lengths(table)
        _check_speeds(table, vehicle.controller)
        made = Deceleration(
            speeds=tuple(table.speeds),
            distances=tuple(table.distances),
            duration=table.duration,
            hold=table.hold,
            pilot=Pilot(**dict(_numbers(table.pilot)), distance=table.distances[0]),
            desired=Tolerances(**dict(_numbers(table.desired))),
            adequate=Tolerances(**dict(_numbers(table.adequate))),
        )
        _check_tolerances(made.desired, made.adequate)
        _check_flight(made, inputs, paths, vehicle)
        return made


def _check_lengths(table: DecelerationTable) -> None:
    if len(table.distances) != len(table.speeds):
        raise InputError("distances", f"holds {len(table.distances)} distances for {len(table.speeds)} speeds")
    if not table.hold > 0.0:
        raise InputError("hold", f"is {table.hold:g} s, must be positive")
    for i, (speed, distance) in enumerate(zip(table.speeds, table.distances, strict=True), 1):
        if not speed > 0.0:
            raise InputError(f"speeds.{i}", f"is {speed:g} m/s, must be positive")
        if speed in table.speeds[: i - 1]:
            raise InputError(f"speeds.{i}", f"{speed:g} m/s is given twice")
        if not distance > 0.0:
            raise InputError(f"distances.{i}", f"is {distance:g} m, must be positive")
        if distance / speed + table.hold >= table.duration:
            raise InputError(
                "duration", f"is {table.duration:g} s: too short for {distance:g} m at {speed:g} m/s and a hold of {table.hold:g} s"
            )


def _check_speeds(table: DecelerationTable, controller: Controller) -> None:
    """Refuse speeds at which the controller's feed-forward would stand at an end of its table."""
    first, last, _ = controller.trim_speeds
    for i, speed in enumerate(table.speeds, 1):
        if speed > last:
            raise InputError(f"speeds.{i}", f"is {speed:g} m/s, and the controller's trim table ends at {last:g} m/s")
    if -table.pilot.reverse.value < first:
        raise InputError("pilot.reverse", f"is {table.pilot.reverse.value:g} m/s, and the trim table begins at {first:g} m/s")


def _numbers(table: PilotTable | ToleranceTable) -> Iterator[tuple[str, float]]:
    return ((name, float(part.value)) for name in type(table).model_fields if isinstance(part := getattr(table, name), Quantity))


def _check_tolerances(desired: Tolerances, adequate: Tolerances) -> None:
    for field in fields(Tolerances):
        wide, tight = getattr(adequate, field.name), getattr(desired, field.name)
        if wide < tight:
            raise InputError(f"adequate.{field.name}", f"is {wide:g}, tighter than the desired {tight:g} (SI)")


def _check_flight(made: Deceleration, inputs: Inputs, paths: Sequence[str], vehicle: Vehicle) -> None:
    for i, speed in enumerate(made.speeds, 1):
        held = replace(held_trim(vehicle.controller, speed), duration=made.duration)
        try:
            check_corners(inputs, paths, vehicle, (held,))
        except InputError as error:
            raise InputError(f"speeds.{i}", error.problem) from None
