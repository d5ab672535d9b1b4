"""LAPACK and BLAS on symmetric positive definite matrices, letting other Python threads run meanwhile.

The wrappers of ``scipy.linalg.lapack`` hold the interpreter lock (measured: two threads of ``dpotri`` take twice the
time of one), so that fits side by side would queue. The same compiled routines are published by
``scipy.linalg.cython_lapack``; ctypes calls them with the lock released. Matrices are Fortran-ordered float64 and hold
their lower triangle; what lies above the diagonal is neither read nor set.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import LowLevelCallable
from scipy.linalg import cython_blas, cython_lapack

from levelone.uncertainty.distributions import FloatArray

_INTEGER = ctypes.c_int


def _routine(module: Any, name: str, arguments: int) -> Callable[..., None]:
    """The compiled Fortran routine ``name``; every argument is a pointer."""
    signature = LowLevelCallable.from_cython(module, name).signature
    if "int *" not in signature or signature.count("*") != arguments:
        raise ImportError(f"scipy publishes {name} as {signature!r}, and levelone knows another argument list")
    pointer = ctypes.pythonapi.PyCapsule_GetPointer
    pointer.restype, pointer.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    address = pointer(module.__pyx_capi__[name], signature.encode())
    return ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * arguments)(address)


_POTRF = _routine(cython_lapack, "dpotrf", 5)
_POTRI = _routine(cython_lapack, "dpotri", 5)
_POTRS = _routine(cython_lapack, "dpotrs", 8)
_SYMM = _routine(cython_blas, "dsymm", 12)
_LOWER, _LEFT = ctypes.byref(ctypes.c_char(b"L")), ctypes.byref(ctypes.c_char(b"L"))


def _integer(value: int) -> Any:
    return ctypes.byref(_INTEGER(value))


def _checked(matrix: FloatArray, rows: int) -> int:
    """Address of a Fortran-ordered float64 matrix with ``rows`` rows: the routines would write over anything else."""
    if matrix.dtype != np.float64 or matrix.ndim != 2 or len(matrix) != rows or not matrix.flags.f_contiguous:
        raise ValueError("a Fortran-ordered float64 matrix is needed")
    return matrix.ctypes.data


def factorise(a: FloatArray) -> bool:
    """Replace a [n, n] by its lower Cholesky factor; False where it is not positive definite."""
    n, info = len(a), _INTEGER(0)
    _POTRF(_LOWER, _integer(n), _checked(a, n), _integer(n), ctypes.byref(info))
    return info.value == 0


def invert(factor: FloatArray) -> None:
    """Replace a lower Cholesky factor [n, n] by the lower triangle of the inverse of the matrix it came from."""
    n, info = len(factor), _INTEGER(0)
    _POTRI(_LOWER, _integer(n), _checked(factor, n), _integer(n), ctypes.byref(info))


def solve(factor: FloatArray, b: FloatArray) -> FloatArray:
    """Solution x [n, m] of A x = b, from the lower Cholesky factor of A; a new Fortran-ordered array."""
    n, info = len(factor), _INTEGER(0)
    x = np.array(b, dtype=np.float64, order="F")
    _POTRS(
        *(_LOWER, _integer(n), _integer(x.shape[1]), _checked(factor, n), _integer(n)),
        *(_checked(x, n), _integer(n), ctypes.byref(info)),
    )
    return x


def symmetric_product(a: FloatArray, b: FloatArray) -> FloatArray:
    """a b, with a [n, n] symmetric and given by its lower triangle, b [n, m]; a new Fortran-ordered array."""
    n, b = len(a), np.array(b, dtype=np.float64, order="F")
    c = np.empty(b.shape, order="F")
    one, zero = ctypes.byref(ctypes.c_double(1.0)), ctypes.byref(ctypes.c_double(0.0))
    _SYMM(
        *(_LEFT, _LOWER, _integer(n), _integer(b.shape[1]), one, _checked(a, n), _integer(n)),
        *(_checked(b, n), _integer(n), zero, _checked(c, n), _integer(n)),
    )
    return c
