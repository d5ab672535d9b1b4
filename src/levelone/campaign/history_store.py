"""Time histories of a campaign, where they are kept: HDF5 files in the folder ``histories`` beside the store.

HDF5 has no transactions: a process that is killed while it writes can leave a file that nobody can open, with all that it held
before. Each commit of the store therefore writes a file of its own, whole and synced before it gets its name, and no file is ever
written again; some hundred of them are copied into one as they gather.

A file holds a group for each evaluation (the hexadecimal content key of the store), and in it one for each test: ``time`` [time],
``channels`` [channel, run, time], ``trim`` [channel, run], ``delay`` and ``status`` [run], ``extremes`` [name, run], and an
attribute ``header`` in JSON with the names and units. Numbers come back to the last bit.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from levelone.campaign.store_schema import StoreError
from levelone.errors import InputError
from levelone.handling.history import FloatArray, TimeHistory

FOLDER_NAME = "histories"
#: loose files that become one; where they cannot, they are tried again when there are as many more
GATHER = 256
_PACK, _LOOSE, _PART = ".pack.h5", ".h5", ".part"
_COMPRESSED: Any = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
_DAMAGED = (OSError, RuntimeError, KeyError, ValueError, TypeError)


@dataclass(frozen=True, eq=False)
class HistoryStore:
    """A folder of time histories, found by the content key of their evaluation (:func:`content_keys`).

    Parameters
    ----------
    folder
        The folder; made by :meth:`for_writing`. Only the process that holds the store may write.
    """

    folder: Path
    _where: dict[str, Path] = field(default_factory=dict)

    @classmethod
    def for_writing(cls, folder: Path) -> HistoryStore:
        """The folder, made where it is missing, without what an interrupted process left unfinished.

        Raises
        ------
        InputError
            The folder cannot be made.
        """
        try:
            folder.mkdir(exist_ok=True)
            for part in folder.glob(f"*{_PART}"):
                part.unlink()
            store = cls(folder)
            packs = [_number(path) for path in store.files() if path.name.endswith(_PACK)]
            store._remove_loose(max(packs, default=-1))
        except OSError as error:
            raise InputError(str(folder), f"cannot be made or written: {error.strerror}") from None
        return store

    def add(self, keys: Sequence[bytes], histories: Sequence[Mapping[str, TimeHistory]]) -> None:
        """Keep the histories of n evaluations, where they have any; when this returns they are on the disk.

        Raises
        ------
        StoreError
            The disk is full or fails; earlier histories are untouched.
        """
        if not any(histories):
            return
        files = self.files()
        number = _number(files[-1]) + 1 if files else 1
        with _Draft(self.folder / f"{number:08d}{_LOOSE}") as file:
            for key, tests in dict(zip(keys, histories, strict=True)).items():
                for test, history in tests.items():
                    _write(file.require_group(key.hex()).create_group(test), history)
        self._where.clear()
        loose = [path for path in self.files() if not path.name.endswith(_PACK)]
        if loose and len(loose) % GATHER == 0:
            # what is to be kept is on the disk: no evaluation is to be lost over tidying up, and who reads a damaged file is told
            with suppress(InputError, StoreError):
                self._gather(loose)

    def read(self, key: bytes) -> dict[str, TimeHistory]:
        """Test to history of one evaluation; empty where none was kept.

        Raises
        ------
        InputError
            A file is damaged.
        """
        if not self._where:
            self._where.update(self._index())
        path = self._where.get(key.hex())
        if path is None:
            return {}
        try:
            with h5py.File(path, "r") as file:
                return {str(test): _read(group) for test, group in file[key.hex()].items()}
        except _DAMAGED as error:
            raise _damaged(path, error) from None

    def files(self) -> list[Path]:
        """Finished files, oldest first; of the same number the gathered one last."""
        return sorted(self.folder.glob(f"*{_LOOSE}"), key=lambda path: (_number(path), path.name.endswith(_PACK)))

    def _index(self) -> dict[str, Path]:
        """Key to the newest file that holds it."""
        where: dict[str, Path] = {}
        for path in self.files():
            try:
                with h5py.File(path, "r") as file:
                    where.update(dict.fromkeys(file, path))
            except _DAMAGED as error:
                raise _damaged(path, error) from None
        return where

    def _gather(self, loose: Sequence[Path]) -> None:
        """Copy loose files into one, then remove them; a later history of the same evaluation takes the place of an earlier one.

        Raises
        ------
        InputError, StoreError
            A file is damaged, or the disk is full; all files are as they were.
        """
        last = _number(loose[-1])
        with _Draft(self.folder / f"{last:08d}{_PACK}") as packed:
            for path in loose:
                try:
                    with h5py.File(path, "r") as file:
                        for key in file:
                            if key in packed:
                                del packed[key]
                            file.copy(file[key], packed, key)
                except _DAMAGED as error:
                    raise _damaged(path, error) from None
        self._remove_loose(last)

    def _remove_loose(self, last: int) -> None:
        for path in self.files():
            if not path.name.endswith(_PACK) and _number(path) <= last:
                path.unlink()


class _Draft:
    """An HDF5 file under another name until it is whole and on the disk.

    Raises
    ------
    StoreError
        It cannot be written; nothing of it is left.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._part = path, path.with_name(path.name + _PART)

    def __enter__(self) -> h5py.File:
        try:
            self._file = h5py.File(self._part, "w")
        except (OSError, RuntimeError) as error:
            raise self._failure(error) from None
        return self._file

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        try:
            self._file.close()
            if kind is None:
                _sync(self._part)
                os.replace(self._part, self._path)
                _sync(self._path.parent)
        except (OSError, RuntimeError) as failure:
            kind, error = type(failure), failure
        if kind is not None:
            self._part.unlink(missing_ok=True)
        if isinstance(error, OSError | RuntimeError):
            raise self._failure(error) from None

    def _failure(self, error: Exception) -> StoreError:
        return StoreError(f"{self._path}: cannot be written: {error}; what was committed before is kept: run again with --resume")


def _sync(path: Path) -> None:
    """Have a file, or the names in a folder, on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _number(path: Path) -> int:
    digits = path.name.split(".", 1)[0]
    if not digits.isdecimal():
        raise InputError(str(path), "does not belong into a folder of time histories: move it away")
    return int(digits)


def _damaged(path: Path, error: Exception) -> InputError:
    text = " ".join(str(error).split())
    return InputError(str(path), f"cannot be read as time histories ({text}); move it away: evaluations do not depend on it")


def _write(group: h5py.Group, history: TimeHistory) -> None:
    names = list(history.channels)
    runs = history.n_runs
    data = {
        "time": history.time,
        "channels": _stack(history.channels, names, (runs, history.time.size)),
        "trim": _stack(history.trim, names, (runs,)),
        "delay": history.delay,
        "status": history.status,
        "extremes": _stack(history.extremes, list(history.extremes), (runs,)),
    }
    for name, values in data.items():
        group.create_dataset(name, data=values, **(_COMPRESSED if values.size > 64 else {}))
    header = {
        "channels": names, "units": [history.units[name] for name in names], "extremes": list(history.extremes),
        "input_name": history.input_name, "input_on": float(history.input_on), "input_off": float(history.input_off),
        "wind": [float(each) for each in history.wind], "name": history.name,
    }  # fmt: skip
    group.attrs["header"] = json.dumps(header)


def _stack(values: Mapping[str, FloatArray], names: Sequence[str], shape: tuple[int, ...]) -> FloatArray:
    return np.stack([values[name] for name in names]) if names else np.zeros((0, *shape))


def _read(group: h5py.Group) -> TimeHistory:
    header = json.loads(group.attrs["header"])
    data = {name: group[name][()] for name in ("time", "channels", "trim", "delay", "status", "extremes")}
    names = header["channels"]
    return TimeHistory(
        data["time"],
        dict(zip(names, data["channels"], strict=True)),
        dict(zip(names, header["units"], strict=True)),
        dict(zip(names, data["trim"], strict=True)),
        header["input_name"],
        header["input_on"],
        header["input_off"],
        data["delay"],
        tuple(header["wind"]),
        data["status"],
        dict(zip(header["extremes"], data["extremes"], strict=True)),
        header["name"],
    )
