"""Tables of results for other tools: the same rows as CSV text and as Parquet."""

import math
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal

from modrob_cli.io.csv_writer import csv_text

Kind = Literal["number", "count", "text", "flag", "date"]
"""Types of columns: float64, int64, string, bool, timestamp[us, UTC]; each may hold nothing."""
Value = float | int | str | bool | None


@dataclass(frozen=True)
class Column:
    """Name and type of a column; the type is given, not guessed, so that a table of few rows has the same."""

    name: str
    kind: Kind


@dataclass(frozen=True)
class DataTable:
    """Rows of plain data.

    Attributes
    ----------
    columns : shape (C,)
    rows : each of C values; None is nothing. A date is ISO 8601 text with its zone, such as ``2026-03-01T10:00:00Z``
    """

    columns: tuple[Column, ...]
    rows: tuple[tuple[Value, ...], ...]

    def columnwise(self) -> list[list[Value]]:
        """Values by column, of exactly the types of the columns.

        Raises
        ------
        TypeError
            If a value does not fit its column.
        """
        columns = zip(*self.rows, strict=True) if self.rows else ([] for _ in self.columns)
        return [
            [_fitting(value, column) for value in values] for column, values in zip(self.columns, columns, strict=True)
        ]


def csv_table(table: DataTable) -> str:
    """Text of a table: nothing is an empty cell, flags are true and false, numbers have all their digits."""
    rows = zip(*table.columnwise(), strict=True)
    flags = {True: "true", False: "false"}
    cells = ([flags[value] if isinstance(value, bool) else value for value in row] for row in rows)
    return csv_text([column.name for column in table.columns], cells)


def parquet_table(table: DataTable) -> bytes:
    """Content of a Parquet file; the same table gives the same bytes."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    types = {
        "number": pa.float64(),
        "count": pa.int64(),
        "text": pa.string(),
        "flag": pa.bool_(),
        "date": pa.timestamp("us", tz="UTC"),
    }
    arrays = [
        pa.array([_instant(value) for value in values] if column.kind == "date" else values, types[column.kind])
        for column, values in zip(table.columns, table.columnwise(), strict=True)
    ]
    schema = pa.schema([(column.name, types[column.kind]) for column in table.columns])
    sink = pa.BufferOutputStream()
    pq.write_table(pa.Table.from_arrays(arrays, schema=schema), sink)
    content: bytes = sink.getvalue().to_pybytes()
    return content


def _fitting(value: Any, column: Column) -> Value:
    """The value as its column's type; not-a-number is nothing, as in JSON."""
    if value is None:
        return None
    if column.kind == "flag" and isinstance(value, bool):
        return value
    if column.kind in ("number", "count") and isinstance(value, int | float) and not isinstance(value, bool):
        if column.kind == "number":
            return None if math.isnan(value) else float(value)
        if isinstance(value, int):
            return value
    if column.kind in ("text", "date") and isinstance(value, str):
        # File names may hold bytes that are no UTF-8.
        return value.encode(errors="backslashreplace").decode()
    raise TypeError(f"column {column.name}: found {value!r}, expected a {column.kind}")


def _instant(value: Value) -> datetime | None:
    return None if value is None else datetime.fromisoformat(str(value))
