"""Continuous states of an FMU in model exchange: integrated from one time to another, or to the first state event between them.

The integrator is SciPy's ``dopri5``, the explicit Runge-Kutta pair of order 5(4) with step control of Dormand and Prince (Hairer,
Norsett and Wanner, *Solving Ordinary Differential Equations I*, 2nd edition, section II.5). A method of one step loses nothing
where an input changes, as it does at every communication point of a sweep; the solvers of several steps that simulators of FMUs
usually bring begin there anew at first order, which was fifty times slower. Very stiff units need too many of its steps, and are
refused rather than integrated badly.
"""

from __future__ import annotations

from ctypes import POINTER, c_double
from typing import Any

import numpy as np
from scipy.integrate import ode

from levelone.campaign.models.protocol import FloatArray, ModelFailure
from levelone.status import Status

SAME_TIME = 1e-12
#: s to which the time of a state event is found
EVENT_TIME = 1e-9
#: steps of the integrator between two communication points
MOST_STEPS = 2000


class ContinuousStates:
    """States of one instance, which is in continuous-time mode whenever a method is called.

    Parameters
    ----------
    fmu, description
        The instance and its description, of FMPy.
    tolerance
        Relative; the absolute one of a state is this times its nominal value.
    step
        s between communication points: the first step that is tried.
    """

    def __init__(self, fmu: Any, description: Any, tolerance: float, step: float) -> None:
        self._fmu = fmu
        self._rates = fmu.getDerivatives if description.fmiVersion == "2.0" else fmu.getContinuousStateDerivatives
        self._x, self._px = _vector(description.numberOfContinuousStates)
        self._dx, self._pdx = _vector(description.numberOfContinuousStates)
        self._z, self._pz = _vector(description.numberOfEventIndicators)
        self._error: Exception | None = None
        nominal, pointer = _vector(self._x.size)
        if self._x.size:
            fmu.getNominalsOfContinuousStates(pointer, self._x.size)
        # the integrator sees states over their nominal values: its absolute tolerance is one number
        self._nominal = np.where(nominal > 0.0, nominal, 1.0)
        options = {"rtol": tolerance, "atol": tolerance, "nsteps": MOST_STEPS, "first_step": step}
        self._solver = ode(self._derivative).set_integrator("dopri5", **options)
        self.read()

    def read(self) -> None:
        """States and the sides of the event indicators as the instance has them, after an event."""
        if self._x.size:
            self._fmu.getContinuousStates(self._px, self._x.size)
        self._sides = self._indicators()

    def advance(self, time: float, target: float) -> tuple[float, bool]:
        """Integrate; the time reached, and whether a state event is there, just behind which the states then are.

        Raises
        ------
        ModelFailure
            DIVERGED: the integration failed.
        """
        if target <= time + SAME_TIME:
            return time, False
        begin = self._x.copy()
        self._set(target, self._integrated(begin, time, target))
        if not self._crossed():
            return target, False
        before, behind = time, target
        while behind - before > EVENT_TIME:
            middle = 0.5 * (before + behind)
            self._set(middle, self._integrated(begin, time, middle))
            before, behind = (before, middle) if self._crossed() else (middle, behind)
        self._set(behind, self._integrated(begin, time, behind))
        return behind, True

    def _set(self, time: float, states: FloatArray) -> None:
        self._fmu.setTime(time)
        if self._x.size:
            self._x[:] = states
            self._fmu.setContinuousStates(self._px, self._x.size)

    def _indicators(self) -> np.ndarray:
        if self._z.size:
            self._fmu.getEventIndicators(self._pz, self._z.size)
        return self._z > 0.0

    def _crossed(self) -> bool:
        return bool((self._indicators() != self._sides).any())

    def _integrated(self, begin: FloatArray, time: float, target: float) -> FloatArray:
        if not self._x.size:
            return begin
        end = self._solver.set_initial_value(begin / self._nominal, time).integrate(target) * self._nominal
        if self._error is not None:
            raise self._error
        if not self._solver.successful() or not np.isfinite(end).all():
            raise ModelFailure(
                Status.DIVERGED,
                f"the integration of the FMU failed between its times {time:.6g} and {target:.6g} s: states grow beyond bounds,"
                f" or more than {MOST_STEPS} steps are needed (a very stiff unit: export it for co-simulation)",
            )
        return np.asarray(end, dtype=np.float64)

    def _derivative(self, time: float, states: FloatArray) -> FloatArray:
        """An error is kept: inside the integrator's callback it would not reach the caller in its own words."""
        try:
            self._set(time, states * self._nominal)
            self._rates(self._pdx, self._dx.size)
            self._dx /= self._nominal
        except Exception as error:
            self._error = self._error or error
            self._dx[:] = np.nan
        return self._dx


def _vector(size: int) -> tuple[FloatArray, Any]:
    """Numbers, and the address that C writes them to."""
    numbers = np.zeros(size)
    return numbers, numbers.ctypes.data_as(POINTER(c_double))
