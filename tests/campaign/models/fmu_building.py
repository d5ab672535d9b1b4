"""FMUs built for tests: one linear system behind FMI 2.0 and 3.0, each with co-simulation and model exchange, compiled from C.

The system is that of ``linear_fixtures.reference_system``; its parameter ``rate_gain`` scales the feedback of the pitch rate.
"""

from __future__ import annotations

import functools
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linear_fixtures import reference_system

from levelone.config.model_table import Channel, FmuTable

SOURCES = Path(__file__).parent / "fmu_sources"
GUID = "{7c1f0a52-0d0e-4a55-9a53-6d6a0f2f4c11}"
UNITS = {"V_ref": "m/s", "theta": "rad", "q": "rad/s", "V_lon": "m/s"}
PARAMETERS = {"rate_gain": (1, 1.0), "limit": (2, 1e30), "kick_at": (3, 1e30), "kick": (4, 0.0), "mischief_at": (7, 0.0)}
#: what the integer parameter "mischief" asks for
PRINTS, FAILS, NOT_A_NUMBER, ABORTS, ENDS, DISCARDS, HANGS = range(1, 8)


def compiler() -> str:
    """Path of a C compiler; the test is skipped where there is none."""
    found = shutil.which("gcc") or shutil.which("cc")
    if found is None or not sys.platform.startswith("linux"):
        pytest.skip("no C compiler (gcc or cc) to build an FMU with, or not Linux")
    return found


@functools.cache
def built(version: str) -> Path:
    """An FMU of the reference system, FMI "2.0" or "3.0", with both modes; built once in a session."""
    pytest.importorskip("fmpy", reason="FMPy runs the FMUs: pip install levelone[fmu]")
    folder = Path(tempfile.mkdtemp(prefix="levelone-test-fmu-"))
    _CLEANING.append(folder)
    (folder / "system.h").write_text(_header())
    library = folder / "pitch.so"
    source = SOURCES / f"fmi{version[0]}.c"
    options = ["-O1", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", f"-I{folder}"]
    subprocess.run([compiler(), *options, str(source), "-o", str(library), "-lm"], check=True, capture_output=True, timeout=60)
    place = "binaries/linux64" if version == "2.0" else "binaries/x86_64-linux"
    return archive(folder / f"pitch_{version[0]}.fmu", {"modelDescription.xml": description(version), f"{place}/pitch.so": library})


_CLEANING: list[Path] = []


@contextmanager
def cleaned() -> Iterator[None]:
    """Folders of what was built are removed at the end; for a fixture of the session."""
    yield
    while _CLEANING:
        shutil.rmtree(_CLEANING.pop(), ignore_errors=True)
    built.cache_clear()


def archive(file: Path, members: Mapping[str, str | bytes | Path]) -> Path:
    """A zip file with the given members: texts, bytes, or files."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as zipped:
        for name, content in members.items():
            zipped.writestr(name, content.read_bytes() if isinstance(content, Path) else content)
    return file


def table(file: Path, mode: str = "co-simulation", **options: Any) -> FmuTable:
    """Description of a built FMU: command V_lon; channels theta, q and V_lon."""
    fields: dict[str, Any] = {
        "kind": "fmu",
        "fixed": (),
        "inputs": (Channel("V_lon", "V_ref", "m/s", 1.0, 1, None),),
        "outputs": tuple(Channel(name, name, UNITS[name], 1.0, 1) for name in ("theta", "q", "V_lon")),
        "file": file,
        "mode": mode,
        "step": None,
        "settle": 0.0,
        "tolerance": None,
    }
    return FmuTable(**{**fields, **options})


def matrices(rate_gain: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A, B and C of the system."""
    a, b, c, _, _ = reference_system(rate_gain)
    return a, b, c


def _header() -> str:
    a, b, c = matrices(0.0)
    a1 = matrices(1.0)[0] - a
    sizes = f"#define N {a.shape[0]}\n#define M {b.shape[1]}\n#define P {c.shape[0]}\n"
    arrays = "".join(
        f"static const double {name}[{m.shape[0]}][{m.shape[1]}] = {{{_rows(m)}}};\n"
        for name, m in (("A0", a), ("A1", a1), ("B0", b), ("C0", c))
    )
    return f'{sizes}#define GUID "{GUID}"\n{arrays}'


def _rows(matrix: np.ndarray) -> str:
    return ", ".join("{" + ", ".join(repr(float(v)) for v in row) + "}" for row in matrix)


def description(version: str) -> str:
    """modelDescription.xml of the reference system."""
    return _second() if version == "2.0" else _third()


_UNITS_2 = """<UnitDefinitions>
<Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit><Unit name="rad"><BaseUnit rad="1"/></Unit>
<Unit name="rad/s"><BaseUnit rad="1" s="-1"/></Unit></UnitDefinitions>"""


def _second() -> str:
    names = reference_system()[4]
    rows = [f'<ScalarVariable name="{n}" valueReference="{100 + i}" causality="input" variability="continuous">'
            f'<Real start="0" unit="{UNITS[n]}"/></ScalarVariable>' for i, n in enumerate(names.inputs)]  # fmt: skip
    rows += [f'<ScalarVariable name="{n}" valueReference="{200 + i}" causality="output" variability="continuous">'
             f'<Real unit="{UNITS[n]}"/></ScalarVariable>' for i, n in enumerate(names.outputs)]  # fmt: skip
    rows += [f'<ScalarVariable name="state.{n}" valueReference="{300 + i}" causality="local" variability="continuous"'
             f' initial="exact"><Real start="0"/></ScalarVariable>' for i, n in enumerate(names.states)]  # fmt: skip
    first = len(rows) - len(names.states) + 1
    rows += [f'<ScalarVariable name="der(state.{n})" valueReference="{400 + i}" causality="local" variability="continuous">'
             f'<Real derivative="{first + i}"/></ScalarVariable>' for i, n in enumerate(names.states)]  # fmt: skip
    rows += [f'<ScalarVariable name="{n}" valueReference="{vr}" causality="parameter" variability="fixed" initial="exact">'
             f'<Real start="{start}"/></ScalarVariable>' for n, (vr, start) in PARAMETERS.items()]  # fmt: skip
    rows.append('<ScalarVariable name="mischief" valueReference="6" causality="parameter" variability="fixed" initial="exact">'
                '<Integer start="0"/></ScalarVariable>')  # fmt: skip
    rows.append('<ScalarVariable name="crossed_at" valueReference="5" causality="local" variability="discrete">'
                '<Real/></ScalarVariable>')  # fmt: skip
    outputs = "".join(f'<Unknown index="{len(names.inputs) + i + 1}"/>' for i in range(len(names.outputs)))
    rates = "".join(f'<Unknown index="{first + len(names.states) + i}"/>' for i in range(len(names.states)))
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="pitch" guid="{GUID}" numberOfEventIndicators="1">
<ModelExchange modelIdentifier="pitch"/>
<CoSimulation modelIdentifier="pitch" canHandleVariableCommunicationStepSize="true"/>
{_UNITS_2}
<ModelVariables>{"".join(rows)}</ModelVariables>
<ModelStructure><Outputs>{outputs}</Outputs><Derivatives>{rates}</Derivatives></ModelStructure>
</fmiModelDescription>"""


def _third() -> str:
    names = reference_system()[4]
    rows = ['<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>']
    rows += [f'<Float64 name="{n}" valueReference="{100 + i}" causality="input" start="0" unit="{UNITS[n]}"/>'
             for i, n in enumerate(names.inputs)]  # fmt: skip
    rows += [f'<Float64 name="{n}" valueReference="{200 + i}" causality="output" unit="{UNITS[n]}"/>'
             for i, n in enumerate(names.outputs)]  # fmt: skip
    rows += [f'<Float64 name="state.{n}" valueReference="{300 + i}" causality="local" initial="exact" start="0"/>'
             for i, n in enumerate(names.states)]  # fmt: skip
    rows += [f'<Float64 name="der(state.{n})" valueReference="{400 + i}" causality="local" derivative="{300 + i}"/>'
             for i, n in enumerate(names.states)]  # fmt: skip
    rows += [f'<Float64 name="{n}" valueReference="{vr}" causality="parameter" variability="fixed" start="{start}"/>'
             for n, (vr, start) in PARAMETERS.items()]  # fmt: skip
    rows.append('<Int32 name="mischief" valueReference="6" causality="parameter" variability="fixed" start="0"/>')
    rows.append('<Float64 name="crossed_at" valueReference="5" causality="local" variability="discrete"/>')
    outputs = "".join(f'<Output valueReference="{200 + i}"/>' for i in range(len(names.outputs)))
    rates = "".join(f'<ContinuousStateDerivative valueReference="{400 + i}"/>' for i in range(len(names.states)))
    units = _UNITS_2
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="pitch" instantiationToken="{GUID}">
<ModelExchange modelIdentifier="pitch"/>
<CoSimulation modelIdentifier="pitch" canHandleVariableCommunicationStepSize="true"/>
{units}
<ModelVariables>{"".join(rows)}</ModelVariables>
<ModelStructure>{outputs}{rates}<EventIndicator valueReference="5"/></ModelStructure>
</fmiModelDescription>"""
