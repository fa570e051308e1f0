"""Every scenario that comes along, tracked for its first turns, without a window and without a clock."""

from dataclasses import replace
from itertools import takewhile
from pathlib import Path

import numpy as np
import pytest

from radar_console.app.console import options_of
from radar_console.app.opening import open_source, scenarios
from radar_console.chain import Chain
from radar_console.core.messages import Table, TrackStatus

TURNS = 6
FILES = sorted(scenarios().values())
EXPECTED = {
    # targets that are found at least, and confirmed tracks of none at most
    **{f"arpa-{scene}": (1, 0) for scene in (1, 2, 3, 4)},
    "crossing-pair": (0, 0),  # among so many false points it takes a hundred turns
    "harbour": (8, 0),
    "seven-targets": (7, 0),
    "stress": (950, 20),  # of 1,000; where echoes merge, a track is between the two
    "twenty-five": (23, 4),  # a target may be missed in two of its first looks; low confirm_score
    "twenty-five-dense": (1, 1),  # slow there, too
}
NEAR_SIGMAS = 6.0  # raw returns: now and then a centroid errs by more than it claims
LEAST_NEAR = 50.0  # m, beside the tracks' own deviations: echoes merge with what is next to them


def first_tracks(file: Path) -> tuple[Chain, Table]:
    """The chain after some turns, and the newest row of every track that is confirmed or coasts."""
    chain = Chain(open_source(str(file)))
    end = TURNS * chain.opened.source.radar.rotation
    newest: dict[int, Table] = {}
    for sector in takewhile(lambda sector: sector.stop <= end, chain.run()):
        for row in sector.tracks:
            newest[int(row["track"])] = row
    held = [row for row in newest.values() if row["status"] in (TrackStatus.CONFIRMED, TrackStatus.COASTING)]
    return chain, np.array(held, dtype=next(iter(newest.values())).dtype)


def near_truth(chain: Chain, tracks: Table) -> tuple[int, int]:
    """How many targets have a track near them, and how many tracks no target."""
    assert chain.opened.truth is not None
    found, alone = set(), 0
    for row in tracks:
        truth = chain.opened.truth(float(row["time"]))
        distance = np.hypot(truth["east"] - row["east"], truth["north"] - row["north"])
        reach = LEAST_NEAR + NEAR_SIGMAS * np.hypot(row["sd_east"], row["sd_north"])
        if distance.min() < reach:
            found.add(int(truth["target"][distance.argmin()]))
        else:
            alone += 1
    return len(found), alone


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.stem))
def test_the_first_turns(file: Path) -> None:
    chain, tracks = first_tracks(file)
    counts = chain.tracker.counts
    assert counts.centroids > 0
    assert (counts.invalid, counts.late, counts.capped) == (0, 0, 0)
    for name in ("time", "east", "north", "v_east", "v_north", "sd_east", "sd_north"):
        assert np.isfinite(tracks[name]).all()
    found, alone = near_truth(chain, tracks)
    least, most_alone = EXPECTED[file.stem]
    assert found >= least
    assert alone <= most_alone


@pytest.mark.parametrize(
    ("filter", "says"), [("particle", "particle 1000 · GNN"), ("kalman", "kalman · GNN")]
)
def test_the_status_bar_names_the_tracker(filter, says):
    opened = open_source("twenty-five")
    tracker = opened.settings.tracker.model_copy(update={"filter": filter, "associator": "gnn"})
    settings = opened.settings.model_copy(update={"tracker": tracker})
    assert options_of(replace(opened, settings=settings), None).tracker_name == says
