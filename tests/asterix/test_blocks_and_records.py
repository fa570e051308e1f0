"""Blocks and records: the reader against libasterix, and against anything that can arrive."""

from collections import Counter

import pytest
from asterix_bytes import block, mark, record, report
from hypothesis import given, settings
from hypothesis import strategies as st

from radar_console.asterix.blocks import blocks, is_asterix
from radar_console.asterix.records import CAT_034, CAT_048, Reader, Uap

GOOD = block(48, report(10.0))


def walk(data: bytes, cut: bool = False) -> tuple[list[bytes], Counter[str]]:
    skipped: Counter[str] = Counter()
    return [data[at:end] for _, at, end in blocks(data, cut, skipped)], skipped


def test_a_trailer_is_counted_and_the_blocks_kept():
    found, skipped = walk(GOOD * 2 + b"\x00\x20\xf5\x10")
    assert found == [GOOD[3:]] * 2
    assert skipped == {"bytes after the last block of a datagram": 4}


def test_thousands_of_blocks_in_a_row():
    found, skipped = walk(GOOD * 5000)
    assert len(found) == 5000
    assert not skipped


def test_good_blocks_behind_a_bad_length_are_found_again():
    found, skipped = walk(GOOD * 2 + b"\x30\x00\x01garbage" + GOOD * 4)
    assert len(found) == 6
    assert skipped == {"bytes between blocks": 10}


def test_a_cut_off_block_gives_its_whole_records():
    data = block(48, report(1.0), report(2.0), report(3.0))[:-2]
    found, skipped = walk(data, cut=True)
    assert skipped == {"blocks cut off by the end of the file or packet": 1}
    records = list(Reader(CAT_048).records(found[0], 0, len(found[0])))
    assert [isinstance(r, dict) for r in records] == [True, True, False]


@given(st.binary(max_size=400))
def test_every_byte_is_in_a_block_or_counted(data):
    found, skipped = walk(data)
    counted = sum(count for reason, count in skipped.items() if reason.startswith("bytes"))
    assert sum(len(body) + 3 for body in found) + counted == len(data)


@given(st.binary(max_size=200), st.sampled_from([CAT_034, CAT_048]))
def test_any_bytes_are_records_or_a_reason(data, uap):
    read = 0
    for found in Reader(uap).records(data, 0, len(data)):
        if isinstance(found, tuple):
            read += found[1]
        else:
            read += sum(map(len, found.values()))
    # What is neither an item nor left over is FSPEC.
    assert read <= len(data)


@given(st.binary(max_size=300))
def test_text_and_noise_do_not_crash_the_guess(data):
    is_asterix(data)


@pytest.fixture(scope="module")
def oracle():
    from asterix import base, generated

    def parse(category: int, data: bytes):
        edition = {34: generated.Cat_034_1_29, 48: generated.Cat_048_1_32}[category]
        result = edition.cv_uap.cv_record.parse(base.ParsingMode.StrictParsing, base.Bits.from_bytes(data))
        if isinstance(result, ValueError):
            return None
        found, rest = result
        names = [n for n in (name for name, _ in _uap(category)) if found.get_item(n) is not None]
        return {n: found.get_item(n).unparse().to_bytes() for n in names}, len(data) - len(rest) // 8

    return parse


def _uap(category: int) -> Uap:
    return CAT_034 if category == 34 else CAT_048


@st.composite
def shaped(draw):
    """FSPEC bits of the category, then bytes that make most variable items short."""
    category = draw(st.sampled_from([34, 48]))
    bits = draw(st.sets(st.integers(0, len(_uap(category)) - 1), min_size=1, max_size=12))
    fspec = bytearray(max(bits) // 7 + 1)
    for bit in bits:
        fspec[bit // 7] |= 0x80 >> bit % 7
    for i in range(len(fspec) - 1):
        fspec[i] |= 1
    body = draw(st.lists(st.integers(0, 255) | st.integers(0, 4), min_size=60, max_size=90))
    return category, bytes(fspec) + bytes(body)


@settings(max_examples=300)
@given(shaped())
def test_items_are_those_of_libasterix(oracle, made):
    category, data = made
    expected = oracle(category, data)
    found = next(Reader(_uap(category)).records(data, 0, len(data)))
    if expected is None:
        return  # libasterix also rejects extensions that the edition does not define; those we pass over
    items, size = expected
    assert found == items
    fspec = next(i + 1 for i, byte in enumerate(data) if not byte & 1)
    assert fspec + sum(map(len, items.values())) == size


def test_the_profiles_name_every_item_of_libasterix(oracle):
    from asterix import generated

    for edition, uap in ((generated.Cat_034_1_29, CAT_034), (generated.Cat_048_1_32, CAT_048)):
        theirs = set(edition.cv_uap.cv_record.cv_items_dict)
        assert theirs == {name for name, _ in uap}


@pytest.mark.parametrize(
    "data",
    [
        b"\x00",
        b"\xff\xff\xff\xff\xff\x00",
        b"\x80\x01",
        record(CAT_034, {"050": b"\x40\x00"}),
        record(CAT_048, {"SP": b"\x00"}),
    ],
)
def test_a_broken_record_is_a_reason_and_the_good_one_before_it_stays(data):
    good = mark(1.0, 8) if data[0] == 0x04 else report(1.0)
    uap = CAT_034 if data[0] == 0x04 else CAT_048
    found = list(Reader(uap).records(good + data, 0, len(good + data)))
    assert isinstance(found[0], dict)
    assert found[1][1] == len(data)
    assert len(found) == 2
