"""Runs of a direct decomposition on disk, a file for each scrambling: an interrupted one goes on, a longer one reuses them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr

from levelone.campaign.store import ENGINE, write_dataset
from levelone.errors import InputError
from levelone.uncertainty import Responses


@dataclass(frozen=True)
class ScramblingStore:
    """A folder of responses, found again by what they are responses to.

    Parameters
    ----------
    folder
        Where the files lie.
    key
        Hash of everything that decides the values, see :func:`key_of`.
    """

    folder: Path
    key: str

    def path(self, index: int) -> Path:
        """File of a scrambling."""
        return self.folder / f"scrambling-{index:03d}.nc"

    def read(self, index: int) -> Responses | None:
        """Responses of a scrambling; None where the folder holds none, or those of another study."""
        path = self.path(index)
        if not path.is_file():
            return None
        try:
            with xr.open_dataset(path, engine=ENGINE) as data:
                if data.attrs.get("key") != self.key:
                    return None
                names, units = (tuple(map(str, data[what].values)) for what in ("response", "response_unit"))
                return Responses(data["values"].values, data["status"].values, names, units)
        except (OSError, KeyError, ValueError) as error:
            raise InputError(str(path), f"cannot be read: {error}; remove it, and its runs are done again") from None

    def write(self, index: int, responses: Responses) -> None:
        """Keep the responses of a scrambling, in one move: no half-written file is ever seen."""
        data = xr.Dataset(
            {"values": (("run", "response"), responses.values), "status": (("run", "response"), responses.status.astype("int16"))},
            coords={"response": list(responses.names), "response_unit": ("response", list(responses.units))},
            attrs={"key": self.key},
        )
        write_dataset(self.path(index), data)


def key_of(content: Mapping[str, Any]) -> str:
    """SHA-256 of a description in JSON."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode("utf-8")).hexdigest()
