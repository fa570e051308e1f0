"""When the beam has to look at each track again: a calendar of a turn's bins, and an alarm.

Each track stands in the list of the bin in which its gate may be reached, so a bin looks at those that
it concerns, and no others. How long a track may rest is reckoned for a beam that keeps its pace; for
one that lingers each entry has a time, too, and the alarm is set to the first of these or before.
"""

import math
from typing import Any

from radar_console.tracker.kernels import bare
from radar_console.tracker.records import N_NEXT_BIN, N_TRACKS, Books

_NEVER = math.inf


@bare
def enter(index: int, books: Books) -> None:
    """Have a new track looked at in the next bin."""
    books.agenda[index].bin = -1
    at_once(index, books)


@bare
def at_once(index: int, books: Books) -> None:
    """Have the track looked at in the next bin."""
    _put(index, books.size[N_NEXT_BIN], books)
    books.agenda[index].time = _NEVER


@bare
def rest(index: int, angle: float, time: float, width: float, books: Books) -> None:
    """Let the track be until the beam is at `angle`, or the clock at `time`; bins are `width` rad wide."""
    number = max(math.ceil(angle / width), books.size[N_NEXT_BIN])
    _put(index, number, books)
    books.agenda[index].time = time
    books.alarm[0] = min(books.alarm[0], time)


@bare
def turn_page(beam: Any, width: float, books: Books) -> int:
    """Go on to the bin that ends at the beam: the first of the tracks in its list, -1 if there is none.

    The list is the caller's, who takes one after the other off with `tear`.
    """
    number = round(beam.phi / width)
    books.size[N_NEXT_BIN] = number
    if beam.t >= books.alarm[0]:
        _ring(beam.t, books)
    books.size[N_NEXT_BIN] = number + 1
    page = number % books.pages.size
    first = books.pages[page]
    books.pages[page] = -1
    return int(first)


@bare
def tear(index: int, books: Books) -> int:
    """Take the first track off the list of the bin that is now; the next one, or -1."""
    books.agenda[index].bin = -1
    return int(books.agenda[index].after)


@bare
def _ring(now: float, books: Books) -> None:
    """Call those whose time has come to the bin that is now, and set the alarm anew."""
    books.alarm[0] = _NEVER
    for index in range(books.size[N_TRACKS]):
        time = books.agenda[index].time
        if time <= now:
            at_once(index, books)
        elif time < books.alarm[0]:
            books.alarm[0] = time


@bare
def _put(index: int, number: int, books: Books) -> None:
    leave(index, books)
    page, entry = number % books.pages.size, books.agenda[index]
    entry.bin, entry.before, entry.after = page, -1, books.pages[page]
    if entry.after >= 0:
        books.agenda[entry.after].before = index
    books.pages[page] = index


@bare
def leave(index: int, books: Books) -> None:
    """Take the track out."""
    entry = books.agenda[index]
    if entry.bin < 0:
        return
    if entry.before >= 0:
        books.agenda[entry.before].after = entry.after
    else:
        books.pages[entry.bin] = entry.after
    if entry.after >= 0:
        books.agenda[entry.after].before = entry.before
    entry.bin = -1


@bare
def move(source: int, target: int, books: Books) -> None:
    """Write the entry of one row into another's, that is out."""
    a, b = books.agenda[source], books.agenda[target]
    b.bin, b.before, b.after, b.time = a.bin, a.before, a.after, a.time
    if b.bin < 0:
        return
    if b.before >= 0:
        books.agenda[b.before].after = target
    else:
        books.pages[b.bin] = target
    if b.after >= 0:
        books.agenda[b.after].before = target
