"""Reader of PX4's ULog files, through pyulog: every topic with its own clock, and the angles of its quaternion."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import Any

import numpy as np

from levelone.config.data_files import Column, Content, FloatArray
from levelone.errors import InputError

REREAD = 50
"""Times that the library may read a file over while it looks for undamaged parts: some damage sends it round for ever."""
ATTITUDE, RATES = "vehicle_attitude", "vehicle_angular_velocity"


class _Patient(io.BytesIO):
    """A file in memory that ends a search for undamaged parts that does not end by itself."""

    def __init__(self, content: bytes) -> None:
        super().__init__(content)
        self._left = REREAD * len(content) + 2**20

    def read(self, size: int | None = -1, /) -> bytes:
        """As any file's; RuntimeError, which the library does not take for damage that it can pass, once it is enough."""
        data = super().read(size)
        self._left -= len(data) + 16  # reading nothing is work, too
        if self._left < 0:
            raise RuntimeError("damaged beyond what can be searched through")
        return data


def read_ulog(path: Path, content: bytes) -> Content:
    """Fields of all topics as ``topic.field`` (``topic:1.field`` for a second instance), each with its topic's clock.

    Parameters
    ----------
    path, content
        The file. Times are s from the start of the log.

    Raises
    ------
    InputError
        pyulog is not installed, or the file is damaged.

    Notes
    -----
    ``phi``, ``theta`` and ``psi`` (rad) come from the quaternion of ``vehicle_attitude``, which turns from body axes (forward,
    right, down) to earth axes (north, east, down); ``p``, ``q`` and ``r`` (rad/s) are ``vehicle_angular_velocity.xyz``. All
    other fields have no unit here. What the pilot does is left to be mapped, for its signs differ between versions.
    """
    try:
        from pyulog import ULog
    except ImportError:
        raise InputError(str(path), "ULog files need the library pyulog: pip install levelone[records]") from None
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # the library prints what it finds damaged
            log = ULog(_Patient(content))
        columns: dict[str, Column] = {}
        for topic in log.data_list:
            columns |= _fields(topic, log.start_timestamp)
        notes = _dropouts(log.dropouts)
    except Exception as error:  # damaged files end in errors of many kinds
        raise InputError(str(path), f"is no readable ULog file: {str(error).strip()[:200] or type(error).__name__}") from None
    return _derived(columns) | columns, {}, notes


def _fields(topic: Any, start: int) -> dict[str, Column]:
    name = topic.name if topic.multi_id == 0 else f"{topic.name}:{topic.multi_id}"
    clock = (topic.data["timestamp"].astype(np.int64) - int(start)) * 1e-6
    series = {key: values for key, values in topic.data.items() if key != "timestamp" and values.dtype.kind in "iufb"}
    return {f"{name}.{key}": Column(values.astype(np.float64), clock=clock) for key, values in series.items()}


def _derived(columns: dict[str, Column]) -> dict[str, Column]:
    """Euler angles and body rates under the names of levelone, where the log has them."""
    found: dict[str, Column] = {}
    quaternion = [columns.get(f"{ATTITUDE}.q[{k}]") for k in range(4)]
    if all(part is not None for part in quaternion):
        parts = [part for part in quaternion if part is not None]
        angles = euler(*(part.values for part in parts))
        found |= {name: Column(angle, "rad", parts[0].clock) for name, angle in zip(("phi", "theta", "psi"), angles, strict=True)}
    for k, name in enumerate(("p", "q", "r")):
        rate = columns.get(f"{RATES}.xyz[{k}]")
        if rate is not None:
            found[name] = Column(rate.values, "rad/s", rate.clock)
    return found


def euler(w: FloatArray, x: FloatArray, y: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Roll, pitch and heading, rad, of unit quaternions (scalar first) that turn body axes into earth axes.

    Heading, pitch, roll in this order (Diebel, Representing Attitude, 2006); phi and psi in -pi to pi.
    """
    phi = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    theta = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    return phi, theta, np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def _dropouts(dropouts: Any) -> tuple[str, ...]:
    if not dropouts:
        return ()
    lost = sum(each.duration for each in dropouts) * 1e-3
    return (f"the logger dropped data {len(dropouts)} times, {lost:.3g} s in all",)
