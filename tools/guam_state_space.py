"""State-space files of NASA's lift+cruise aircraft (GUAM) at low speed, from a JSON file of its trim and gain table.

    python tools/guam_state_space.py guam_longitudinal.json --out guam [--without-actuators]

writes one file a trim point, ``guam/u00.00.toml`` and so on by speed in ft/s, with the velocity loop closed around the aircraft.
The JSON file holds ``points``, each with ``u_ft_s``, ``A`` [4, 4], ``B`` [4, 11], ``W_diag`` [12], ``Kx`` [3, 4] and ``Ki`` [3, 3]:
the entries Ap, Bp, W, Kx and Ki of the table that the aircraft's own simulation interpolates (longitudinal, no climb). States are
u, w (ft/s, heading frame), q and theta; inputs are the speeds of nine rotors, then elevator and flap.

The loop is the one of Cook, "Examination of Unified Control Approaches Incorporating Generalized Control Allocation" (AIAA
2021-0999), as the simulation's design function ``ctrl_lon.m`` closes it:

    m = -Kx x - Ki e                       accelerations that are asked for: u', w', q'
    (rotors, elevator, flap, theta_c) = W^-1 E^T (E W^-1 E^T)^-1 m,     E = [B, A's column of theta] in the rows u, w, q
    e_u' = u - u_ref,  e_w' = w - w_ref,  e_q' = q + theta - theta_c

Pitch attitude is a control among others there: its share theta_c is not sent to an actuator but followed through e_q.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

STATES = ("u", "w", "q", "theta")
ROTORS = tuple(f"rotor_{i}" for i in range(1, 10))
INPUTS = (*ROTORS, "elevator", "flap")
ROTOR_OMEGA = 4.0 * np.pi  # rad/s: 2 Hz, setupEngines.m of the simulation
SURFACE_OMEGA = 20.0  # rad/s, setupActuators.m
ZETA = 0.7  # both
SHAPES = {"A": (4, 4), "B": (4, 11), "W_diag": (12,), "Kx": (3, 4), "Ki": (3, 3)}


def read_points(path: Path) -> list[dict[str, Any]]:
    """The trim points of the JSON file as arrays; SystemExit says what is wrong with it."""
    content = json.loads(path.read_text(encoding="utf-8"))
    points = []
    for number, given in enumerate(content["points"]):
        point = {"u_ft_s": float(given["u_ft_s"])} | {name: np.asarray(given[name], dtype=float) for name in SHAPES}
        for name, shape in SHAPES.items():
            if point[name].shape != shape:
                raise SystemExit(f"points[{number}].{name} has shape {point[name].shape}, must be {shape}")
        if np.abs(point["Kx"][:, 3]).max() > 0.0:
            raise SystemExit(f"points[{number}].Kx: its last column (theta) must be zero, since theta is a control of this law")
        points.append(point)
    return points


def state_space(point: Mapping[str, Any], actuators: bool = True) -> str:
    """A state-space file of one trim point, in feet and radians as the table has them."""
    effect = np.hstack([point["B"][:3], point["A"][:3, 3:]])
    return "\n".join(
        [
            _table("system", name=f"GUAM lift+cruise, velocity loop at {point['u_ft_s']:.1f} ft/s",
                   source="nasa/Generic-Urban-Air-Mobility-GUAM, trim and gain table of the lift+cruise aircraft; NOSA 1.3"),
            _table("states", names=STATES, units=("ft/s", "ft/s", "rad/s", "rad")),
            _table("inputs", names=INPUTS, units=("rad/s",) * 9 + ("rad",) * 2),
            _table("matrices", A=point["A"], B=point["B"]),
            _actuators() if actuators else "",
            _table("feedback", controls=("u_dot", "w_dot", "q_dot"), internal=("theta_c",), states=STATES[:3],
                   Kx=point["Kx"][:, :3], sign_x=-1, Ki=point["Ki"], sign_i=-1),
            _table("feedback.commands", names=("u_ref", "w_ref"), units=("ft/s", "ft/s")),
            "[[feedback.integral]]\nof = { u = 1.0 }\ncommand = \"u_ref\"\n",
            "[[feedback.integral]]\nof = { w = 1.0 }\ncommand = \"w_ref\"\n",
            "[[feedback.integral]]\nof = { q = 1.0, theta = 1.0, theta_c = -1.0 }\n",
            _table("allocation", controls=(*INPUTS, "theta_c"), weights=point["W_diag"], effect=effect),
        ]
    )  # fmt: skip


def _actuators() -> str:
    groups = ((ROTORS, ROTOR_OMEGA), (INPUTS[9:], SURFACE_OMEGA))
    return "\n".join(_table("[actuator]", inputs=names, omega=float(omega), zeta=ZETA) for names, omega in groups)


def _table(section: str, **entries: Any) -> str:
    return "\n".join([f"[{section}]", *(f"{name} = {_value(entry)}" for name, entry in entries.items()), ""])


def _value(entry: str | float | Sequence[str] | NDArray[np.float64]) -> str:
    """A value as TOML, which writes texts, numbers and their lists as JSON does."""
    return json.dumps(entry.tolist() if isinstance(entry, np.ndarray) else entry)


def main() -> None:
    """Write the files that the module's text names."""
    parser = argparse.ArgumentParser(description="State-space files from a JSON file of GUAM's trim and gain table.")
    parser.add_argument("file", type=Path)
    parser.add_argument("--out", type=Path, default=Path("guam"))
    parser.add_argument("--without-actuators", action="store_true")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    for point in read_points(given.file):
        path = given.out / f"u{point['u_ft_s']:05.2f}.toml"
        path.write_text(state_space(point, not given.without_actuators), encoding="utf-8")
        print(path)


if __name__ == "__main__":
    main()
