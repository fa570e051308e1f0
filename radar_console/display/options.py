"""How the console starts on a source; no Qt here, so that whoever builds it starts fast."""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Options:
    """What the source and its settings say to the console.

    Attributes
    ----------
    title, subtitle : over the scope
    tracker_name : in the status bar
    range_m : from the centre to the rim, m; None: the instrumented range
    afterglow_s, trail_s, vector_s : as in `View`
    speed_unit : ``km/h``, ``kn`` or ``m/s``
    range_unit : ``km`` or ``NM``
    epoch : date and time of data time 0; None if the source does not know it
    user_map : a GeoJSON file
    """

    title: str
    subtitle: str = ""
    tracker_name: str = ""
    range_m: float | None = None
    afterglow_s: float = 4.0
    trail_s: float = 60.0
    vector_s: float = 60.0
    speed_unit: str = "km/h"
    range_unit: str = "km"
    epoch: datetime | None = None
    user_map: Path | None = None
