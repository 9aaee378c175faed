"""`saltus simulate`: a study's motion, computed, written and summarised."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

if TYPE_CHECKING:
    from saltus.config import Study
    from saltus.flow import Motion


@dataclass(frozen=True)
class SampleSettings:
    """How densely a motion is written if the study does not say it."""

    max_samples: int = 1_000_000  # With more samples other programs could not read motion.nc at once.
    per_period: int = 200  # Number of samples in a forcing period if the study gives none.
    max_dense_periods: int = 20_000  # The dense output of a longer motion takes more memory than a laptop has.


SETTINGS = SampleSettings()


def simulate_study(path: Path, output: Path | None, plot: bool) -> None:
    """Run the study at `path`, write its motion into `output`, and print a summary.

    Raises
    ------
    SaltusError
        A bad study, a folder that cannot be written to (before anything is computed), a motion that cannot go on.
    """
    from saltus.cli.drawn_progress import progress_bar
    from saltus.cli.motion_summary import print_summary
    from saltus.config import load_study
    from saltus.files import check_writable

    study = load_study(path)
    study.settings()
    output = Path("results") / study.name if output is None else output
    check_writable(output)
    with progress_bar(f"motion of {path}") as progress:
        motion = study.run(progress=progress, times=long_samples(study))
        progress(1.0, "writing")
        files = write_motion(motion, study, output, plot)
    console = Console(highlight=False)
    print_summary(motion, console)
    console.print(f"Results are in {output}: {', '.join(file.name for file in files)}", markup=False, soft_wrap=True)


def write_motion(motion: Motion, study: Study, output: Path, plot: bool) -> list[Path]:
    """Write motion.nc and, with `plot`, motion.png and motion.pdf, each complete or not at all; their paths."""
    from saltus.files import write_dataset, write_figure

    dataset = motion.to_xarray(sample_times(motion, study.settings().samples))
    dataset.attrs["study"] = study.source.path.name
    files = [write_dataset(output / "motion.nc", dataset)]
    if plot:
        from saltus.plots import draw_motion, figure_of, style

        figure = figure_of(draw_motion(dataset))
        with style():
            files += write_figure(output / "motion", figure)
    return files


def long_samples(study: Study) -> Any:
    """The times at which states are kept if a motion is too long for dense output; None if it is not."""
    import numpy as np

    given, period = study.settings().arguments, study.system.load.period
    span = given["periods"] * (period or 1.0) if "periods" in given else given["duration"]
    if span / (period or 2 * np.pi) <= SETTINGS.max_dense_periods:
        return None
    start = given.get("time", 0.0)
    return np.linspace(start, start + span, study.settings().samples or SETTINGS.max_samples)


def sample_times(motion: Motion, samples: int | None) -> Any:
    """Evenly spaced times over a motion, or None if the motion's own times are not too many."""
    import numpy as np

    period = motion.system.load.period
    short = period is None or SETTINGS.per_period * (motion.time - motion.start) / period <= SETTINGS.max_samples
    if motion.kept is not None or (samples is None and short):
        return None
    return np.linspace(motion.start, motion.time, SETTINGS.max_samples if samples is None else samples)
