from __future__ import annotations

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import levelone

# What others build on; a name may be added here, never taken away without a word in CHANGELOG.
PROMISED = [
    "FrequencyResponse", "bandwidth", "TimeHistory", "attitude_quickness", "dynamic_stability", "Manoeuvre", "Vehicle",
    "load_vehicle", "load_study", "trim", "simulate", "linearize", "Uniform", "Normal", "TruncatedNormal", "Triangular",
    "LogNormal", "Discrete", "Factor", "FactorSpace", "Responses", "morris_design", "latin_hypercube", "sobol_design", "morris",
    "sobol", "Kriging", "BuiltinModel", "Model", "run_study", "Status", "Level",
]  # fmt: skip
HEAVY = {"numba", "numpy", "scipy", "matplotlib", "pydantic", "pint", "xarray", "pandas"}


@pytest.mark.parametrize("name", PROMISED)
def test_promised_names_are_public_and_documented(name):
    assert name in levelone.__all__
    assert inspect.getdoc(getattr(levelone, name))


def test_every_public_name_resolves_to_one_object():
    for name in levelone.__all__:
        assert getattr(levelone, name) is getattr(levelone, name)
    assert set(levelone.__all__) <= set(dir(levelone))


def test_type_checkers_see_the_same_names():
    """The imports under TYPE_CHECKING name what is found at run time, in the module that holds it."""
    tree = ast.parse(Path(levelone.__file__).read_text(encoding="utf-8"))
    guarded = next(node for node in tree.body if isinstance(node, ast.If))
    seen = {alias.asname: node.module for node in guarded.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert seen == levelone._MODULE_OF


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="has no attribute 'morri'"):
        levelone.morri  # noqa: B018


def test_version_is_a_version():
    assert [part.isdigit() for part in levelone.__version__.split(".")[:2]] == [True, True]


def imported_by(code: str) -> set[str]:
    """The heavy packages that a fresh interpreter has imported after running the code."""
    report = f"import sys; print('IMPORTED', *sorted({HEAVY!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", f"{code}\n{report}"], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split()[1:])


HELP = """
from levelone.cli import main
try:
    import sys
    sys.argv = ["levelone", "--help"]
    main()
except SystemExit:
    pass
"""


@pytest.mark.parametrize("code", ["import levelone", "import levelone.cli", HELP], ids=["package", "command", "help"])
def test_importing_leaves_heavy_packages_alone(code):
    assert imported_by(code) == set()


def test_a_criterion_needs_neither_files_nor_figures():
    assert imported_by("import levelone; levelone.attitude_quickness") <= {"numba", "numpy", "scipy"}
