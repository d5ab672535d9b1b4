"""Study and vehicle files: checked, converted to SI and radians, and made into the package's frozen values.

:mod:`~levelone.config.vehicle_file` and :mod:`~levelone.config.study_file` are imported by name, so that a command on a vehicle
does not wait for the statistics that only a study needs.
"""
