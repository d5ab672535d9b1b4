"""Linear airframe aerodynamics, scheduled in airspeed, finite down to rest.

Incidence and sideslip are taken as the angles whose sines are w / V and v / V: for flight in the plane of symmetry these are the
usual alpha = atan(w/u) and beta, and in sideways or hovering flight, where atan(w/u) jumps, they stay continuous. Forces are
written with V and the velocity components (lift along (w, 0, -u) / V, drag against the velocity), so that every value and slope
stays finite as V goes to zero. No stall: the caller watches the incidence (`incidence`).
"""

from __future__ import annotations

from levelone.compiled import inlined
from levelone.dynamics.arcsine import arcsine
from levelone.vehicle.vehicle import COEFFICIENTS

(
    C_L0, C_LALPHA, C_LQ, C_LALPHADOT, C_D0, C_DALPHA, C_DQ, C_M0, C_MALPHA, C_MQ, C_MALPHADOT,
    C_YBETA, C_YP, C_YR, C_LLBETA, C_LLP, C_LLR, C_NBETA, C_NP, C_NR,
    C_LDELTA_E, C_MDELTA_E, C_LLDELTA_A, C_NDELTA_A, C_YDELTA_R, C_LLDELTA_R, C_NDELTA_R,
) = range(len(COEFFICIENTS))  # fmt: skip


@inlined
def segment_of(knots, airspeed):
    """Segment of the schedule and the distance from its left knot; the ends are held."""
    n = len(knots)
    v = min(max(airspeed, knots[0]), knots[n - 1])
    s = 0
    while s < n - 2 and v >= knots[s + 1]:
        s += 1
    return s, v - knots[s]


@inlined
def set_coefficients(knots, cubics, airspeed, coefficients):
    """Coefficients at an airspeed; constant beyond the first and last knot."""
    s, d = segment_of(knots, airspeed)
    for j in range(len(coefficients)):
        coefficients[j] = cubics[s, 0, j] + d * (cubics[s, 1, j] + d * (cubics[s, 2, j] + d * cubics[s, 3, j]))


@inlined
def reciprocal(airspeed):
    """1 / airspeed, finite at rest."""
    return 1.0 / max(airspeed, 1e-9)


@inlined
def sine_angle(component, per_airspeed):
    """Angle whose sine is component / airspeed; zero at rest."""
    return arcsine(min(max(component * per_airspeed, -1.0), 1.0))


@inlined
def drag_coefficient(knots, cubics, airspeed, alpha, q_hat):
    """C_D; q_hat = q c / (2 V)."""
    s, d = segment_of(knots, airspeed)
    total = 0.0
    for j, factor in ((C_D0, 1.0), (C_DALPHA, alpha), (C_DQ, q_hat)):
        total += factor * (cubics[s, 0, j] + d * (cubics[s, 1, j] + d * (cubics[s, 2, j] + d * cubics[s, 3, j])))
    return total


@inlined
def aerodynamic_wrench(a, k, u, v, w, speed, per_speed, p, q, r, surfaces):
    """Body forces (N) and moments (N m) without the terms in alphadot.

    ``a`` is the airframe's record, ``k`` the coefficients, (u, v, w) the air-relative velocity in body axes (m/s),
    ``speed`` and ``per_speed`` its size and the reciprocal, ``surfaces``
    elevator, aileron and rudder (rad).
    """
    half_rho_S = 0.5 * a.air_density * a.area
    pressure_S = half_rho_S * speed * speed
    alpha = sine_angle(w, per_speed)
    beta = sine_angle(v, per_speed)
    # C V with the rates' 1 / (2 V) multiplied out: nothing is divided by the airspeed
    qc, pb, rb = 0.5 * q * a.chord, 0.5 * p * a.span, 0.5 * r * a.span
    de, da, dr = surfaces
    lift = half_rho_S * (speed * (k[C_L0] + k[C_LALPHA] * alpha + k[C_LDELTA_E] * de) + k[C_LQ] * qc)
    drag = half_rho_S * (speed * (k[C_D0] + k[C_DALPHA] * alpha) + k[C_DQ] * qc)
    side = pressure_S * (k[C_YBETA] * beta + k[C_YDELTA_R] * dr) + half_rho_S * speed * (k[C_YP] * pb + k[C_YR] * rb)
    roll = pressure_S * (k[C_LLBETA] * beta + k[C_LLDELTA_A] * da + k[C_LLDELTA_R] * dr) + half_rho_S * speed * (
        k[C_LLP] * pb + k[C_LLR] * rb
    )
    pitch = pressure_S * (k[C_M0] + k[C_MALPHA] * alpha + k[C_MDELTA_E] * de) + half_rho_S * speed * k[C_MQ] * qc
    yaw = pressure_S * (k[C_NBETA] * beta + k[C_NDELTA_A] * da + k[C_NDELTA_R] * dr) + half_rho_S * speed * (
        k[C_NP] * pb + k[C_NR] * rb
    )
    return (
        lift * w - drag * u,
        side - drag * v,
        -lift * u - drag * w,
        roll * a.span,
        pitch * a.chord,
        yaw * a.span,
    )


@inlined
def alphadot_terms(a, k, u, w):
    """X, Z (N s) and M (N m s) for each rad/s of alphadot, before the division by the airspeed that they do not need."""
    scale = 0.25 * a.air_density * a.area * a.chord
    return scale * k[C_LALPHADOT] * w, -scale * k[C_LALPHADOT] * u


@inlined
def alphadot_moment(a, k, airspeed):
    """Pitching moment (N m s) for each rad/s of alphadot."""
    return 0.25 * a.air_density * a.area * a.chord * a.chord * airspeed * k[C_MALPHADOT]
