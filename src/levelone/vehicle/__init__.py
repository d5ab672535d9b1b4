"""The vehicle: frozen values, the mixer's two matrices, and arrays of many vehicles for compiled code."""

from levelone.vehicle.batch import TARGET_UNITS, TARGETS, VehicleBatch, batch_of, nominal_value, vary
from levelone.vehicle.mixer import allocation, design_slopes, effectiveness
from levelone.vehicle.tables import RotorTable, Schedule
from levelone.vehicle.vehicle import (
    COEFFICIENTS,
    PID,
    SENSOR_CHANNELS,
    Aerodynamics,
    Airframe,
    Controller,
    MassProperties,
    Pushers,
    Rotors,
    Sensors,
    Validity,
    Vehicle,
)

__all__ = [
    "COEFFICIENTS", "PID", "SENSOR_CHANNELS", "TARGETS", "TARGET_UNITS", "Aerodynamics", "Airframe", "Controller", "MassProperties",
    "Pushers", "RotorTable", "Rotors", "Schedule", "Sensors", "Validity", "Vehicle", "VehicleBatch", "allocation", "batch_of",
    "design_slopes", "effectiveness", "nominal_value", "vary",
]  # fmt: skip
