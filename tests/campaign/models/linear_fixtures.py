"""A speed loop around a pitch loop as matrices and as a file: the same aircraft for every kind of model.

    V' = X_u V - g theta        theta' = q        q' = m
    m' = (m_c - m) / tau        i' = V_ref - V
    m_c = K_V (V - V_ref) - K_theta theta - k K_q q - K_m m - K_i i

V is the ground speed forward and theta is positive nose up, both as changes from trim; m is the pitch acceleration that the
actuators give. With k = 1 the poles are a pair at 5.61 rad/s with damping 0.364, and -0.51, -1.58 and -16.0 rad/s.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm, logm, schur, solve_sylvester

from levelone.dynamics.controller import COMMANDS
from levelone.dynamics.linearize import linearize
from levelone.vehicle import SENSOR_CHANNELS, Vehicle

FloatArray = NDArray[np.float64]

GRAVITY = 9.80665
RATE_GAIN = -136.0


class Names(NamedTuple):
    """What the rows and columns mean: m/s, rad, rad/s, rad/s^2, m; m/s; rad, rad/s, m/s."""

    states: tuple[str, ...] = ("V", "theta", "q", "m", "i")
    inputs: tuple[str, ...] = ("V_ref",)
    outputs: tuple[str, ...] = ("theta", "q", "V_lon")


def reference_system(rate_gain: float = 1.0) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, Names]:
    """A [5, 5], B [5, 1], C [3, 5], D [3, 1] and the names; ``rate_gain`` is k, the factor on the feedback of the pitch rate."""
    A = np.array(
        [
            [-0.15, -GRAVITY, 0.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 1.0, 0.0],
            [104.0, -700.0, RATE_GAIN * rate_gain, -22.0, -41.0],
            [-1.0, 0.0, 0.0, 0.0, 0.0],
        ]
    )
    B = np.array([[0.0], [0.0], [0.0], [-104.0], [1.0]])
    C = np.array([[0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0, 0.0]])
    return A, B, C, np.zeros((3, 1)), Names()


REFERENCE_FILE = """\
[system]
name = "speed loop around a pitch loop"

[parameters]
A_mq = -136.0

[states]
names = ["V", "theta", "q", "m", "i"]
units = ["m/s", "rad", "rad/s", "rad/s^2", "m"]

[inputs]
names = ["V_ref"]
units = ["m/s"]

[outputs]
names = ["theta", "q", "V_lon"]
units = ["rad", "rad/s", "m/s"]

[matrices]
A = [
  [-0.15, -9.80665, 0.0, 0.0, 0.0],
  [0.0, 0.0, 1.0, 0.0, 0.0],
  [0.0, 0.0, 0.0, 1.0, 0.0],
  [104.0, -700.0, "A_mq", -22.0, -41.0],
  [-1.0, 0.0, 0.0, 0.0, 0.0],
]
B = [[0.0], [0.0], [0.0], [-104.0], [1.0]]
C = [
  [0.0, 1.0, 0.0, 0.0, 0.0],
  [0.0, 0.0, 1.0, 0.0, 0.0],
  [1.0, 0.0, 0.0, 0.0, 0.0],
]
"""


def write_reference(path: Path) -> Path:
    """The same system as a state-space file; its parameter ``A_mq`` is ``RATE_GAIN`` times ``rate_gain``."""
    path.write_text(REFERENCE_FILE, encoding="utf-8")
    return path


def builtin_system(vehicle: Vehicle, speed: float) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """A, B, C and the input's delay (s) of the built-in closed loop about a trim: from V_lon_ref to theta, q and V_lon.

    The sampled loop, its delays lifted into states, has poles at z = 0 that no continuous system has. They are split off (ordered
    Schur form, then a Sylvester equation); what is left has a logarithm. A continuous system with an input held from tick to tick,
    and a whole number of ticks late, then gives the same samples from that number of ticks on; before, the answer of the loop is
    the short one that was split off.
    """
    model = linearize(vehicle, speed)
    lifted, period = model._lifted(0), model.period
    ports = [model._lifted_ports(0, COMMANDS.index("V_lon"), SENSOR_CHANNELS.index(name)) for name in ("theta", "q", "V_lon")]
    drive, read = ports[0][0], np.stack([row for _, row in ports])
    triangle, basis, kept = schur(lifted, sort=lambda re, im: np.hypot(re, im) > 1e-3)
    slow, fast, mixed = triangle[:kept, :kept], triangle[kept:, kept:], triangle[:kept, kept:]
    coupling = solve_sylvester(slow, -fast, -mixed)
    entry, out = basis.T @ drive, read @ basis
    into, outs = entry[:kept] - coupling @ entry[kept:], out[:, :kept]
    short = out[:, :kept] @ coupling + out[:, kept:]
    late, left = 0, entry[kept:]
    while np.abs(short @ left).max() > 1e-13 * np.abs(outs @ into).max() and late < len(fast):
        late, left = late + 1, fast @ left
    A = np.real(logm(slow)) / period
    both = expm(np.block([[A, np.eye(kept)], [np.zeros((kept, 2 * kept))]]) * period)
    B = np.linalg.solve(both[:kept, kept:], np.linalg.matrix_power(slow, late) @ into)
    return A, B[:, None], outs, late * period


def write_builtin(path: Path, vehicle: Vehicle, speed: float) -> Path:
    """The built-in closed loop as a state-space file; inputs and outputs as in :data:`REFERENCE_FILE`."""
    A, B, C, delay = builtin_system(vehicle, speed)
    names = [f"x_{i}" for i in range(len(A))]
    path.write_text(
        "\n".join(
            [
                '[system]\nname = "built-in closed loop"\n',
                f"[states]\nnames = {json.dumps(names)}\nunits = {json.dumps(['1'] * len(A))}\n",
                f'[inputs]\nnames = ["V_ref"]\nunits = ["m/s"]\ndelay = [{delay!r}]\n',
                '[outputs]\nnames = ["theta", "q", "V_lon"]\nunits = ["rad", "rad/s", "m/s"]\n',
                "[matrices]",
                *(f"{name} = {json.dumps(matrix.tolist())}" for name, matrix in (("A", A), ("B", B), ("C", C))),
            ]
        ),
        encoding="utf-8",
    )
    return path
