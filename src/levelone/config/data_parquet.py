"""Reader of Parquet files, through pyarrow."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from levelone.config.data_files import Column, Content, names_and_units, unique
from levelone.errors import InputError

_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


def read_parquet(path: Path, content: bytes) -> Content:
    """Columns of numbers of a Parquet file.

    Parameters
    ----------
    path, content
        The file. A unit comes from a field's metadata (``unit`` or ``units``), or from its name as in a text table. Missing
        values are NaN; date-times and durations become seconds, date-times from the first one on.

    Raises
    ------
    InputError
        pyarrow is not installed, or the file is damaged.
    """
    try:
        import pyarrow as arrow
        import pyarrow.parquet as parquet
    except ImportError:
        raise InputError(str(path), "Parquet files need the library pyarrow: pip install levelone[records]") from None
    try:
        table = parquet.read_table(io.BytesIO(content))
        columns = zip(table.schema, names_and_units(table.schema.names), strict=True)
        parts = [(name, _stated(field) or unit) for field, (name, unit) in columns]
        names = unique(path, [name for name, _ in parts])
        series = [_values(arrow, column) for column in table.columns]
    except InputError:
        raise
    except Exception as error:  # damaged files end in errors of many libraries
        raise InputError(str(path), f"is no readable Parquet file: {_first_line(error)}") from None
    known = zip(names, parts, series, strict=True)
    return {name: Column(values, unit or given) for name, (_, given), (values, unit) in known if values is not None}, {}, ()


def _stated(field: Any) -> str:
    metadata = field.metadata or {}
    return str(metadata.get(b"unit", metadata.get(b"units", b"")).decode("utf-8", "replace"))


def _values(arrow: Any, column: Any) -> tuple[Any, str]:
    """Numbers of a column and its unit where its type states one; None for a column of other things."""
    kind = arrow.types
    if kind.is_timestamp(column.type) or kind.is_duration(column.type):
        counts = column.cast(arrow.int64())
        whole = counts.combine_chunks().to_numpy(zero_copy_only=False)
        first = whole[0] if kind.is_timestamp(column.type) and len(whole) else 0
        return np.asarray(whole - first, dtype=np.float64) * _SECONDS[column.type.unit], "s"
    if any(is_kind(column.type) for is_kind in (kind.is_integer, kind.is_floating, kind.is_decimal, kind.is_boolean)):
        # counts beyond 2^53 lose their last digits: 256 ns of a clock in ns since 1970
        return np.array(column.cast(arrow.float64(), safe=False).to_numpy(), dtype=np.float64), ""
    return None, ""


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0][:200] or type(error).__name__
