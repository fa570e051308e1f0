"""The blocks of a datagram: category (1 byte), length (2 bytes, of the whole block), records."""

from collections import Counter
from collections.abc import Iterator

HEADER = 3
CHAIN = 3  # so many good blocks in a row are no accident

_IN_USE = """
1 2 3 4 7 8 9 10 11 15 16 17 18 19 20 21 22 23 24 25 30 31 32 33 34 48 62 63 65
129 150 151 152 153 154 156 157 159 204 205 238 239 240 241 244 247 252
"""
CATEGORIES = frozenset(map(int, _IN_USE.split()))
"""Categories in use, by EUROCONTROL's list."""


def blocks(data: bytes, cut: bool, skipped: Counter[str]) -> Iterator[tuple[int, int, int]]:
    """Yield category, first byte and end of the records of every block.

    Where no block follows, bytes are counted up to the next place where three good ones do, or to the
    end. A last block that reaches over the end is yielded
    as far as it goes if the datagram is known to be cut off; otherwise those bytes are a trailer.

    Parameters
    ----------
    data : what a datagram carried
    cut : bytes are missing at its end
    skipped : counts bytes by reason
    """
    at, size = 0, len(data)
    while at < size:
        length = int.from_bytes(data[at + 1 : at + HEADER], "big")
        fits = at + HEADER <= size and length > HEADER
        if fits and at + length <= size:
            yield data[at], at + HEADER, at + length
            at += length
            continue
        if cut and fits and data[at] in CATEGORIES:
            skipped["blocks cut off by the end of the file or packet"] += 1
            yield data[at], at + HEADER, size
            return
        following = _next_chain(data, at + 1)
        if following is not None:
            skipped["bytes between blocks"] += following - at
            at = following
            continue
        if at == 0:
            skipped["datagrams that are no ASTERIX"] += 1
            skipped["bytes of datagrams that are no ASTERIX"] += size
        else:
            skipped["bytes after the last block of a datagram"] += size - at
        return


def is_asterix(data: bytes) -> bool:
    """Whether a file is a row of blocks: they cover half of it, or there are several.

    Text can look like the beginning of a block, and a damaged file has a good beginning only.
    """
    count, end = _chain(data, 0)
    return count >= CHAIN or (count >= 1 and 2 * end >= len(data))


def _next_chain(data: bytes, at: int) -> int | None:
    """The first place from `at` on where three whole blocks of known categories follow."""
    return next((p for p in range(at, len(data)) if _chain(data, p)[0] >= CHAIN), None)


def _chain(data: bytes, at: int) -> tuple[int, int]:
    """How many whole blocks of known categories begin at `at`, three at most, and where they end."""
    count = 0
    while at + HEADER < len(data) and data[at] in CATEGORIES and count < CHAIN:
        length = int.from_bytes(data[at + 1 : at + HEADER], "big")
        if length <= HEADER or at + length > len(data):
            break
        at += length
        count += 1
    return count, at
