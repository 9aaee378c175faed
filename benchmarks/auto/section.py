"""The report on AUTO in Markdown."""

from __future__ import annotations

from typing import Any

from report import number, table

from auto.case import HIGHEST, KNOWN, LOWEST, TIMED, Known

HEAD = (
    "code",
    "B",
    "mesh",
    "seconds",
    "points",
    "error of the folds",
    "at the grazing",
    "ends",
    "LP / BP / PD / TR",
    "impossible",
)


def report(results: dict[str, Any]) -> str:
    """Everything that was found."""
    parts = ["# AUTO-07p on the smoothed equation, saltus on the exact one"]
    if "absent" in results:
        return "\n\n".join([*parts, f"AUTO-07p is absent: {results['absent']}."]) + "\n"
    parts += [_about(results), _reading()]
    for amplitude, known in KNOWN.items():
        exact = results["exact"][str(amplitude)]
        rows = [r for r in results["auto"] if r["amplitude"] == amplitude]
        lines = [_exact_line(row) for row in exact] + [_auto_line(row, known) for row in rows]
        parts += [f"## H = {amplitude:g}", table(HEAD, lines), _ratio(exact[0], rows)]
    parts.append("![the branches near the folds and the grazing](auto.png)")
    return "\n\n".join(parts) + "\n"


def _about(results: dict[str, Any]) -> str:
    lines = [f"* {key}: {value}" for key, value in results["about"].items()]
    return "\n".join([*lines, f"* AUTO-07p: {results['version']}"])


def _reading() -> str:
    exact = "; ".join(
        f"H = {amplitude:g}: folds at {known.folds[0]:.12f} and {known.folds[1]:.12f}"
        + (f", grazing at {known.grazing:.9f}" if known.grazing else "")
        for amplitude, known in KNOWN.items()
    )
    return (
        "The symmetric orbits of period 1 under load (i), beta0 = 80 deg, C = 0.1, V = -0.5, from"
        f" Omega = {HIGHEST:g} down to {LOWEST:g}. AUTO follows them with sgn(theta) smoothed to"
        f" tanh(B theta / 2) (`smoothing`), from the exact orbit at Omega = {HIGHEST:g}; mesh is"
        f" NTST x NCOL. Exact Omega: {exact}. Seconds are processor time on one core; those of"
        " saltus come after its code was compiled. *Impossible* are the labels that no orbit can"
        " deserve: a torus (the multipliers' product is exp(-C T) < 1), or a period doubling of a"
        " symmetric orbit. BP and PD on the asymmetric orbits onto which AUTO slips at a branch"
        " point are not counted there."
    )


def _errors(row: dict[str, Any]) -> str:
    return ", ".join(
        "not found" if error is None else f"{error:.0e}" for error in row["fold_errors"]
    )


def _labels(row: dict[str, Any]) -> str:
    return " / ".join(str(row["labels"][kind]) for kind in ("LP", "BP", "PD", "TR"))


def _exact_line(row: dict[str, Any]) -> list[str]:
    head = ["saltus", "exact", f"to {row['lowest']:g}"]
    if "fails" in row:
        return [*head, "-", "-", "-", "-", row["fails"], "-", "-"]
    grazings = ", ".join(f"{omega:.9f}" for omega, _ in row["grazings"][:2]) + (
        ", ..." if len(row["grazings"]) > 2 else ""
    )
    return [*head, number(row["seconds"]), str(row["points"]), _errors(row), grazings and f"located: {grazings}", row["end"],
            _labels(row), str(row["impossible"])]  # fmt: skip


def _auto_line(row: dict[str, Any], known: Known) -> list[str]:
    return ["AUTO-07p", f"{row['sharpness']:g}", row["mesh"], number(row["seconds"]), str(row["points"]), _errors(row),
            _grazing(row["grazing"], known), row["end"], _labels(row), str(row["impossible"])]  # fmt: skip


def _grazing(found: dict[str, Any] | None, known: Known) -> str:
    """In words, what AUTO does where the exact branch grazes."""
    if found is None or known.grazing is None:
        return ""
    if not found["arrives"]:
        return "does not get there"
    after = "passes on" if found["beyond"] else "does not pass"
    if not found["turns"]:
        return f"no fold, {after}"
    nearest, _ = min(found["turns"], key=lambda turn: abs(turn[0] - known.grazing))
    folds = "a fold" if len(found["turns"]) == 1 else f"{len(found['turns'])} folds"
    return f"{folds}, one {abs(nearest - known.grazing):.0e} away, {after}"


def _ratio(exact: dict[str, Any], rows: list[dict[str, Any]]) -> str:
    """How long each B takes for the same range, on its cheapest mesh that gets through and on
    all.
    """
    if "fails" in exact:
        return ""
    texts = []
    for sharpness in dict.fromkeys(row["sharpness"] for row in rows):
        times = [
            (row["timed"], row["mesh"])
            for row in rows
            if row["sharpness"] == sharpness and row["timed"]
        ]
        cells = ", ".join(
            f"{number(t)} s on {mesh} ({number(t / exact['seconds'])}x)"
            for t, mesh in sorted(times)
        )
        texts.append(f"* B = {sharpness:g}: {cells or 'no mesh gets there'}")
    return (
        f"From Omega = {HIGHEST:g} to {TIMED:g} saltus takes {number(exact['seconds'])} s;"
        " AUTO:\n\n" + "\n".join(texts)
    )
