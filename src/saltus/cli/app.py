"""The commands and their help; the work is in the module of each command, imported when it runs.

Other packages add commands: each is an entry point of the group `saltus.commands`, a function with
typer's annotations.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Callable
from functools import wraps
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Annotated, Any

import typer

from saltus.cli.guard import guarded
from saltus.errors import SaltusError

GROUP = "saltus.commands"
# commands of packages that saltus does not need
ELSEWHERE = {"reproduce": "saltus-paper", "report": "saltus-paper"}


def add_commands(app: typer.Typer) -> None:
    """Add every command that an installed package gives, and for one that is known and not
    installed, how to get it.
    """
    given = {entry.name: entry for entry in entry_points(group=GROUP)}
    for name, entry in sorted(given.items()):
        _add(app, name, entry)
    for name in ELSEWHERE.keys() - given.keys():
        package = ELSEWHERE[name]
        sentence = (
            f"`saltus {name}` comes with the package {package}; in a checkout of saltus, "
            "`make reproduce` installs it"
        )
        _add_refusal(app, name, sentence)


def _add(app: typer.Typer, name: str, entry: EntryPoint) -> None:
    try:
        work = entry.load()
    except Exception as error:  # whatever another package does, the other commands go on
        package = entry.dist.name if entry.dist else entry.value
        _add_refusal(
            app,
            name,
            f"`saltus {name}` cannot be loaded from {package} ({type(error).__name__}: {error})",
        )
    else:
        app.command(name)(_in_guard(work))


def _in_guard(work: Callable[..., Any]) -> Callable[..., None]:
    @wraps(work)
    def command(*given: Any, **named: Any) -> None:
        with guarded():
            work(*given, **named)

    return command


def _add_refusal(app: typer.Typer, name: str, sentence: str) -> None:
    """A command that takes any arguments, and says why it cannot run."""

    def refuse() -> None:
        with guarded():
            raise SaltusError(sentence)

    any_arguments = {"allow_extra_args": True, "ignore_unknown_options": True}
    app.command(name, help=f"{sentence[0].upper()}{sentence[1:]}.", context_settings=any_arguments)(
        refuse
    )


app = typer.Typer(
    rich_markup_mode="rich",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

STUDY = """A study is a TOML file; ten lines suffice:

[cyan]\\[model][/]
[cyan]type = "Metainterface"[/]
[cyan]beta0 = "80 deg"[/]
[cyan]damping = 0.1[/]
[cyan]\\[load][/]
[cyan]frequency = 1.0[/]
[cyan]horizontal = { amplitude = 0.5 }[/]
[cyan]vertical = -0.5[/]
[cyan]\\[simulate][/]
[cyan]theta = 0.3[/]
[cyan]periods = 20[/]"""

Study = Annotated[
    Path,
    typer.Argument(
        metavar="STUDY.TOML",
        help="The study: a model, its loads, its impact law, and how to simulate it.",
    ),
]

Output = Annotated[
    Path | None,
    typer.Option(
        "--output", "-o", help="The folder to write to.", show_default="results/<name of the study>"
    ),
]


def _version(wanted: bool) -> None:
    if wanted:
        from saltus import __version__

        print(f"saltus {__version__}")
        raise typer.Exit


@app.callback(epilog=STUDY)
def saltus(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_version, is_eager=True, help="Print the version and stop."
        ),
    ] = False,
) -> None:
    """Exact dynamics of systems with impacts, friction and stops.

    First steps:

    [cyan]saltus reproduce[/]             the paper's figures, tables and claims
    [cyan]saltus simulate study.toml[/]   the motion of a system of your own
    [cyan]saltus run study.toml[/]        its spectra, diagrams, basins and charts
    [cyan]saltus info study.toml[/]       what is known of it in closed form
    """


@app.command(epilog=STUDY)
def simulate(
    study: Study,
    output: Output = None,
    plot: Annotated[
        bool, typer.Option(help="Draw the time history and the phase portrait.")
    ] = True,
) -> None:
    """Compute a motion, exactly from impact to impact; write it and draw it.

    Writes motion.nc (netCDF, with units and provenance), motion.png and
    motion.pdf, and prints a summary: the state at the end, the impacts, why
    the motion ended, and whether the mechanism could follow it. A model of
    your own is Python code, and is run.

    Example: [cyan]saltus simulate study.toml --output runs/first[/]
    """
    with guarded():
        from saltus.cli.run_command import simulate_study

        simulate_study(study, output, plot)


@app.command()
def run(
    study: Study,
    output: Output = None,
    plot: Annotated[bool, typer.Option(help="Draw what is computed.")] = True,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="A Dask scheduler, such as tcp://host:8786, for diagrams, charts and basins.",
        ),
    ] = None,
    fresh: Annotated[
        bool,
        typer.Option(
            "--fresh",
            help=(
                "Begin anew where a diagram, chart or basins of another study, model or version "
                "are."
            ),
        ),
    ] = False,
) -> None:
    r"""Answer all that a study asks: a motion, a diagram, a chart, basins, ...

    The study's tables say what: \[simulate], \[phase_portrait],
    \[response_spectrum], \[bifurcation_diagram], \[attractors], \[basins],
    \[stability_chart], \[prove]. All is checked before anything is computed. Diagrams,
    charts and basins that were stopped go on where they were. A model of your own is
    Python code, and is run.

    Example: [cyan]saltus run study.toml --output runs/first[/]
    """
    with guarded():
        from saltus.cli.run_command import run_study

        run_study(study, output, plot, scheduler, fresh)


@app.command()
def prove(
    study: Study,
    output: Output = None,
    plot: Annotated[bool, typer.Option(help="Draw the orbit or the branch.")] = True,
) -> None:
    """Prove that a study's orbit, or its branch, exists: theorems by interval arithmetic.

    The study's \\[prove] says from where a motion settles on the orbit, and, with
    path and bounds, along which branch. Writes prove.nc and its picture, and
    prints the theorems, all numbers rounded outward. A model of your own is
    Python code, and is run.

    Example: [cyan]saltus prove study.toml[/]
    """
    with guarded():
        from saltus.cli.run_command import prove_study

        prove_study(study, output, plot)


@app.command()
def page(
    study: Study,
    results: Annotated[
        list[Path] | None,
        typer.Option(
            "--with",
            metavar="STORE",
            help="A result of the study to lay over the page; repeatable.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="The file to write.", show_default="<name of the study>.html"
        ),
    ] = None,
) -> None:
    """Make a page that computes: the exact motion in a browser, as one file.

    The page needs no server, no network and no Python: sliders change every
    number of the system, and the motion with them. The first page takes some
    twenty seconds of compiling. A model of your own is Python code, and is run.

    Example: [cyan]saltus page study.toml --with results/study/basins.nc[/]
    """
    with guarded():
        from saltus.cli.run_command import write_page

        write_page(study, results or [], output)


@app.command()
def explore(
    study: Study,
    results: Annotated[
        list[Path] | None,
        typer.Option(
            "--with",
            metavar="STORE",
            help="A result of the study to lay over the page; repeatable.",
        ),
    ] = None,
) -> None:
    """Make the page of a study that computes, and open it in the browser.

    It is the page that `saltus page` makes, in results/<name of the study>.
    Drag a slider, click into the phase plane or on a branch, and the exact
    motion follows. A model of your own is Python code, and is run.

    Example: [cyan]saltus explore study.toml --with results/study/basins.nc[/]
    """
    with guarded():
        from saltus.cli.run_command import write_page

        write_page(study, results or [], None, show=True)


@app.command()
def plot(
    store: Annotated[
        Path,
        typer.Argument(metavar="STORE", help="A .nc file or .zarr folder that saltus has written."),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="The folder to write to.", show_default="beside it"),
    ] = None,
) -> None:
    """Draw a result of `saltus run` or `saltus simulate` again.

    Writes a PNG and a PDF file. Of basins, plot basins.nc. It reads files and
    runs nothing that stands in them.

    Example: [cyan]saltus plot results/study/stability_chart.zarr[/]
    """
    with guarded():
        from saltus.cli.run_command import plot_store

        plot_store(store, output)


@app.command()
def status(
    store: Annotated[
        Path,
        typer.Argument(
            metavar="STORE", help="The .zarr folder of a sweep; with --verify any result."
        ),
    ],
    verify: Annotated[
        bool,
        typer.Option(
            "--verify",
            help="Compare every file with its checksum: of a .zarr, a .nc, or a folder of results.",
        ),
    ] = False,
) -> None:
    """Say how far a sweep is: running, stopped or complete, and what has failed.

    It reads files and runs nothing.

    Example: [cyan]saltus status results/study/stability_chart.zarr[/]

    Example: [cyan]saltus status --verify results[/]
    """
    with guarded():
        from saltus.cli.summaries import print_status

        print_status(store, verify)


@app.command()
def info(study: Study) -> None:
    """Print what is known of a system before it moves.

    Its equilibria and their stability, its natural frequencies and periods,
    the critical loads, the limits of the mechanism, and whether it is
    symmetric. The study needs no \\[simulate] for it. A model of your own is
    Python code, and is run.

    Example: [cyan]saltus info study.toml[/]
    """
    with guarded():
        from saltus.cli.info_command import print_info

        print_info(study)


@app.command()
def doctor(
    compile_all: Annotated[
        bool,
        typer.Option("--compile", help="First compile all kernels, so that no later call has to."),
    ] = False,
) -> None:
    """Say what saltus runs on, and whether it computes what it should there.

    The machine and the width of its vectors, the folder of compiled code, the
    versions of all packages beside those allowed; then a motion whose closed
    form is known, alone and in lanes. To be sent along with a question.

    Example: [cyan]saltus doctor --compile[/]
    """
    with guarded():
        from saltus.cli.doctor_command import print_doctor

        print_doctor(compile_all)


add_commands(app)

# What numpy's libraries of linear algebra read when they are loaded. The matrices of saltus have
# some ten rows and its processes use all cores: further threads only wait for one another, which
# took up to a third of the processor time of following orbits.
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def begin() -> None:
    """Run the command that stands in `sys.argv`; what a terminal's encoding lacks is written as an
    escape.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    app()
