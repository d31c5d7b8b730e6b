"""One table as CSV and as Parquet: the same rows, the same types, the same bytes each time."""

import csv
import io
from datetime import UTC, datetime

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from modrob_cli.io.table_writer import Column, DataTable, csv_table, parquet_table

COLUMNS = (
    Column("log", "text"),
    Column("date", "date"),
    Column("value", "number"),
    Column("samples", "count"),
    Column("passed", "flag"),
)
ROWS = (
    ("a.mcap", "2026-03-01T10:00:00Z", 0.1 + 0.2, 3, True),
    ('b,"quoted"\nnext \r line', None, None, None, None),
    ("", "2026-03-01T12:30:00+02:00", float("inf"), -(2**62), False),
    ("käse.mcap", None, 5, 0, None),
    (None, None, float("nan"), 1, True),
)
TABLE = DataTable(COLUMNS, ROWS)


def parquet(table: DataTable) -> pa.Table:
    return pq.read_table(pa.BufferReader(parquet_table(table)))


def test_parquet_holds_the_rows_with_their_types() -> None:
    found = parquet(TABLE)
    assert [str(field.type) for field in found.schema] == ["string", "timestamp[us, tz=UTC]", "double", "int64", "bool"]
    date, other = datetime(2026, 3, 1, 10, tzinfo=UTC), datetime(2026, 3, 1, 10, 30, tzinfo=UTC)
    assert found.column("log").to_pylist() == [row[0] for row in ROWS]
    assert found.column("date").to_pylist() == [date, None, other, None, None]
    assert found.column("value").to_pylist() == [0.1 + 0.2, None, float("inf"), 5.0, None]  # not-a-number is nothing
    assert found.column("samples").to_pylist() == [3, None, -(2**62), 0, 1]
    assert found.column("passed").to_pylist() == [True, None, False, None, True]


def test_csv_and_parquet_hold_the_same_table() -> None:
    header, *lines = csv.reader(io.StringIO(csv_table(TABLE), newline=""))
    found = parquet(TABLE)
    assert header == found.column_names

    def text(value: object) -> str:
        return "" if value is None else str(value).lower() if isinstance(value, bool) else str(value)

    for name, texts in zip(header, zip(*lines, strict=True), strict=True):
        values = found.column(name).to_pylist()
        if name == "date":
            assert [datetime.fromisoformat(x) if x else None for x in texts] == values
        elif name == "value":
            assert [float(x) if x else None for x in texts] == values  # all digits
        else:
            assert list(texts) == [text(value) for value in values]


def test_same_table_same_bytes() -> None:
    assert parquet_table(TABLE) == parquet_table(DataTable(COLUMNS, tuple(tuple(row) for row in ROWS)))


def test_types_do_not_depend_on_the_rows() -> None:
    empty, nothing = DataTable(COLUMNS, ()), DataTable(COLUMNS, ((None,) * 5,))
    assert parquet(empty).schema == parquet(nothing).schema == parquet(TABLE).schema
    assert csv_table(empty) == "log,date,value,samples,passed\n"
    assert parquet(empty).num_rows == 0


@pytest.mark.parametrize(
    ("column", "value"), [(1, 3), (2, "3"), (2, True), (3, 1.5), (3, True), (4, 1), (0, 7), (4, "true")]
)
def test_value_of_another_type_is_refused(column: int, value: object) -> None:
    row = [None] * 5
    row[column] = value  # type: ignore[call-overload]
    table = DataTable(COLUMNS, (tuple(row),))
    for write in (csv_table, parquet_table):
        with pytest.raises(TypeError, match=f"column {COLUMNS[column].name}: found"):
            write(table)


def test_names_of_files_that_are_no_utf8() -> None:
    table = DataTable((Column("log", "text"),), ((b"\xff.mcap".decode(errors="surrogateescape"),),))
    assert parquet(table).column("log").to_pylist() == ["\\udcff.mcap"]
    assert csv_table(table).encode() == b"log\n\\udcff.mcap\n"
