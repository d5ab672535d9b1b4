"""One run of a user's command: a directory of its own, no shell, a time limit, and an end for all that it started."""

from __future__ import annotations

import os
import shutil
import signal
import stat
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

from levelone.campaign.models.keys import files_digest
from levelone.campaign.models.protocol import TAIL, ModelFailure
from levelone.campaign.tether import Tether
from levelone.config.model_table import CommandTable
from levelone.errors import InputError
from levelone.status import Status

T = TypeVar("T")
PARAMETERS, RESULTS, OUTPUT = "parameters.in", "results.out", "output.txt"
#: directories of one evaluation that are kept beside each other before no more are
MOST_KEPT = 10


def executable_of(table: CommandTable) -> Path:
    """File that the first argument names: relative to the study file where it has a slash, else searched for on PATH.

    Raises
    ------
    InputError
        There is none, or it cannot be executed.
    """
    name = table.arguments[0]
    if os.sep not in name:
        found = shutil.which(name)
        if found is None:
            raise InputError("model.arguments.1", f"no program {name!r} on PATH; write './{name}' for one beside the study file")
        return Path(found).absolute()
    path = Path(os.path.normpath(table.base / name))
    if not path.is_file():
        raise InputError("model.arguments.1", f"no such file: {path}")
    if not os.access(path, os.X_OK):
        raise InputError("model.arguments.1", f"{path} is not executable (chmod +x)")
    return path


def template_files(folder: Path) -> list[Path]:
    """Files of the template of each directory.

    Raises
    ------
    InputError
        A link that leads out of the folder, or names it by an absolute path, and what is neither file, folder nor link: a run must
        not reach back into what others start from.
    """
    files = []
    for path in folder.rglob("*"):
        kind = path.lstat().st_mode
        if stat.S_ISLNK(kind):
            target = Path(os.path.normpath(path.parent / os.readlink(path)))
            if Path(os.readlink(path)).is_absolute() or not target.is_relative_to(folder):
                raise InputError(
                    "model.folder", f"{path} is a link to {target}: copy what it points to, or make it relative and inside"
                )
        elif stat.S_ISREG(kind):
            files.append(path)
        elif not stat.S_ISDIR(kind):
            raise InputError("model.folder", f"{path} is no file, folder or link")
    return files


def template_key(folder: Path) -> dict[str, Any]:
    """What identifies a template: the content of its files, which of them can be executed, and where its links lead.

    Raises
    ------
    InputError
        As of :func:`template_files`.
    """
    files = template_files(folder)
    return {
        "files": files_digest(folder, files, "model.folder"),
        "executable": sorted(path.relative_to(folder).as_posix() for path in files if path.stat().st_mode & stat.S_IXUSR),
        "links": {
            path.relative_to(folder).as_posix(): os.readlink(path) for path in sorted(folder.rglob("*")) if path.is_symlink()
        },
    }


def run_command(
    table: CommandTable, executable: Path, files: Mapping[str, str], read: Callable[[Path], T], key: str, keep_in: Path | None
) -> T:
    """Run the command once and read what it leaves.

    Parameters
    ----------
    table, executable
        The command, and the file of its first argument.
    files
        Texts that the directory holds before the run, by name.
    read
        Reads the results from the directory; raises ModelFailure.
    key
        Identifies the evaluation by content; the name of a directory that is kept.
    keep_in
        Folder of the directories that are kept; None where none are.

    Raises
    ------
    ModelFailure
        TIMED_OUT; CRASHED (the signal is named); MODEL_FAILED (the exit status is); what ``read`` raises. The message holds the end
        of the command's output.
    """
    with _directory(table) as work:
        try:
            for name in (*files, RESULTS, OUTPUT):  # of the template: old results, or a link behind which another file lies
                (work / name).unlink(missing_ok=True)
            for name, text in files.items():
                (work / name).write_text(text, encoding="utf-8")
            _run(table, executable, work)
            answer = read(work)
        except ModelFailure as failure:
            kept = _kept(work, keep_in, "failed", key) if table.keep != "none" else None
            raise ModelFailure(failure.status, _with_output(failure, work if kept is None else kept, kept)) from None
        if table.keep == "all":
            _kept(work, keep_in, "evaluations", key)
        return answer


@contextmanager
def _directory(table: CommandTable) -> Iterator[Path]:
    """A fresh directory for one run, with a copy of the template; removed in the end."""
    root = Path(tempfile.mkdtemp(prefix="levelone-run-"))
    work = root / "run"
    try:
        if table.folder is not None:
            shutil.copytree(table.folder, work, symlinks=True)
        else:
            work.mkdir()
        yield work
    except OSError as error:
        raise ModelFailure(Status.MODEL_FAILED, f"the directory of the run: {error.strerror}: {error.filename}") from None
    finally:
        shutil.rmtree(root, ignore_errors=True)


def _run(table: CommandTable, executable: Path, work: Path) -> None:
    placed = {"{parameters}": str(work / PARAMETERS), "{results}": str(work / RESULTS)}
    arguments = [str(executable), *(_filled(each, placed) for each in table.arguments[1:])]
    limit = table.time_limit if table.time_limit < float("inf") else None
    tether = Tether()
    try:
        with (work / OUTPUT).open("wb") as output:
            process = subprocess.Popen(
                arguments,
                cwd=work,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                pass_fds=(tether.far,),
            )
        tether.tie(process.pid)
        try:
            code = process.wait(limit)
        except subprocess.TimeoutExpired:
            raise ModelFailure(Status.TIMED_OUT, f"the command did not end within {table.time_limit:g} s") from None
        finally:
            _end(process)
    except OSError as error:
        raise ModelFailure(Status.MODEL_FAILED, f"the command cannot be started: {error.strerror}") from None
    finally:
        tether.release()
    _check_exit(code)


def _filled(argument: str, placed: Mapping[str, str]) -> str:
    for name, path in placed.items():
        argument = argument.replace(name, path)
    return argument


def _end(process: subprocess.Popen[bytes]) -> None:
    """End all that the command has started and left in its session's group, however the wait for it ended."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _check_exit(code: int) -> None:
    if code < 0:
        raise ModelFailure(Status.CRASHED, f"the command was ended by {_signal(-code)}")
    if code > 0:
        meaning = f" (how a shell reports {_signal(code - 128)})" if 128 < code < 128 + signal.NSIG else ""
        raise ModelFailure(Status.MODEL_FAILED, f"the command ended with exit status {code}{meaning}")


def _signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _with_output(failure: ModelFailure, work: Path, kept: Path | None) -> str:
    """Words of a failure behind the end of what the command printed."""
    said = ""
    with suppress(OSError), (work / OUTPUT).open("rb") as file:
        file.seek(0, os.SEEK_END)
        file.seek(max(file.tell() - TAIL, 0))
        said = file.read().decode("utf-8", "replace").strip()
    words = failure.message + (f" [kept in {kept}]" if kept is not None else "")
    return f"{said[-max(TAIL - len(words) - 1, 0) :]}\n{words}" if said else words


def _kept(work: Path, keep_in: Path | None, group: str, key: str) -> Path | None:
    """Move a directory to where it is kept, beside those that are there; None where it is not kept."""
    if keep_in is None:
        return None
    with suppress(OSError):
        (keep_in / group).mkdir(parents=True, exist_ok=True)
        for name in (key, *(f"{key}-{i}" for i in range(2, MOST_KEPT + 1))):
            place = keep_in / group / name
            if not os.path.lexists(place):
                shutil.copytree(work, place, symlinks=True)
                return place
    return None
