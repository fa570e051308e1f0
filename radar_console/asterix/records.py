"""A table-driven reader of CAT-034 and CAT-048 records.

A record begins with FSPEC, a bit for every item of the category's user application profile (UAP);
the items follow in that order. The tables give only each item's length, so that any item can be
skipped; whoever needs an item reads its bytes.

Source: EUROCONTROL ASTERIX Part 1 (blocks, FSPEC, kinds of item), Part 2b (CAT-034, edition 1.29)
and Part 4 (CAT-048, edition 1.32).
"""

from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Fixed:
    size: int


@dataclass(frozen=True, slots=True)
class Extended:
    """Bytes whose lowest bit says that another follows."""


@dataclass(frozen=True, slots=True)
class Repetitive:
    """A count (1 byte), then so many times `size` bytes."""

    size: int


@dataclass(frozen=True, slots=True)
class Explicit:
    """A length (1 byte, counting itself), then the rest."""


@dataclass(frozen=True, slots=True)
class Compound:
    """A primary subfield like FSPEC, then the parts that it names; None is a spare bit."""

    parts: tuple["Fixed | Repetitive | None", ...]


Layout = Fixed | Extended | Repetitive | Explicit | Compound
Uap = tuple[tuple[str, Layout], ...]

_BYTE, _FX = Fixed(1), Extended()

CAT_034: Uap = (
    ("010", Fixed(2)),
    ("000", Fixed(1)),
    ("030", Fixed(3)),
    ("020", Fixed(1)),
    ("041", Fixed(2)),
    ("050", Compound((_BYTE, None, None, _BYTE, _BYTE, Fixed(2), None))),
    ("060", Compound((_BYTE, None, None, _BYTE, _BYTE, _BYTE, None))),
    ("070", Repetitive(2)),
    ("100", Fixed(8)),
    ("110", Fixed(1)),
    ("120", Fixed(8)),
    ("090", Fixed(2)),
    ("RE", Explicit()),
    ("SP", Explicit()),
)

CAT_048: Uap = (
    ("010", Fixed(2)),
    ("140", Fixed(3)),
    ("020", _FX),
    ("040", Fixed(4)),
    ("070", Fixed(2)),
    ("090", Fixed(2)),
    ("130", Compound((_BYTE,) * 7)),
    ("220", Fixed(3)),
    ("240", Fixed(6)),
    ("250", Repetitive(8)),
    ("161", Fixed(2)),
    ("042", Fixed(4)),
    ("200", Fixed(4)),
    ("170", _FX),
    ("210", Fixed(4)),
    ("030", _FX),
    ("080", Fixed(2)),
    ("100", Fixed(4)),
    ("110", Fixed(2)),
    ("120", Compound((Fixed(2), Repetitive(6)))),
    ("230", Fixed(2)),
    ("260", Fixed(7)),
    ("055", Fixed(1)),
    ("050", Fixed(2)),
    ("065", Fixed(1)),
    ("060", Fixed(2)),
    ("SP", Explicit()),
    ("RE", Explicit()),
)

Items = dict[str, bytes]


class Malformed(Exception):
    """A record can't be read; why, as a reason to count by."""


class Reader:
    """Reads the records of one category, and remembers the shapes that it has met."""

    def __init__(self, uap: Uap) -> None:
        self._uap = uap
        self._shapes: dict[bytes, tuple[tuple[str, int, Layout], ...]] = {}

    def records(self, data: bytes, at: int, end: int) -> Iterator[Items | tuple[str, int]]:
        """Yield the items of each record, as bytes by number.

        The records of a block are not delimited: after one that can't be read the rest of the block
        is lost, and the last thing yielded is why, and how many bytes.
        """
        while at < end:
            try:
                items, following = self._record(data, at, end)
            except Malformed as error:
                yield str(error), end - at
                return
            yield items
            at = following

    def _record(self, data: bytes, at: int, end: int) -> tuple[Items, int]:
        stop = _extended(data, at, end)
        fspec = data[at:stop]
        shape = self._shapes.get(fspec)
        if shape is None:
            shape = self._shapes[fspec] = self._shape(fspec)
        items: Items = {}
        at = stop
        for name, size, layout in shape:
            stop = at + size if size else _end(layout, data, at, end)
            items[name] = data[at:stop]
            at = stop
        if at > end:
            raise Malformed("records that reach over the end of their block")
        return items, at

    def _shape(self, fspec: bytes) -> tuple[tuple[str, int, Layout], ...]:
        """Name, fixed size (0 where it varies) and layout of the items that FSPEC announces."""
        present = [7 * i + bit for i, byte in enumerate(fspec) for bit in range(7) if byte << bit & 0x80]
        if not present:
            raise Malformed("records without items")
        if present[-1] >= len(self._uap):
            raise Malformed("records with an item that the category does not have")
        items = (self._uap[i] for i in present)
        return tuple(
            (name, layout.size if isinstance(layout, Fixed) else 0, layout) for name, layout in items
        )


def _end(layout: Layout, data: bytes, at: int, end: int) -> int:
    """Where the item that begins at `at` ends."""
    if isinstance(layout, Fixed):
        return at + layout.size
    if isinstance(layout, Extended):
        return _extended(data, at, end)
    if at >= end:
        raise Malformed("records that reach over the end of their block")
    if isinstance(layout, Repetitive):
        return at + 1 + layout.size * data[at]
    if isinstance(layout, Explicit):
        if data[at] == 0:
            raise Malformed("records with an explicit item of length 0")
        return at + data[at]
    stop = _extended(data, at, end)
    present = [7 * i + bit for i, byte in enumerate(data[at:stop]) for bit in range(7) if byte << bit & 0x80]
    at = stop
    for number in present:
        part = layout.parts[number] if number < len(layout.parts) else None
        if part is None:
            raise Malformed("records with a subfield that the item does not have")
        at = _end(part, data, at, end)
    return at


def _extended(data: bytes, at: int, end: int) -> int:
    """Behind the first byte from `at` on whose lowest bit is 0."""
    while at < end:
        at += 1
        if not data[at - 1] & 1:
            return at
    raise Malformed("records that reach over the end of their block")
