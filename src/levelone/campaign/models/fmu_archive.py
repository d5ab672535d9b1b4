"""The archive of an FMU, looked at before anything in it is run, and unpacked once in a process.

An FMU is a zip file that somebody else wrote: a description in XML, and libraries that will be executed. What is refused here is
what a file that is no FMU, or one made to harm, would do: leave the folder it is unpacked into, fill the disk, or expand entities
without end. That the libraries do what they should can be known only by trusting who built them.
"""

from __future__ import annotations

import atexit
import re
import shutil
import stat
import tempfile
import zipfile
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Any

from levelone.campaign.models.keys import file_digest
from levelone.errors import InputError

DESCRIPTION = "modelDescription.xml"
MOST_BYTES = 2 * 1024**3
MOST_MEMBERS = 20_000
MOST_XML = 64 * 1024**2
#: bytes that an archive may unpack to whatever its size, and how many times its size beyond that
FREE_BYTES, MOST_RATIO = 64 * 1024**2, 100
_ENCODINGS = ("utf-8", "us-ascii", "iso-8859-1")
FIELD = "model.file"
MODES = {"co-simulation": "CoSimulation", "model-exchange": "ModelExchange"}


def library() -> Any:
    """The package FMPy, or an InputError that says how to install it."""
    try:
        import fmpy
        import fmpy.model_description
        import fmpy.simulation
    except ImportError:
        raise InputError("model.kind", 'an "fmu" model needs the package FMPy: pip install levelone[fmu]') from None
    return fmpy


def described(file: Path, mode: str) -> Any:
    """Description of the variables of an FMU, as FMPy reads it, after the archive has been looked at.

    Parameters
    ----------
    file
        The FMU.
    mode
        "co-simulation" or "model-exchange".

    Raises
    ------
    InputError
        No such file, no zip file, an archive that would unpack outside its folder or beyond all measure, a description that is
        missing, too large, not valid or declares entities, another version than FMI 2.0 and 3.0, a mode or a platform that the FMU
        does not have.
    """
    fmpy = library()
    _checked_text(file)
    try:
        with file.open("rb") as opened:
            description = fmpy.model_description.read_model_description(opened)
    except Exception as error:  # the reader raises whatever it stumbles over in a description that is not valid
        raise InputError(FIELD, f"{file.name}: {DESCRIPTION} is not valid: {str(error)[:500]}") from None
    if description.fmiVersion != "2.0" and not description.fmiVersion.startswith("3."):
        raise InputError(FIELD, f"{file.name} is of FMI {description.fmiVersion}; 2.0 and 3.0 can be run")
    offered = [name for name, key in MODES.items() if getattr(description, key[0].lower() + key[1:]) is not None]
    if mode not in offered:
        raise InputError("model.mode", f"{file.name} has no {mode}; it has: {', '.join(offered) or 'none that can be run here'}")
    platforms = fmpy.supported_platforms(str(file))
    if fmpy.platform not in platforms:
        built = ", ".join(platforms) or "none"
        raise InputError(FIELD, f"{file.name} holds no library for {fmpy.platform}; it is built for: {built}")
    return description


@cache
def unpacked(file: Path, mode: str, digest: str) -> tuple[Path, Any]:
    """Folder of an FMU, private to this process and removed when it ends, and its description.

    ``digest`` is that of the file when the study was read: InputError where it is another file by now.
    """
    if file_digest(file, FIELD) != digest:
        raise InputError(FIELD, f"{file} has changed since the study was read: begin again with the new file")
    description = described(file, mode)
    folder = Path(tempfile.mkdtemp(prefix="levelone-fmu-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    fmpy = library()
    wanted = ("resources/", f"binaries/{fmpy.platform}/", f"binaries/{fmpy.platform_tuple}/")
    with zipfile.ZipFile(file) as archive:
        archive.extractall(folder, [name for name in archive.namelist() if name == DESCRIPTION or name.startswith(wanted)])
    (folder / "resources").mkdir(exist_ok=True)  # FMUs are told of it whether they have one or not
    return folder, description


def _checked_text(file: Path) -> None:
    """InputError unless the archive can be unpacked safely and its description be read safely."""
    try:
        with zipfile.ZipFile(file) as archive:
            _check_members(file, archive)
            xml = archive.read(DESCRIPTION)
    except FileNotFoundError:
        raise InputError(FIELD, f"no file {file}") from None
    except OSError as error:
        raise InputError(FIELD, f"{file} cannot be read: {error.strerror or error}") from None
    except (zipfile.BadZipFile, zipfile.LargeZipFile, NotImplementedError, RuntimeError, ValueError, EOFError) as error:
        raise InputError(FIELD, f"{file.name} is no FMU: it cannot be read as a zip file ({error})") from None
    except Exception as error:  # zlib, lzma and bz2 have errors of their own for what was cut or changed
        raise InputError(FIELD, f"{file.name} is damaged: {type(error).__name__}: {error}") from None
    _check_xml(file, xml)


def _check_members(file: Path, archive: zipfile.ZipFile) -> None:
    members = archive.infolist()
    if len(members) > MOST_MEMBERS:
        raise InputError(FIELD, f"{file.name} holds {len(members)} files, at most {MOST_MEMBERS} are taken")
    total = sum(member.file_size for member in members)
    if total > min(MOST_BYTES, max(FREE_BYTES, MOST_RATIO * file.stat().st_size)):
        raise InputError(
            FIELD,
            f"{file.name} would unpack to {total / 1e6:.0f} MB from {file.stat().st_size / 1e6:.3g} MB;"
            f" at most {MOST_RATIO} times its size and {MOST_BYTES / 1e6:.0f} MB are taken",
        )
    names = set()
    for member in members:
        path = PurePosixPath(member.filename)
        outside = path.is_absolute() or ".." in path.parts or "\\" in member.filename or re.match(r"[A-Za-z]:", member.filename)
        if outside or stat.S_ISLNK(member.external_attr >> 16):
            raise InputError(FIELD, f"{file.name} holds {member.filename!r}, which would lead out of its folder")
        if member.filename in names:
            raise InputError(FIELD, f"{file.name} holds {member.filename!r} twice")
        names.add(member.filename)
    if DESCRIPTION not in names:
        raise InputError(FIELD, f"{file.name} is no FMU: it holds no {DESCRIPTION}")
    if archive.getinfo(DESCRIPTION).file_size > MOST_XML:
        raise InputError(FIELD, f"{file.name}: {DESCRIPTION} is larger than {MOST_XML / 1e6:.0f} MB")


def _check_xml(file: Path, xml: bytes) -> None:
    """Entities are refused in the bytes, ahead of any parser; an encoding that could hide them is refused too."""
    declared = re.match(rb"""\s*<\?xml[^>]*encoding\s*=\s*["']([^"']*)["']""", xml.removeprefix(b"\xef\xbb\xbf"))
    encoding = declared.group(1).decode("ascii", "replace").lower() if declared else "utf-8"
    if encoding not in _ENCODINGS or b"\0" in xml:
        raise InputError(FIELD, f"{file.name}: {DESCRIPTION} is written in {encoding!r}, and the standard asks for UTF-8")
    if b"<!doctype" in xml.lower() or b"<!entity" in xml.lower():
        raise InputError(FIELD, f"{file.name}: {DESCRIPTION} declares a document type or entities, which no FMU needs")
