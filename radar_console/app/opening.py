"""Open whatever the user names: a scenario, a recording, a plot table."""

import difflib
from pathlib import Path

from radar_console import scenario
from radar_console.chain import Opened, simulation
from radar_console.core.errors import InputError
from radar_console.scenario import Configuration

DEMO = "twenty-five"
ASTERIX_SUFFIXES = (".pcap", ".pcapng", ".ast")
EXPECTED = "expected a scenario (.toml), an ASTERIX recording (.pcap, .ast) or a plot table (.csv)"

AIR_TRAFFIC = {"range_unit": "NM", "speed_unit": "kn", "trail_s": 300.0}
"""How a recorded air-traffic radar is shown unless the configuration says otherwise."""


def scenarios() -> dict[str, Path]:
    """The scenario files that come along, by name."""
    return scenario.shipped()


def open_source(
    name: str | None,
    config: Path | None = None,
    seed: int | None = None,
    sac_sic: tuple[int, int] | None = None,
) -> Opened:
    """Open a source by the name that the user typed; without one, the demo.

    Parameters
    ----------
    name : a file, or the name of a scenario that comes along
    config : a scenario file whose [radar], [plots], [tracker] and [display] apply to a recording
    seed : in place of the scenario's
    sac_sic : which radar of a recording

    Raises
    ------
    InputError, ScenarioError   the file or its content is not what was expected
    """
    file = find(name or DEMO)
    suffix = file.suffix.lower()
    if suffix == ".toml":
        return _simulation(file, config, seed)
    given = frozenset[str]()
    settings = Configuration()
    if config is not None:
        settings, given = scenario.load_configuration(find(str(config)))
    if suffix in ASTERIX_SUFFIXES:
        from radar_console.asterix.source import AsterixRecording

        recording = AsterixRecording(file, sac_sic, settings.radar.message, given)
        usual = {key: value for key, value in AIR_TRAFFIC.items() if f"display.{key}" not in given}
        settings = settings.model_copy(update={"display": settings.display.model_copy(update=usual)})
        return Opened(recording, settings, file.name, "recording", None, seed or 0)
    if suffix == ".csv":
        from radar_console.recording.table import PlotTable

        table = PlotTable(file, settings.radar.message, given)
        pulses = round(settings.radar.rotation_s * settings.radar.prf_hz)
        if not table.has_pulses(pulses):
            what = f"does not go with azimuth_deg at {pulses:,} pulses a turn"
            raise InputError(
                file, "pulse", f"{what}; expected --config with the radar's rotation_s and prf_hz"
            )
        return Opened(table, settings, file.name, "plot table", None, seed or 0)
    raise InputError(file, "", f"unknown kind of file; {EXPECTED}")


def find(name: str) -> Path:
    """The file that the user named, or the scenario that comes along by that name.

    Raises
    ------
    InputError   there is none
    """
    file = Path(name)
    if file.is_file():
        return file
    known = scenarios()
    if name in known:
        return known[name]
    if file.is_dir():
        raise InputError(file, "", f"is a folder; {EXPECTED}")
    near = difflib.get_close_matches(name, known, n=1)
    meant = f"did you mean {near[0]}? Otherwise " if near else ""
    raise InputError(file, "", f"no such file; {meant}{EXPECTED}, or one of: {', '.join(known)}")


def _simulation(file: Path, config: Path | None, seed: int | None) -> Opened:
    if config is not None:
        raise InputError(config, "", "--config goes with a recording; a scenario brings its own settings")
    settings = scenario.load(file)
    return simulation(settings, settings.seed if seed is None else seed, file)
