"""A user's function, found by its import path in a folder that is searched first, and what identifies it."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType
from typing import Any

from levelone.campaign.models.keys import file_digest, files_digest
from levelone.errors import InputError, closest, unknown_name

FIELD = "model.function"
#: folder of a study, or installed package -> hash of its code when it was last imported for a model
_LOADED: dict[Path | str, str] = {}


def function_of(where: str, folder: Path | None) -> Callable[..., Any]:
    """The function that ``package.module:name`` stands for; its module is imported, which runs it.

    Parameters
    ----------
    where
        Import path and name; the name may have dots.
    folder
        Searched first, and only while the module is imported.

    Raises
    ------
    InputError
        No such module or name, with the closest there is; a module that fails on import; something that cannot be called.
    """
    module, name = _split(where)
    loaded = _imported(module, folder)
    found: Any = loaded
    for part in name.split("."):
        if not hasattr(found, part):
            raise unknown_name(f"{FIELD} = {where!r}", part, [each for each in dir(found) if not each.startswith("_")])
        found = getattr(found, part)
    if not callable(found):
        raise InputError(FIELD, f"{where!r} is a {type(found).__name__}, and a function is needed")
    return found


def code_digest(where: str, folder: Path | None) -> str:
    """SHA-256 of the Python files that the function comes from: those of the folder, or else of its module or package.

    What they read or import from elsewhere is not seen. Nothing but the packages that hold the module is imported.

    Raises
    ------
    InputError
        No such module.
    """
    module, _ = _split(where)
    top = module.partition(".")[0]
    own = files_digest(folder, _code(folder), "model.folder") if folder is not None else ""
    if _lies_in(folder, top):
        return own
    spec = importlib.util.find_spec(top)
    if spec is None:
        raise _no_module(module, folder)
    return own + _package_digest(spec)


def _package_digest(spec: ModuleSpec) -> str:
    """SHA-256 of an installed module, or of all Python files of an installed package."""
    places = [Path(each) for each in spec.submodule_search_locations or ()]
    if places:
        return "".join(files_digest(place, _code(place), FIELD) for place in places)
    origin = Path(spec.origin or "")
    return file_digest(origin, FIELD) if origin.is_file() else str(spec.origin)


def _code(folder: Path) -> list[Path]:
    """Python files below a folder; hidden folders (environments, version control) hold none of a model."""
    found = (path for path in folder.rglob("*.py") if path.is_file())
    return [path for path in found if not any(part.startswith(".") for part in path.relative_to(folder).parts)]


def _split(where: str) -> tuple[str, str]:
    module, colon, name = where.partition(":")
    parts = [*module.split("."), *name.split(".")]
    if not colon or not all(part.isidentifier() for part in parts):
        raise InputError(FIELD, f"is {where!r}, must be 'package.module:name'")
    return module, name


@contextmanager
def _searched_first(folder: Path | None) -> Iterator[None]:
    if folder is None:
        yield
        return
    text, written = str(folder), sys.dont_write_bytecode
    sys.path.insert(0, text)
    # bytecode is found again by the second and the size of its source: an edit can keep both
    sys.dont_write_bytecode = True
    importlib.invalidate_caches()
    try:
        yield
    finally:
        sys.dont_write_bytecode = written
        if text in sys.path:
            sys.path.remove(text)


def _imported(module: str, folder: Path | None) -> ModuleType:
    top = module.partition(".")[0]
    with _searched_first(folder):
        _forget_namesake(top)
        _forget_others(top, folder)
        try:
            return importlib.import_module(module)
        except ModuleNotFoundError as error:
            if error.name is not None and (error.name == module or module.startswith(f"{error.name}.")):
                raise _no_module(module, folder) from None
            raise InputError(FIELD, f"module {module!r} needs {error.name!r}, which is not installed") from None
        except Exception as error:  # the user's module runs into whatever it likes
            raise InputError(FIELD, f"module {module!r} fails on import: {type(error).__name__}: {error}") from None


def _forget_namesake(top: str) -> None:
    """Two studies may both have a ``model.py``: a module of this name that an import would not find here and now is forgotten."""
    file = getattr(sys.modules.get(top), "__file__", None)
    if file is None:
        return
    spec = PathFinder.find_spec(top)
    if spec is not None and spec.origin is not None and Path(spec.origin) == Path(file):
        return
    _forget(name for name in sys.modules if _is_part(name, top))


def _forget_others(top: str, folder: Path | None) -> None:
    """Forget what would answer in place of the code as it is now: what other studies' folders gave, and what has changed since.

    Otherwise the ``params.py`` of one study would serve another, and code from before an edit would answer under the hash of the
    code after it.
    """
    now: dict[Path | str, str] = {}
    if folder is not None:
        now[folder] = files_digest(folder, _code(folder), "model.folder")
    spec = PathFinder.find_spec(top)
    if spec is not None and top != __name__.partition(".")[0] and not _lies_in(folder, top):
        now[top] = _package_digest(spec)
    if folder is not None and folder not in _LOADED:
        _forget_folder(folder)  # imported by somebody else, nobody knows from which state of its files
    for place, digest in list(_LOADED.items()):
        if isinstance(place, Path) and now.get(place) != digest:
            _forget_folder(place)
            del _LOADED[place]
        elif isinstance(place, str) and now.get(place, digest) != digest:
            _forget(name for name in sys.modules if _is_part(name, place))
    _LOADED.update(now)


def _forget_folder(folder: Path) -> None:
    """Forget the modules that lie where an import with this folder on the path finds them."""
    start = folder.absolute()

    def given(name: str, module: ModuleType) -> bool:
        file, place = getattr(module, "__file__", None), start.joinpath(*name.split("."))
        return file is not None and Path(file) in (place.with_name(f"{place.name}.py"), place / "__init__.py")

    kept = ("__main__", __name__.partition(".")[0])
    _forget(name for name, module in sys.modules.items() if name.partition(".")[0] not in kept and given(name, module))


def _forget(names: Iterable[str]) -> None:
    for name in list(names):
        del sys.modules[name]


def _is_part(name: str, top: str) -> bool:
    return name == top or name.startswith(f"{top}.")


def _lies_in(folder: Path | None, top: str) -> bool:
    return folder is not None and any(path.exists() for path in (folder / top, folder / f"{top}.py"))


def _no_module(module: str, folder: Path | None) -> InputError:
    if folder is None:
        return InputError(FIELD, f"no module {module!r}: name its folder with model.folder, or install it")
    names = [".".join(path.relative_to(folder).with_suffix("").parts) for path in _code(folder)]
    there = closest(module, names) if names else "it holds no Python file"
    return InputError(FIELD, f"no module {module!r} in {folder}; {there}")
