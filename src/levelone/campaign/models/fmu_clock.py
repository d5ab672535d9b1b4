"""How time passes in an FMU: the calls between instantiation and the end of a run, for both modes and versions of the standard.

An input is held from one communication point to the next, in both modes. A co-simulation integrates itself. A model exchange is
integrated to the next communication point or event (:mod:`levelone.campaign.models.fmu_states`); a changed input is an event.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from levelone.campaign.models.fmu_archive import library
from levelone.campaign.models.fmu_states import SAME_TIME, ContinuousStates
from levelone.campaign.models.protocol import ModelFailure
from levelone.status import Status

#: relative tolerance of a model exchange whose study states none; the absolute one is this times a state's nominal value, which
#: mostly is 1, and responses to be read are a few hundredths: a usual 1e-4 would be seen in them
TOLERANCE = 1e-8
#: event iterations at one time before they are taken for endless
MOST_ITERATIONS = 1000


References = Mapping[str, tuple[int, str]]


class Clock(Protocol):
    """An FMU between instantiation and the end of a run; times are the FMU's own, s from 0."""

    def begin(self, start: Mapping[str, float], inputs: Sequence[tuple[str, float]]) -> None:
        """Initialise with start values and inputs, by name."""

    def hold(self, name: str, value: float) -> None:
        """Value of an input from now on."""

    def advance(self, time: float, step: float) -> None:
        """From ``time`` to ``time + step``; raises ModelFailure where the FMU ends the run itself."""


def _initialise(
    fmu: Any, description: Any, start: Mapping[str, float], tolerance: float | None, inputs: Callable[[], None]
) -> None:
    """From instantiated to initialised, at time 0; no stop time is stated, since none of the run's depends on it."""
    simulation = library().simulation
    second = description.fmiVersion == "2.0"
    if second:
        fmu.setupExperiment(tolerance=tolerance, startTime=0.0)
    left = simulation.apply_start_values(fmu, description, dict(start), settable=simulation.settable_in_instantiated)
    if second:
        fmu.enterInitializationMode()
    else:
        fmu.enterInitializationMode(tolerance=tolerance, startTime=0.0)
    simulation.apply_start_values(fmu, description, left, settable=simulation.settable_in_initialization_mode)
    inputs()
    fmu.exitInitializationMode()


class _Inputs:
    """Inputs by name: what is held, and what has changed since the FMU was last told."""

    def __init__(self, fmu: Any, references: References) -> None:
        self._set = {name: (getattr(fmu, f"set{kind}"), [reference]) for name, (reference, kind) in references.items()}
        self._held: dict[str, float] = {}
        self._changed: set[str] = set()

    def hold(self, name: str, value: float) -> None:
        if self._held.get(name) != value:
            self._held[name] = value
            self._changed.add(name)

    @property
    def changed(self) -> bool:
        return bool(self._changed)

    def tell(self) -> None:
        for name in self._changed:
            setter, reference = self._set[name]
            setter(reference, [self._held[name]])
        self._changed.clear()


class CoSimulation:
    """An FMU that integrates itself."""

    def __init__(self, fmu: Any, description: Any, references: References) -> None:
        self._fmu, self._description = fmu, description
        self._inputs = _Inputs(fmu, references)
        self.hold = self._inputs.hold
        self._second = description.fmiVersion == "2.0"

    def begin(self, start: Mapping[str, float], inputs: Sequence[tuple[str, float]]) -> None:
        for name, value in inputs:
            self.hold(name, value)
        _initialise(self._fmu, self._description, start, None, self._inputs.tell)

    def advance(self, time: float, step: float) -> None:
        self._inputs.tell()
        if self._second:
            self._fmu.doStep(currentCommunicationPoint=time, communicationStepSize=step)
            return
        _, ended, early, reached = self._fmu.doStep(currentCommunicationPoint=time, communicationStepSize=step)
        if ended:
            raise ModelFailure(Status.DIVERGED, f"the FMU asked to end the run at its time {reached:.6g} s")
        if early and reached < time + step - SAME_TIME:
            raise ModelFailure(Status.MODEL_FAILED, f"the FMU stopped early at its time {reached:.6g} s, which was not allowed")


class ModelExchange:
    """An FMU that states derivatives and events."""

    def __init__(self, fmu: Any, description: Any, references: References, tolerance: float | None, step: float) -> None:
        self._fmu, self._description, self._step = fmu, description, step
        self._inputs = _Inputs(fmu, references)
        self.hold = self._inputs.hold
        self._tolerance = TOLERANCE if tolerance is None else tolerance
        self._second = description.fmiVersion == "2.0"
        self._update = fmu.newDiscreteStates if self._second else fmu.updateDiscreteStates
        self._next_event = math.inf

    def begin(self, start: Mapping[str, float], inputs: Sequence[tuple[str, float]]) -> None:
        for name, value in inputs:
            self.hold(name, value)
        _initialise(self._fmu, self._description, start, self._tolerance, self._inputs.tell)
        self._iterate(0.0)
        self._fmu.enterContinuousTimeMode()
        self._states = ContinuousStates(self._fmu, self._description, self._tolerance, self._step)

    def advance(self, time: float, step: float) -> None:
        if self._inputs.changed:
            self._event(time)
        target, events = time + step, 0
        while time < target - SAME_TIME:
            reached, state_event = self._states.advance(time, min(target, max(self._next_event, time)))
            time = reached
            if self._completed(time) or state_event or time >= self._next_event - SAME_TIME:
                self._event(time)
                events += 1
            if events > MOST_ITERATIONS:
                raise ModelFailure(Status.MODEL_FAILED, f"more than {MOST_ITERATIONS} events before the FMU's time {target:.6g} s")

    def _completed(self, time: float) -> bool:
        if self._second and not self._description.modelExchange.needsCompletedIntegratorStep:
            return False
        event, ended = self._fmu.completedIntegratorStep()
        if ended:
            raise ModelFailure(Status.DIVERGED, f"the FMU asked to end the run at its time {time:.6g} s")
        return bool(event)

    def _event(self, time: float) -> None:
        """Event mode at ``time``, with the inputs as they are held from now on."""
        self._fmu.enterEventMode()
        self._inputs.tell()
        self._iterate(time)
        self._fmu.enterContinuousTimeMode()
        self._states.read()

    def _iterate(self, time: float) -> None:
        for _ in range(MOST_ITERATIONS):
            again, ended, _, _, defined, at = self._update()
            if ended:
                raise ModelFailure(Status.DIVERGED, f"the FMU asked to end the run at its time {time:.6g} s")
            if not again:
                self._next_event = float(at) if defined else math.inf
                return
        raise ModelFailure(Status.MODEL_FAILED, f"events of the FMU do not come to an end at its time {time:.6g} s")
