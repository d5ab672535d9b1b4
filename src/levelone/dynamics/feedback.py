"""Linear systems with delays: actuators put before a plant, a feedback law with integral action closed around it.

The plant is x' = A x + B a, y = C x + D a, with actuators a between its inputs u and a. The law is

    v = F_x x + F_i e + F_r r,    e' = R x + R_v v - S r,    u = u_0 + M v,

with commands r, integrals e and controls v. M shares v among the inputs; where v are accelerations that the inputs are to give,
M = W^-1 E^T (E W^-1 E^T)^-1 makes E u = v at the least u^T W u (Durham, Bordignon and Beck, *Aircraft Control Allocation*,
Wiley, 2017, chapter 6: the weighted pseudo-inverse). R_v v are commands inside the law, such as the attitude that an outer loop
asks of an inner one. The law acts ``delay`` seconds late, and each input later by its own.

Delays inside the loop are not approximated: what passes through them is cut out as z, so that

    x' = A x + B u + B_z z(t - tau),   z = C_z x + D_z u,   y = C x + D u + D_y z(t - tau)

(the linear fractional form of a delay system, e.g. Gumussoy and Gahinet, IFAC Workshop on Time Delay Systems, 2012).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from levelone.errors import InputError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

#: intervals of the collocation by which the poles of a loop with delays are found
COLLOCATION = 16


@dataclass(frozen=True, eq=False)
class Plant:
    """A linear system with delays outside of it and actuators before it; any units.

    Parameters
    ----------
    A, B, C, D
        [n, n], [n, m], [p, n], [p, m].
    input_delay, output_delay
        [m] and [p], s.
    omega, zeta
        [m] of the second-order actuator before each input, rad/s and 1; NaN: none.
    """

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    input_delay: FloatArray
    output_delay: FloatArray
    omega: FloatArray
    zeta: FloatArray


@dataclass(frozen=True, eq=False)
class FeedbackLaw:
    """The law of the module's text; signs are inside the matrices.

    Parameters
    ----------
    F_x, F_i, F_r
        [v, n], [v, i], [v, r]: controls from states, integrals and commands.
    R, R_v, S
        [i, n], [i, v], [i, r]: rates of the integrals from states, controls and (subtracted) commands.
    M
        [m, v]: inputs from controls.
    delay
        s, from the states and commands to the inputs.
    """

    F_x: FloatArray
    F_i: FloatArray
    F_r: FloatArray
    R: FloatArray
    R_v: FloatArray
    S: FloatArray
    M: FloatArray
    delay: float = 0.0


def allocation(weights: FloatArray, effect: FloatArray) -> FloatArray:
    """[m, v] inputs that give the accelerations v at the least weighted sum of their squares.

    Parameters
    ----------
    weights
        [m], positive: a large one spares its input.
    effect
        [v, m] accelerations from inputs.

    Raises
    ------
    InputError
        Weights that are not positive, or accelerations that the inputs cannot give independently.
    """
    if not (np.isfinite(weights).all() and (weights > 0.0).all()):
        raise InputError("allocation.weights", f"must be positive, the least is {weights.min():g}")
    shared = effect.T / weights[:, None]
    if np.linalg.matrix_rank(effect / np.sqrt(weights)) < len(effect):
        raise InputError("allocation.effect", f"its {len(effect)} rows depend on each other: the controls cannot all be given")
    return np.asarray(np.linalg.solve((effect @ shared).T, shared.T).T, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class DelayedSystem:
    """A linear system whose delays are cut out, see the module's text.

    Parameters
    ----------
    A, B, C, D
        [n, n], [n, m], [p, n], [p, m].
    B_z, C_z, D_z, D_y
        [n, d], [d, n], [d, m], [p, d]: through the d delays inside.
    input_delay, loop_delay, output_delay
        [m], [d] and [p], s; those inside are positive.
    """

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    B_z: FloatArray
    C_z: FloatArray
    D_z: FloatArray
    D_y: FloatArray
    input_delay: FloatArray
    loop_delay: FloatArray
    output_delay: FloatArray

    def frequency_response(self, column: int, row: int, omega: FloatArray) -> ComplexArray:
        """[nf] response of one output to one input at ``omega`` rad/s, exact; an unstable system has one too.

        Raises
        ------
        numpy.linalg.LinAlgError
            A pole lies on the imaginary axis at one of the frequencies.
        """
        s = 1j * np.asarray(omega, dtype=np.float64)
        late = np.exp(-s[:, None] * self.loop_delay)
        closed = s[:, None, None] * np.eye(len(self.A)) - self.A - (self.B_z * late[:, None, :]) @ self.C_z
        driven = self.B[:, column] + late @ (self.B_z * self.D_z[:, column]).T
        state = np.linalg.solve(closed, driven[..., None])[..., 0]
        inside = late * (state @ self.C_z.T + self.D_z[:, column])
        value = state @ self.C[row] + self.D[row, column] + inside @ self.D_y[row]
        outside = np.exp(-s * (self.input_delay[column] + self.output_delay[row]))
        return np.asarray(value * outside, dtype=np.complex128)

    def poles(self) -> ComplexArray:
        """Poles, 1/s, from the rightmost on; with delays inside, those that lie rightmost of infinitely many.

        A delay equation moves its recent past along: its generator is collocated at Chebyshev points of the longest delay (Breda,
        Maset and Vermiglio, *Stability of Linear Delay Differential Equations*, Springer, 2015, chapter 5). Poles whose modulus
        is small beside ``COLLOCATION`` over the longest delay are accurate to many digits.
        """
        matrix = self.A if not len(self.loop_delay) else self._collocated()
        poles = np.linalg.eigvals(matrix).astype(np.complex128)
        return poles[np.argsort(-poles.real)]

    def _collocated(self) -> FloatArray:
        longest, n = float(self.loop_delay.max()), len(self.A)
        k = np.arange(COLLOCATION + 1)
        nodes = np.cos(np.pi * k / COLLOCATION)
        ends = np.where((k == 0) | (k == COLLOCATION), 2.0, 1.0) * (-1.0) ** k
        gaps = nodes[:, None] - nodes + np.eye(len(k))
        slopes = np.outer(ends, 1.0 / ends) / gaps
        slopes -= np.diag(slopes.sum(axis=1))
        matrix = np.kron(slopes * 2.0 / longest, np.eye(n))
        matrix[:n] = 0.0
        matrix[:n, :n] = self.A
        for d, delay in enumerate(self.loop_delay):
            seen = _barycentric(nodes, 1.0 - 2.0 * delay / longest, 1.0 / ends)
            matrix[:n] += np.kron(seen, np.outer(self.B_z[:, d], self.C_z[d]))
        return np.asarray(matrix, dtype=np.float64)

    def transport(self, column: int, row: int) -> float:
        """Pure delay from one input to one output, s: the shortest way through; infinite where there is none."""
        n, d = len(self.A), len(self.loop_delay)
        # time to reach an input, the states, the entry of the delays inside and the output, [to, from]
        ways = np.full((n + d + 2, n + d + 2), np.inf)
        state, entry = slice(1, n + 1), slice(n + 1, n + d + 1)
        ways[state, 0] = _free(self.B[:, column])
        ways[state, state] = _free(self.A)
        ways[state, entry] = _free(self.B_z) + self.loop_delay
        ways[entry, 0] = _free(self.D_z[:, column])
        ways[entry, state] = _free(self.C_z)
        ways[-1, 0] = _free(self.D[row, column])
        ways[-1, state] = _free(self.C[row])
        ways[-1, entry] = _free(self.D_y[row]) + self.loop_delay
        reached = np.full(n + d + 2, np.inf)
        reached[0] = 0.0
        for _ in range(n + d + 1):
            reached = np.minimum(reached, (ways + reached).min(axis=1))
        return float(reached[-1] + self.input_delay[column] + self.output_delay[row])


def _free(coupling: FloatArray) -> FloatArray:
    """0 where one quantity moves another at once, infinite where it does not."""
    return np.asarray(np.where(coupling != 0.0, 0.0, np.inf), dtype=np.float64)


def _barycentric(nodes: FloatArray, at: float, weights: FloatArray) -> FloatArray:
    """Weights of the values at Chebyshev points for the value between them."""
    away = at - nodes
    if np.abs(away).min() < 1e-14:
        return np.asarray(np.abs(away) < 1e-14, dtype=np.float64)
    part = weights / away
    return np.asarray(part / part.sum(), dtype=np.float64)


def closed(plant: Plant, law: FeedbackLaw | None = None) -> DelayedSystem:
    """The plant with its actuators, and with the law around it where there is one.

    Returns
    -------
    DelayedSystem
        States: those of the plant, position and rate of each actuator, integrals. Inputs: those of the plant, to which the law
        adds, then the commands. Outputs: those of the plant.
    """
    A, C, entry, direct = _actuated(plant)
    if law is None:
        return _open(A, C, entry, direct, plant)
    n, size, more = len(plant.A), len(A), len(law.R)
    states = np.hstack([law.F_x, np.zeros((len(law.F_x), size - n)), law.F_i])
    A, C = np.pad(A, (0, more)), np.pad(C, ((0, 0), (0, more)))
    entry = np.pad(entry, ((0, more), (0, 0)))
    A[size:, :n] += law.R
    A[size:] += law.R_v @ states
    commands = np.zeros((len(A), law.S.shape[1]))
    commands[size:] = law.R_v @ law.F_r - law.S
    late = plant.input_delay + law.delay
    now, delayed = np.flatnonzero(late <= 0.0), np.flatnonzero((late > 0.0) & (law.M != 0.0).any(axis=1))
    shared = law.M[now]
    A += entry[:, now] @ shared @ states
    C = C + direct[:, now] @ shared @ states
    commands += entry[:, now] @ shared @ law.F_r
    D = np.hstack([direct, direct[:, now] @ shared @ law.F_r])
    none = np.zeros((len(delayed), entry.shape[1]))
    return DelayedSystem(
        A=A,
        B=np.hstack([entry, commands]),
        C=C,
        D=D,
        B_z=entry[:, delayed],
        C_z=law.M[delayed] @ states,
        D_z=np.hstack([none, law.M[delayed] @ law.F_r]),
        D_y=direct[:, delayed],
        input_delay=np.concatenate([plant.input_delay, np.zeros(commands.shape[1])]),
        loop_delay=late[delayed],
        output_delay=plant.output_delay,
    )


def _actuated(plant: Plant) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """A and C with the states of the actuators, and how what is sent to each input enters states and outputs."""
    n = len(plant.A)
    acted = np.flatnonzero(np.isfinite(plant.omega))
    size = n + 2 * len(acted)
    A, C = np.zeros((size, size)), np.zeros((len(plant.C), size))
    A[:n, :n], C[:, :n] = plant.A, plant.C
    entry = np.vstack([plant.B, np.zeros((2 * len(acted), plant.B.shape[1]))])
    direct = plant.D.copy()
    for at, i in enumerate(acted):
        position, rate, omega = n + 2 * at, n + 2 * at + 1, plant.omega[i]
        A[:n, position], C[:, position] = plant.B[:, i], plant.D[:, i]
        A[position, rate] = 1.0
        A[rate, position], A[rate, rate] = -(omega**2), -2.0 * plant.zeta[i] * omega
        entry[:, i], direct[:, i] = 0.0, 0.0
        entry[rate, i] = omega**2
    return A, C, entry, direct


def _open(A: FloatArray, C: FloatArray, entry: FloatArray, direct: FloatArray, plant: Plant) -> DelayedSystem:
    """The plant alone: all delays lie outside."""
    n, (p, m) = len(A), direct.shape
    none = np.zeros((0, n)), np.zeros((0, m)), np.zeros(0)
    return DelayedSystem(
        A, entry, C, direct, none[0].T, none[0], none[1], np.zeros((p, 0)), plant.input_delay, none[2], plant.output_delay
    )
