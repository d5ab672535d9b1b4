"""The built-in vehicle behind the same door as anybody's model: one run, or one linearisation, for each point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from levelone.campaign.models.builtin import outside_validity
from levelone.campaign.models.keys import plain, value_digest, versions
from levelone.campaign.models.protocol import FloatArray, ModelFailure
from levelone.config.manoeuvres import integration_step
from levelone.dynamics import linearize, simulate
from levelone.dynamics.simulate import CHANNEL_UNITS, check_before_flight
from levelone.errors import InputError, unknown_name
from levelone.handling.frequency import FrequencyResponse
from levelone.handling.history import TimeHistory
from levelone.handling.manoeuvres import Manoeuvre
from levelone.status import Status
from levelone.vehicle import TARGETS, VehicleBatch, batch_of, vary

if TYPE_CHECKING:
    from levelone.config.model_table import BuiltInTable


@dataclass(frozen=True, eq=False)
class BuiltInSource:
    """The built-in flight simulation model as a source of time histories and of exact frequency responses.

    Parameters
    ----------
    table
        Vehicle, trim speed, flight mode, and from which trim a varied vehicle begins.
    targets
        What the columns of a point set (:data:`levelone.vehicle.TARGETS`).

    Raises
    ------
    InputError
        A target that the vehicle does not have.
    """

    table: BuiltInTable
    targets: tuple[str, ...]

    def __post_init__(self) -> None:
        for target in self.targets:
            if target not in TARGETS:
                raise unknown_name("target", target, TARGETS)

    @property
    def key(self) -> Mapping[str, Any]:
        """The vehicle's numbers, the condition, and the versions of what compiles the simulation."""
        table = self.table
        return {
            "kind": table.kind,
            "vehicle": value_digest(table.vehicle),
            "trim_speed": table.trim_speed,
            "flight_mode": table.flight_mode,
            "start": table.start,
            "targets": plain(self.targets),
            "versions": versions("numba", "numpy"),
        }

    def check(self, manoeuvre: Manoeuvre) -> None:
        """InputError for a manoeuvre that the nominal vehicle cannot fly, and so no other."""
        check_before_flight(batch_of(self.table.vehicle), manoeuvre)

    def fly(self, point: FloatArray, manoeuvre: Manoeuvre) -> TimeHistory:
        """One run; its status is a caution where it left the validity of the vehicle's aerodynamics.

        See :class:`levelone.campaign.models.protocol.HistorySource`.
        """
        batch = self._varied(point)
        try:
            history = simulate(batch, manoeuvre, channels=tuple(CHANNEL_UNITS), start=self.table.start)
        except InputError as error:
            self.check(manoeuvre)  # what the nominal vehicle cannot fly either is the user's mistake
            raise ModelFailure(Status.MODEL_FAILED, str(error)) from None
        _refuse(history.status)
        incidence, drag = outside_validity(history, self.table.vehicle.validity)
        caution = np.where(incidence, Status.INCIDENCE_OUTSIDE, np.where(drag, Status.NEGATIVE_DRAG, history.status))
        return replace(history, status=caution.astype(np.int64))

    def frequency_response(self, point: FloatArray, command: str, output: str, omega: FloatArray) -> FrequencyResponse:
        """Response of the linearised closed loop, delay and sampling exact.

        See :class:`levelone.campaign.models.protocol.LinearSource`.

        Raises
        ------
        ModelFailure
            No trim, or a linearisation that does not settle.
        InputError
            A command or output that there is not, a frequency beyond Nyquist.
        """
        table = self.table
        dt = integration_step(table.vehicle.controller)
        model = linearize(self._varied(point), table.trim_speed, flight_mode=table.flight_mode, dt=dt)
        _refuse(model.status)
        return model.frequency_response(command, output, omega).select(0)

    def _varied(self, point: FloatArray) -> VehicleBatch:
        try:
            return vary(self.table.vehicle, self.targets, np.atleast_2d(point), self.table.trim_speed)
        except InputError as error:  # the targets are known: no vehicle can have these numbers
            raise ModelFailure(Status.MODEL_FAILED, str(error)) from None


def _refuse(status: Any) -> None:
    code = Status(int(status[0]))
    if code.failed:
        raise ModelFailure(code, code.text)
