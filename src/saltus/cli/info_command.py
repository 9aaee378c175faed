"""`saltus info`: what is known of a system before it moves."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from saltus.cli.fact_blocks import block_table
from saltus.cli.facts import describe

LEAST_START = 1e-6  # rad; smaller angles at the start count as none


def print_info(path: Path) -> None:
    """Print what is known of the system in the study at `path`.

    Raises
    ------
    SaltusError
        A bad study, or a model that cannot be traced, so that no motion of it could be computed.
    """
    from saltus.config import Ask, load_study
    from saltus.taylor import trace

    study = load_study(path, questions=False)
    study.answer(Ask(kind="model", options={}), trace)
    console = Console(highlight=False)
    console.print(f"[bold]{type(study.system.model).__name__}[/] ", end="")
    console.print(f"from {path}", markup=False, soft_wrap=True)
    theta = study.simulate.arguments.get("theta", 0.0) if study.simulate else 0.0
    start = theta if abs(theta) >= LEAST_START else None
    for block in describe(study.system, start):
        console.print()
        console.print(block.title, style="bold", markup=False)
        console.print(block_table(block))
