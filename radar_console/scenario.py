"""Scenario files: TOML in, frozen settings out; every problem at once, each with its path.

Units are in the names of the keys. The settings keep those units; whoever uses them converts.
"""

import difflib
import json
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self, TypeVar, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import ErrorDetails, PydanticCustomError

from radar_console.core.errors import InputError, ScenarioError
from radar_console.core.messages import Radar, Site
from radar_console.core.units import DEG, KM, KMH, KT

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Probability = Annotated[float, Field(ge=0, le=1)]
Bearing = Annotated[float, Field(ge=0, lt=360)]
Count = Annotated[int, Field(ge=1)]

SHORT = {"pf": "particle", "kf": "kalman", "ekf": "extended", "ukf": "unscented"}
"""What the field calls the filters for short."""


def _spelt_out(name: Any) -> Any:
    return SHORT.get(name, name) if isinstance(name, str) else name


FilterName = Annotated[
    Literal["particle", "kalman", "extended", "unscented", "imm"],
    BeforeValidator(_spelt_out),
    WithJsonSchema({"type": "string", "enum": [*SHORT.values(), "imm", *SHORT]}),
]


class Settings(BaseModel):
    """A table of a scenario file: unknown keys and other types are errors."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    alternatives: ClassVar[tuple[tuple[tuple[str, ...], ...], ...]] = ()
    """Groups of keys of which exactly one is given, and whole; several such choices."""

    @model_validator(mode="after")
    def _check_alternatives(self) -> Self:
        for groups in self.alternatives:
            _exactly_one(self, *groups)
        return self


def _exactly_one(table: Settings, *groups: tuple[str, ...]) -> None:
    """Anything but one group of keys, whole, is an error."""
    given = [group for group in groups if any(getattr(table, key) is not None for key in group)]
    choice = " or ".join(" and ".join(group) for group in groups)
    if len(given) != 1:
        raise PydanticCustomError("one_of", "expected exactly one of: {choice}", {"choice": choice})
    missing = [key for key in given[0] if getattr(table, key) is None]
    if missing:
        raise PydanticCustomError("incomplete", "also needs {missing}", {"missing": ", ".join(missing)})


class Straight(Settings):
    """Constant velocity."""

    kind: Literal["straight"]
    duration_s: Positive


class Accelerate(Settings):
    """Constant acceleration along the course; negative brakes."""

    kind: Literal["accelerate"]
    acceleration_mps2: Finite
    duration_s: Positive


class Turn(Settings):
    """Coordinated turn: constant speed and centripetal acceleration."""

    kind: Literal["turn"]
    acceleration_g: Positive
    direction: Literal["left", "right"]
    duration_s: Positive


Leg = Annotated[Straight | Accelerate | Turn, Field(discriminator="kind")]


class Target(Settings):
    """One target: where it starts, how it moves, how strongly it echoes.

    After its last leg it goes on straight until the end of the scenario, or until `end_s`.
    """

    alternatives = (
        (("range_km", "azimuth_deg"), ("latitude_deg", "longitude_deg"), ("east_km", "north_km")),
        (("speed_mps",), ("speed_kmh",), ("speed_kt",)),
    )

    name: str = ""
    range_km: NonNegative | None = None
    azimuth_deg: Bearing | None = None
    latitude_deg: Annotated[float, Field(ge=-90, le=90)] | None = None
    longitude_deg: Annotated[float, Field(ge=-180, le=180)] | None = None
    east_km: Finite | None = None
    north_km: Finite | None = None
    height_m: Annotated[Finite | None, Field(description="above sea level; without it the world is flat")] = (
        None
    )
    climb_mps: Finite = 0.0
    heading_deg: Bearing
    speed_mps: NonNegative | None = None
    speed_kmh: NonNegative | None = None
    speed_kt: NonNegative | None = None
    start_s: NonNegative = 0.0
    end_s: Positive | None = None
    rcs_db: Annotated[Finite, Field(description="echo strength relative to the radar's reference target")] = (
        0.0
    )
    legs: tuple[Leg, ...] = ()

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.end_s is not None and self.end_s <= self.start_s:
            raise PydanticCustomError("order", "end_s must be greater than start_s")
        if self.climb_mps and self.height_m is None:
            raise PydanticCustomError("incomplete", "climb_mps also needs height_m")
        return self

    @property
    def speed(self) -> float:
        """m/s"""
        if self.speed_mps is not None:
            return self.speed_mps
        return self.speed_kmh * KMH if self.speed_kmh is not None else (self.speed_kt or 0.0) * KT


class Swarm(Settings):
    """Many random targets: uniform over a ring, random course, straight and level."""

    count: Count
    min_range_km: NonNegative = 0.0
    max_range_km: Positive
    min_speed_kmh: NonNegative
    max_speed_kmh: Positive

    @model_validator(mode="after")
    def _check(self) -> Self:
        for low, high in (("min_range_km", "max_range_km"), ("min_speed_kmh", "max_speed_kmh")):
            if getattr(self, low) > getattr(self, high):
                raise PydanticCustomError("order", "{low} must not exceed {high}", {"low": low, "high": high})
        return self


class RadarSettings(Settings):
    """The radar: where it stands, how it turns, what it measures."""

    name: str = "Radar"
    latitude_deg: Annotated[float, Field(ge=-90, le=90)] | None = None
    longitude_deg: Annotated[float, Field(ge=-180, le=180)] | None = None
    height_m: Finite = 0.0
    course_deg: Annotated[Bearing, Field(description="of a moving radar (own ship)")] = 0.0
    speed_kt: NonNegative = 0.0
    rotation_s: Positive = 4.0
    max_range_km: Positive = 300.0
    sectors: Annotated[int, Field(ge=4, le=1024, description="messages a turn")] = 64

    returns: Annotated[
        Literal["raw", "centroids"],
        Field(
            description="raw: pulses in range cells; centroids: one Gaussian measurement per detected target"
        ),
    ] = "raw"

    prf_hz: Positive = 450.0
    beam_width_deg: Annotated[Positive, Field(lt=90, description="one way, 3 dB")] = 1.5
    cell_m: Positive = 150.0
    wavelength_m: Positive = 0.1
    snr_db: Annotated[
        Finite, Field(description="single-pulse peak SNR of the reference target at snr_range_km")
    ] = 19.0
    snr_range_km: Positive = 250.0
    stc_range_km: Annotated[
        NonNegative, Field(description="below it sensitivity time control holds the SNR")
    ] = 50.0
    p_fa: Annotated[float, Field(gt=0, lt=1, description="per cell and pulse")] = 6e-3
    fluctuation: Literal["swerling0", "swerling1"] = "swerling1"

    p_d: Annotated[Probability, Field(description="detection probability, returns = centroids")] = 0.9
    sd_range_m: Annotated[Positive, Field(description="measurement deviation, returns = centroids")] = 50.0
    sd_azimuth_deg: Positive = 0.1

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.latitude_deg is None) != (self.longitude_deg is None):
            raise PydanticCustomError("incomplete", "latitude_deg and longitude_deg belong together")
        return self

    @property
    def message(self) -> Radar:
        """What the rest of the chain knows of this radar."""
        site = None
        if self.latitude_deg is not None and self.longitude_deg is not None:
            site = Site(self.latitude_deg, self.longitude_deg, self.height_m)
        return Radar(
            name=self.name,
            rotation=self.rotation_s,
            max_range=self.max_range_km * KM,
            sd_range=self.sd_range_m,
            sd_azimuth=self.sd_azimuth_deg * DEG,
            beam_width=self.beam_width_deg * DEG,
            site=site,
        )


class UniformClutter(Settings):
    """False alarms over the whole coverage, Poisson, drawn anew each scan."""

    alternatives = ((("density_per_km2",), ("per_cell",)),)

    density_per_km2: NonNegative | None = None
    per_cell: Annotated[NonNegative | None, Field(description="mean number in a range cell × beam width")] = (
        None
    )
    kind: Annotated[
        Literal["targets", "points"],
        Field(description="targets: false targets with returns like a target's; points: single returns"),
    ] = "targets"


class DiscClutter(Settings):
    """False targets in a disc around every target, Poisson, drawn anew each scan.

    `mean` is a number for each disc, so overlapping discs add up; `density_per_km2` is one density
    over the union of the discs.
    """

    alternatives = ((("mean",), ("density_per_km2",)),)

    radius_km: Positive
    mean: NonNegative | None = None
    density_per_km2: NonNegative | None = None


class LandClutter(Settings):
    """A fixed patch of land: every cell of it echoes at every scan, with its own fixed strength."""

    from_range_km: NonNegative
    to_range_km: Positive
    from_azimuth_deg: Bearing
    to_azimuth_deg: Annotated[
        float, Field(ge=0, le=360, description="clockwise from from_azimuth_deg, north may lie between")
    ]
    snr_db: Annotated[Finite, Field(description="mean single-pulse SNR of a cell")] = 20.0

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.from_range_km >= self.to_range_km:
            raise PydanticCustomError("order", "from_range_km must be less than to_range_km")
        return self


class Clutter(Settings):
    uniform: tuple[UniformClutter, ...] = ()
    disc: tuple[DiscClutter, ...] = ()
    land: tuple[LandClutter, ...] = ()


class PlotSettings(Settings):
    """From plots to centroids."""

    min_hits: Annotated[Count, Field(description="plots that make a centroid")] = 3
    gap_pulses: Annotated[Count, Field(description="largest step in pulses between neighbours")] = 2
    edge: Annotated[Probability, Field(description="hits weaker than this part of the peak do not weigh")] = (
        0.3
    )
    split: Annotated[bool, Field(description="cut a cluster at a valley between two peaks")] = True
    land_pulses: Annotated[Count, Field(description="a cluster over more pulses is flagged as extended")] = 22
    land_cells: Annotated[
        Count, Field(description="a cluster over more range cells is flagged as extended")
    ] = 5


class TrackerSettings(Settings):
    """Association, filter, initiation and deletion."""

    filter: FilterName = "particle"
    models: Annotated[
        tuple[Literal["cv", "ca", "ct", "singer"], ...],
        Field(
            max_length=4,
            description="motion models: constant velocity, constant acceleration, coordinated turn, "
            "Singer's; several for particle and imm; without it cv, and for imm cv, ca and ct",
        ),
    ] = ()
    proposal: Annotated[
        Literal["adapted", "optimal", "prior"],
        Field(description="adapted: velocities marginalised; prior: the bootstrap filter"),
    ] = "adapted"
    resampling: Annotated[
        Literal["systematic", "stratified", "residual", "multinomial"],
        Field(description="of the proposals prior and optimal; adapted resamples as it draws"),
    ] = "systematic"
    likelihood: Annotated[
        Literal["filter", "gaussian"],
        Field(description="what associates: the filter's own likelihood, or a Gaussian from its moments"),
    ] = "filter"
    associator: Annotated[
        Literal["jpda", "set-jpda", "gnn", "nn", "pda"],
        Field(
            description="set-jpda: adapted particles change between tracks that share plots, so that each is "
            "at one place; for formations, not for who is who; other filters have jpda's"
        ),
    ] = "jpda"
    gate: Annotated[
        Literal["ellipse", "rectangle"], Field(description="rectangle: along and across the line of sight")
    ] = "ellipse"
    initiation: Annotated[
        Literal["auto", "m-of-n", "score", "branching"],
        Field(description="auto: score, and branching where the clutter is dense"),
    ] = "auto"
    identity: Annotated[
        Literal["use", "ignore"], Field(description="Mode 3/A and Mode S address as evidence")
    ] = "use"
    doppler: Literal["use", "ignore"] = "use"
    dimensions: Annotated[Literal[2, 3], Field(description="3: height too, where reports have one")] = 3
    manoeuvre_mps2: Annotated[Positive, Field(description="rms acceleration of a manoeuvre")] = 15.0
    manoeuvre_s: Annotated[
        Positive, Field(description="how long a manoeuvre lasts; time constant of Singer's model")
    ] = 10.0
    straight_s: Annotated[
        Positive, Field(description="how long straight flight lasts between manoeuvres")
    ] = 30.0
    turn_rate_dps: Annotated[Positive, Field(description="rms rate of a turn")] = 6.0
    max_tracks: Annotated[
        Count, Field(description="capacity, young tracks included; the least likely young ones go first")
    ] = 50_000
    particles: Annotated[int, Field(ge=10, le=100_000)] = 1000
    resample_below: Annotated[
        Probability, Field(description="resample when N_eff < this part of the particles")
    ] = 0.5
    outliers: Annotated[
        float,
        Field(ge=0, lt=1, description="part of the centroids that err eight times as much as they claim"),
    ] = 0.05
    p_d: Annotated[Probability, Field(description="detection probability")] = 0.9
    gate_probability: Annotated[float, Field(gt=0, lt=1)] = 0.999999
    clutter_per_km2: Annotated[
        NonNegative | None, Field(description="false centroids; without it, estimated live")
    ] = None
    process_noise_m2ps3: Annotated[
        Positive,
        Field(description="power spectral density of the acceleration; 1 straight courses, 30 air traffic"),
    ] = 30.0
    max_speed_mps: Annotated[Positive, Field(description="gate of the two-point start")] = 400.0
    confirm_hits: Annotated[Count, Field(description="M of M-of-N")] = 3
    confirm_passes: Annotated[Count, Field(description="N of M-of-N")] = 5
    confirm_score: Annotated[
        Finite, Field(description="also needed: log-likelihood ratio of a target against clutter")
    ] = 6.9
    delete_misses: Annotated[
        Count, Field(description="a confirmed track is deleted after so many misses in a row")
    ] = 6
    bins: Annotated[int, Field(ge=1, le=4096, description="updates a turn; 1 is the whole-scan mode")] = 256
    wait_deg: Annotated[
        NonNegative, Field(description="longest wait of a cluster for its members, then it is closed")
    ] = 10.0

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.confirm_hits > self.confirm_passes:
            raise PydanticCustomError("order", "confirm_hits must not exceed confirm_passes")
        if len(set(self.models)) < len(self.models):
            raise PydanticCustomError("models", "models must not name a model twice")
        if len(self.models) > 1 and self.filter not in ("particle", "imm"):
            raise PydanticCustomError("models", "several models need filter particle or imm")
        return self


class DisplaySettings(Settings):
    """How the console starts."""

    range_km: Positive | None = None
    afterglow_s: Annotated[
        NonNegative | None, Field(description="time constant; 0 is off; without it, one turn of the antenna")
    ] = None
    trail_s: NonNegative = 60.0
    vector_s: NonNegative = 60.0
    speed_unit: Literal["km/h", "kn", "m/s"] = "km/h"
    range_unit: Literal["km", "NM"] = "km"


class Scenario(Settings):
    """A whole scenario file."""

    title: str
    description: str = ""
    seed: Annotated[int, Field(ge=0)] = 0
    duration_s: Positive
    radar: RadarSettings = RadarSettings()
    target: tuple[Target, ...] = ()
    swarm: tuple[Swarm, ...] = ()
    clutter: Clutter = Clutter()
    plots: PlotSettings = PlotSettings()
    tracker: TrackerSettings = TrackerSettings()
    display: DisplaySettings = DisplaySettings()


class Configuration(Settings):
    """Settings for a recording: the tables of a scenario file that do not describe its world."""

    radar: RadarSettings = RadarSettings()
    plots: PlotSettings = PlotSettings()
    tracker: TrackerSettings = TrackerSettings()
    display: DisplaySettings = DisplaySettings()


def load(file: Path) -> Scenario:
    """Read a scenario file.

    Raises
    ------
    InputError      the file can't be read, or is not TOML
    ScenarioError   keys or values are wrong; all of them at once
    """
    return parse(read_toml(file), file)


def shipped() -> dict[str, Path]:
    """The scenario files that come along, by name."""
    here = Path(__file__).resolve().parent
    # In a wheel they lie in the package, in a checkout beside it.
    folders = (here / "scenarios", here.parent / "scenarios")
    folder = next((f for f in folders if any(f.glob("*.toml"))), folders[0])
    return {file.stem: file for file in sorted(folder.glob("*.toml"))}


def load_configuration(file: Path) -> tuple[Configuration, frozenset[str]]:
    """Read the settings for a recording from a scenario file, or from one with just those tables.

    Returns
    -------
    The settings, and which `table.key` the file itself gives (the others are defaults).
    """
    raw = read_toml(file)
    if raw.keys() - Configuration.model_fields.keys():
        parse(raw, file)
    tables = {key: value for key, value in raw.items() if key in Configuration.model_fields}
    given = frozenset(f"{table}.{key}" for table, keys in tables.items() for key in keys)
    return _validated(Configuration, tables, file), given


def parse(raw: Mapping[str, Any], file: Path) -> Scenario:
    """Check the parsed TOML of `file`."""
    return _validated(Scenario, raw, file)


def read_toml(file: Path) -> dict[str, Any]:
    """The file as nested dicts."""
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(file, "", f"can't be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InputError(
            file, f"byte {error.start}", "not a text file in UTF-8; expected a scenario in TOML"
        ) from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(file, "", f"not valid TOML: {error}") from error


def json_schema() -> str:
    """The JSON Schema of scenario files, for completion in editors."""
    schema = Scenario.model_json_schema()
    return json.dumps({"$schema": "https://json-schema.org/draft/2020-12/schema"} | schema, indent=2) + "\n"


Model = TypeVar("Model", bound=Settings)


def _validated(model: type[Model], raw: Mapping[str, Any], file: Path) -> Model:
    try:
        return model.model_validate(_arrays_as_tuples(raw))
    except ValidationError as error:
        problems = [_problem(model, detail) for detail in error.errors(include_url=False)]
        raise ScenarioError(file, problems) from None


def _arrays_as_tuples(value: Any) -> Any:
    """TOML's arrays are lists; strict frozen settings hold tuples."""
    if isinstance(value, Mapping):
        return {key: _arrays_as_tuples(item) for key, item in value.items()}
    return tuple(_arrays_as_tuples(item) for item in value) if isinstance(value, list) else value


def _problem(model: type[Settings], detail: ErrorDetails) -> tuple[str, str]:
    """The path of the key as the user would write it, and what is wrong there."""
    path, table = "", model
    for step in detail["loc"]:
        if isinstance(step, int):
            path += f"[{step}]"
        elif step in _LEGS and detail["loc"][0] == "target":
            table = _LEGS[step]  # pydantic names the kind of leg in the path; the user does not
        else:
            path += f".{step}" if path else step
            table = table_at(table, step) or table
    if detail["type"] == "extra_forbidden":
        return path, unknown_key(str(detail["loc"][-1]), table.model_fields)
    if detail["type"] == "missing":
        return path, "missing"
    message = detail["msg"][0].lower() + detail["msg"][1:]
    found = detail["input"]
    return path, message if isinstance(found, Mapping | tuple | Settings) else f"{message}, found {found!r}"


_LEGS: dict[str, type[Settings]] = {"straight": Straight, "accelerate": Accelerate, "turn": Turn}


def unknown_key(key: str, known: Iterable[str]) -> str:
    """What is wrong with a key that is none of the known ones, with the one that was likely meant."""
    near = difflib.get_close_matches(key, known, n=1)
    return f"unknown key, did you mean {near[0]}?" if near else "unknown key"


def table_at(table: type[Settings], key: str) -> type[Settings] | None:
    """The settings class of a key that holds a table or an array of tables."""
    field = table.model_fields.get(key)
    if field is None:
        return None
    kinds = (field.annotation, *get_args(field.annotation))
    return next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Settings)), None)
