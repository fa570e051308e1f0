import threading

import numpy as np
from console_stream import Stream

from radar_console.display.feed import Feed


def test_takes_what_was_put_in_order_and_only_once() -> None:
    sent = list(Stream().sectors(1.0))
    feed = Feed()
    for sector in sent:
        feed.put(sector)
    batch = feed.take()
    assert [s.end for s in batch.sectors] == [s.end for s in sent]
    assert np.isfinite(batch.arrived)
    assert feed.take().sectors == []


def test_a_full_feed_drops_the_oldest_and_counts_it_with_its_returns() -> None:
    sent = list(Stream().sectors(1.0))
    feed = Feed(capacity=10)
    for sector in sent:
        feed.put(sector)
    lost = sent[:-10]
    assert feed.depth == 10
    assert feed.sectors_dropped == len(lost)
    assert feed.returns_dropped == sum(len(s.plots) + len(s.centroids) for s in lost)
    assert feed.take().sectors[0] is sent[-10]


def test_only_the_newest_truth_is_kept() -> None:
    stream, feed = Stream(), Feed()
    feed.put_truth(stream.truth(1.0))
    feed.put_truth(stream.truth(2.0))
    truth = feed.take().truth
    assert truth is not None
    assert truth["time"][0] == 2.0
    assert feed.take().truth is None


def test_two_threads_lose_nothing_uncounted() -> None:
    sent = list(Stream().sectors(20.0))
    feed = Feed(capacity=16)
    pump = threading.Thread(target=lambda: [feed.put(sector) for sector in sent])
    pump.start()
    taken = 0
    while pump.is_alive():
        taken += len(feed.take().sectors)
    pump.join()
    taken += len(feed.take().sectors)
    assert taken + feed.sectors_dropped == len(sent)


def test_failure_ends_the_feed_with_its_sentence() -> None:
    feed = Feed()
    feed.fail("flight.pcap: cut off")
    assert feed.finished
    assert feed.failure == "flight.pcap: cut off"
