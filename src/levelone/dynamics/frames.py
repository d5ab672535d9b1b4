"""Quaternion attitude. (q0, q1, q2, q3) turns body axes into north-east-down; q0 is the scalar part.

Source: Stevens, Lewis and Johnson, Aircraft Control and Simulation, 3rd ed., section 1.8.
"""

from __future__ import annotations

import math

from levelone.compiled import inlined


@inlined
def to_earth(q0, q1, q2, q3, x, y, z):
    """Components of a body-axis vector in north-east-down."""
    return (
        (q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3) * x + 2.0 * ((q1 * q2 - q0 * q3) * y + (q1 * q3 + q0 * q2) * z),
        (q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3) * y + 2.0 * ((q1 * q2 + q0 * q3) * x + (q2 * q3 - q0 * q1) * z),
        (q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3) * z + 2.0 * ((q1 * q3 - q0 * q2) * x + (q2 * q3 + q0 * q1) * y),
    )


@inlined
def to_body(q0, q1, q2, q3, x, y, z):
    """Components of a north-east-down vector in body axes."""
    return to_earth(q0, -q1, -q2, -q3, x, y, z)


@inlined
def euler_angles(q0, q1, q2, q3):
    """Roll, pitch and yaw (3-2-1 sequence), rad."""
    s = min(max(2.0 * (q0 * q2 - q1 * q3), -1.0), 1.0)
    return (
        math.atan2(2.0 * (q2 * q3 + q0 * q1), q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3),
        math.asin(s),
        math.atan2(2.0 * (q1 * q2 + q0 * q3), q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3),
    )


@inlined
def quaternion(phi, theta, psi):
    """Quaternion of roll, pitch and yaw (3-2-1 sequence)."""
    cf, sf = math.cos(0.5 * phi), math.sin(0.5 * phi)
    ct, st = math.cos(0.5 * theta), math.sin(0.5 * theta)
    cs, ss = math.cos(0.5 * psi), math.sin(0.5 * psi)
    return (
        cf * ct * cs + sf * st * ss,
        sf * ct * cs - cf * st * ss,
        cf * st * cs + sf * ct * ss,
        cf * ct * ss - sf * st * cs,
    )


@inlined
def heading_frame(vn, ve, psi):
    """Ground speed forward and to the right of the heading."""
    c, s = math.cos(psi), math.sin(psi)
    return c * vn + s * ve, -s * vn + c * ve
