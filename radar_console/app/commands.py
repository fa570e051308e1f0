"""The command line."""

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from radar_console.core.errors import RadarConsoleError


class _ConsoleByDefault(TyperGroup):
    """`radar-console SOURCE` is `radar-console console SOURCE`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        first = args[0] if args else ""
        if first not in self.commands and first not in ("--help", "--version"):
            args = ["console", *args]
        return super().parse_args(ctx, args)


app = typer.Typer(
    cls=_ConsoleByDefault,
    add_completion=False,
    rich_markup_mode="rich",
    no_args_is_help=False,
    pretty_exceptions_enable=False,
    epilog="Examples:  radar-console  ·  radar-console scenarios/harbour.toml  ·  "
    "radar-console flight.pcap --speed 20  ·  radar-console track flight.pcap -o tracks.csv",
)

SourceArgument = Annotated[
    str,
    typer.Argument(
        metavar="SOURCE",
        help="Scenario (.toml, or the name of one that comes along), ASTERIX recording (.pcap, .ast) "
        "or plot table (.csv).",
        show_default=False,
    ),
]
ConfigOption = Annotated[
    Path | None,
    typer.Option(
        metavar="SCENARIO",
        help="Scenario file whose tables radar, plots, tracker and display apply to a recording.",
    ),
]
SeedOption = Annotated[int | None, typer.Option(min=0, help="Instead of the scenario's seed.")]
RadarOption = Annotated[
    str | None,
    typer.Option("--radar", metavar="SAC/SIC", help="Which radar, such as 226/232."),
]


def _sac_sic(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    parts = text.split("/")
    if len(parts) != 2 or not all(part.isdigit() and int(part) < 256 for part in parts):
        raise RadarConsoleError(f"--radar {text}: expected two numbers from 0 to 255, such as 226/232")
    return int(parts[0]), int(parts[1])


def _all_different(*files: str | Path | None) -> None:
    """No file may be read and written, or written twice, by one command."""
    paths = [Path(file).resolve() for file in files if file is not None]
    for k, path in enumerate(paths):
        if path in paths[:k]:
            raise RadarConsoleError(f"{path.name}: named twice; expected another file for each purpose")


@contextmanager
def _interruptible(left: str) -> Iterator[None]:
    """Ctrl+C ends with a sentence that says what is left of the work, and exit code 130."""
    try:
        yield
    except KeyboardInterrupt:
        typer.echo(f"\nradar-console: interrupted; {left}", err=True)
        raise typer.Exit(130) from None


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"radar-console {version('radar-console')}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """A radar tracking console: from antenna to screen, on simulated and on recorded radar.

    Without a command it opens the console: [bold]radar-console [SOURCE][/bold].
    """


@app.command(
    epilog="Examples:  radar-console  ·  radar-console harbour  ·  radar-console flight.pcap --speed 20  ·  "
    "radar-console twenty-five --screenshot picture.png --after 120"
)
def console(
    source: Annotated[
        str | None,
        typer.Argument(
            metavar="[SOURCE]",
            help="Scenario (.toml, or the name of one that comes along), ASTERIX recording (.pcap, .ast) "
            "or plot table (.csv). Without it: the demo.",
            show_default=False,
        ),
    ] = None,
    config: ConfigOption = None,
    seed: SeedOption = None,
    radar: RadarOption = None,
    speed: Annotated[float, typer.Option(min=0.1, max=1000, help="Times real time.")] = 1.0,
    user_map: Annotated[
        Path | None, typer.Option("--map", metavar="FILE.geojson", help="Your own map on top of the coast.")
    ] = None,
    screenshot: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="Render off-screen, write the picture and end.")
    ] = None,
    after: Annotated[
        float | None,
        typer.Option(min=0, metavar="SECONDS", help="Data time of the picture (default: the end)."),
    ] = None,
    size: Annotated[str, typer.Option(metavar="WIDTHxHEIGHT", help="Size of the picture.")] = "1680x1000",
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Say how long the start took.")] = False,
) -> None:
    """Open the console on a source."""
    from radar_console.app import console as live
    from radar_console.app.opening import open_source

    logging.basicConfig(level=logging.INFO if verbose else logging.WARNING, format="%(message)s")
    opened = open_source(source, config, seed, _sac_sic(radar))
    if screenshot is not None:
        with _interruptible("no picture was written"):
            live.screenshot(opened, screenshot, after, _size(size), user_map, speed)
    elif live.display_missing():
        file = Path("radar-console.png")
        typer.echo(
            "No display here (neither DISPLAY nor WAYLAND_DISPLAY is set): "
            "running without a window, as fast as it can.",
            err=True,
        )
        with _interruptible("no picture was written"):
            live.screenshot(opened, file, after, _size(size), user_map, speed)
        typer.echo(f"The picture of the console is in {file.resolve()}")
    else:
        raise typer.Exit(live.run(opened, speed, user_map))


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    if not (
        width.isdigit() and height.isdigit() and 200 <= int(width) <= 8000 and 200 <= int(height) <= 8000
    ):
        raise RadarConsoleError(
            f"--size {text}: expected WIDTHxHEIGHT in pixels, 200 to 8000, such as 1680x1000"
        )
    return int(width), int(height)


@app.command(
    epilog="Examples:  radar-console track twenty-five -o tracks.csv  ·  "
    "radar-console track flight.pcap -o tracks.csv --stats stats.json --config site.toml"
)
def track(
    source: SourceArgument,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="tracks.csv", help="Where the tracks go.")
    ],
    config: ConfigOption = None,
    stats: Annotated[Path | None, typer.Option(metavar="stats.json", help="Figures of the run.")] = None,
    seed: SeedOption = None,
    radar: RadarOption = None,
    threaded: Annotated[
        bool, typer.Option("--threaded", help="Each stage in a thread of its own; the same tracks.")
    ] = False,
) -> None:
    """Track a source without a window, as fast as it can be read."""
    from radar_console.app import headless
    from radar_console.app.opening import open_source

    opened = open_source(source, config, seed, _sac_sic(radar))
    _all_different(source, output, stats)
    with _interruptible(f"what was tracked until then is in {output}"):
        figures = headless.track(opened, output, stats, threaded)
    _report(figures, output)


def _report(figures: dict[str, Any], output: Path) -> None:
    skipped = sum(figures["skipped"].values())
    typer.echo(
        f"{figures['scans']} scans, {figures['plots']:,} plots, {figures['centroids']:,} centroids, "
        f"{figures['tracks_confirmed']} tracks confirmed, {skipped:,} skipped, "
        f"{figures['wall_s']:.1f} s → {output}",
        err=True,
    )
    for reason, count in sorted(figures["skipped"].items()):
        typer.echo(f"  skipped {count:,}: {reason}", err=True)
    for what, count in sorted(figures["noted"].items()):
        typer.echo(f"  noted {count:,}: {what}", err=True)


@app.command(
    epilog="Examples:  radar-console simulate twenty-five -o plots.csv  ·  "
    "radar-console simulate harbour -o plots.csv --truth truth.csv --seed 7"
)
def simulate(
    scenario: Annotated[str, typer.Argument(metavar="SCENARIO", help="Scenario file, or the name of one.")],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE.csv", help="Where the plots go.")],
    truth: Annotated[
        Path | None, typer.Option(metavar="truth.csv", help="Where the targets are, once a second.")
    ] = None,
    seed: SeedOption = None,
) -> None:
    """Write the plots that the radar of a scenario sees."""
    from radar_console.app import headless
    from radar_console.app.opening import open_source

    opened = open_source(scenario, seed=seed)
    if opened.truth is None:
        raise RadarConsoleError(f"{scenario}: is a {opened.kind}; expected a scenario (.toml)")
    _all_different(scenario, output, truth)
    with _interruptible(f"what was simulated until then is in {output}"):
        plots, rows = headless.simulate(opened, output, truth)
    typer.echo(
        f"{plots:,} plots → {output}" + (f", {rows:,} truth rows → {truth}" if truth else ""), err=True
    )


@app.command(
    epilog="Examples:  radar-console evaluate twenty-five --runs 100  ·  "
    "radar-console evaluate twenty-five --set tracker.filter=kalman,particle --set clutter.disc.mean=1,5  ·  "
    "radar-console evaluate harbour --dask tcp://10.0.0.7:8786  ·  "
    "radar-console evaluate --tracks tracks.csv --truth truth.csv"
)
def evaluate(
    scenario: Annotated[
        str | None, typer.Argument(metavar="[SCENARIO]", help="Scenario file, or the name of one.")
    ] = None,
    runs: Annotated[int, typer.Option(min=1, help="Runs, with one seed after the other.")] = 200,
    options: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE,VALUE",
            help="A key of the scenario, and what it is to be; several make a grid. Every setting runs with "
            "the same seeds.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="DIR",
            help="Where results.csv and report.html go (default: SCENARIO-evaluation); what is there is gone "
            "on with. With --tracks: file for the figures.",
        ),
    ] = None,
    dask: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Scheduler of a Dask cluster that does the runs.")
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Processes here (default: one for each processor).")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Of the first run (default: the scenario's).")
    ] = None,
    rerun: Annotated[
        list[str] | None, typer.Option(metavar="SEED", help="Run these seeds again, and no others.")
    ] = None,
    tracks: Annotated[
        Path | None, typer.Option(metavar="tracks.csv", help="Score these tracks in place of a scenario's.")
    ] = None,
    truth: Annotated[
        Path | None, typer.Option(metavar="truth.csv", help="Where the targets were, for --tracks.")
    ] = None,
    cut_off_m: Annotated[float, typer.Option(min=1e-3, help="Cut-off distance of GOSPA and OSPA.")] = 5000.0,
    gate_m: Annotated[
        float, typer.Option(min=1e-3, help="How far a track may be from the target that it holds.")
    ] = 2000.0,
    tail_s: Annotated[
        float, typer.Option(min=0, help="A target that no track holds in its last seconds is lost.")
    ] = 40.0,
) -> None:
    """Run a scenario many times, under one setting or several, and say how good the tracks are."""
    from radar_console.app import evaluating
    from radar_console.evaluation.scoring import Scoring

    scoring = Scoring(cut_off_m, gate_m, tail_s)
    if (tracks is None) != (truth is None) or (scenario is None) == (tracks is None):
        raise RadarConsoleError("evaluate: expected a SCENARIO, or --tracks and --truth")
    if tracks is not None and truth is not None:
        if options or dask or rerun:
            raise RadarConsoleError(
                "evaluate: --set, --dask and --rerun go with a SCENARIO, not with --tracks"
            )
        figures = evaluating.score_files(tracks, truth, scoring)
        if output is not None:
            evaluating.write_scores(figures, output)
        evaluating.print_scores(figures)
        return
    again = evaluating.seeds_of(rerun or [])
    evaluation = evaluating.Evaluation(scenario or "", options or [], output, scoring)
    left = f"the runs done are in {evaluation.folder}, and the same command goes on from there"
    with _interruptible(left):
        progress = evaluation.carry_out(runs, seed, again, evaluating.workers_of(dask, jobs))
    typer.echo(f"{progress.done:,} runs → {evaluation.folder / 'report.html'}", err=True)
    failed = evaluation.failed
    if failed:
        typer.echo(f"radar-console: {failed}", err=True)
        raise typer.Exit(1)


@app.command(epilog="Examples:  radar-console info flight.pcap  ·  radar-console info harbour")
def info(source: SourceArgument, config: ConfigOption = None, radar: RadarOption = None) -> None:
    """Say what a source holds."""
    from radar_console.app.opening import open_source

    opened = open_source(source, config, None, _sac_sic(radar))
    facts = opened.source.facts()
    width = max(len(label) for label, _ in facts)
    for label, value in facts:
        typer.echo(f"{label:<{width}}  {value}")


@app.command(epilog="Example:  radar-console scenarios")
def scenarios() -> None:
    """List the scenarios that come along; open one by its name."""
    from radar_console import scenario
    from radar_console.app import opening

    known = opening.scenarios()
    width = max(map(len, known), default=0)
    for name, file in known.items():
        typer.echo(f"{name:<{width}}  {scenario.load(file).title}")


@app.command(epilog="Example:  radar-console schema > scenario.schema.json")
def schema() -> None:
    """Print the JSON Schema of scenario files, for completion in an editor."""
    from radar_console import scenario

    typer.echo(scenario.json_schema(), nl=False)


@app.command(
    epilog="Examples:  radar-console study --list  ·  radar-console study filter-rmse --runs 20  ·  "
    "radar-console study resampling --jobs 2 -o resampling"
)
def study(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="Which one; --list names them.", show_default=False)
    ] = None,
    listing: Annotated[bool, typer.Option("--list", help="List the studies.")] = False,
    runs: Annotated[
        int | None, typer.Option(min=2, metavar="N", help="Runs of each case (default: the study's own).")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Of everything that is drawn.")] = 1,
    jobs: Annotated[
        int | None,
        typer.Option(min=1, metavar="N", help="Processes (default: one a core). The results are the same."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Where its files go (default: out/NAME)."),
    ] = None,
) -> None:
    """Repeat a published experiment: published beside ours, with intervals and figures.

    Finished parts are kept in DIR: after an interruption the same command goes on from there.
    """
    from radar_console.app import studying

    if listing:
        known = studying.listed()
        width = max(len(each) for each, _ in known)
        for each, title in known:
            typer.echo(f"{each:<{width}}  {title}")
        return
    if name is None:
        raise RadarConsoleError("study: which one? Expected a name; `radar-console study --list` has them")
    with _interruptible(
        f"finished parts are in {studying.folder_of(name, output)}; the same command goes on from there"
    ):
        folder = studying.study(name, runs, seed, jobs, output)
    typer.echo(f"Table, figures and results.json are in {folder}", err=True)


@app.command("warm-up", hidden=True)
def warm_up() -> None:
    """Compile what is compiled, so that the first start is quick."""
    from radar_console.app.warming import warm_up as warm

    warm()


def main() -> None:
    """Run the command line; exit code 2 for what the user can mend, 130 when interrupted."""
    try:
        app()
    except RadarConsoleError as error:
        typer.echo(f"radar-console: {error}", err=True)
        sys.exit(2)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
