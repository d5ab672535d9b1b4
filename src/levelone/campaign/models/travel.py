"""What of a model travels to another process."""

from __future__ import annotations

from dataclasses import fields
from typing import Any


class FieldsTravel:
    """A frozen dataclass of which the fields alone are pickled: what it has opened or computed since is not."""

    def __getstate__(self) -> dict[str, Any]:
        return {each.name: getattr(self, each.name) for each in fields(self)}  # type: ignore[arg-type]  # of dataclasses only
