"""Table 1: the impact scenarios, with conditions in the velocities and one computed example of each (erratum 16)."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.paper.claims.claim import Claim, check
from saltus.paper.figures.figure import PaperFigure
from saltus.paper.provenance import dataset, tree

OPEN = -0.3  # rad, theta_2 of the examples with both layers deformed
EXAMPLES: tuple[tuple[float, tuple[float, float], float], ...] = (
    (0.0, (-0.5, 0.0), 0.0),  # theta_2, velocities before, theta_1' after: row 1
    (0.0, (-0.5, 0.0), 0.3),
    (0.0, (-0.5, 0.0), 0.1),
    (OPEN, (-0.5, 0.2), 0.0),
    (OPEN, (-0.5, 0.2), 0.3),
)


def compute(beta0: float = 80.0) -> Any:
    """The rows, an example state after each kind of impact on the lower layer, and its name; `beta0` in degrees."""
    from saltus.systems import TwoLayer, table_1

    model = TwoLayer(beta0=np.deg2rad(beta0))
    rows = table_1()
    examples = [_example(model, *example, row=i) for i, example in enumerate(EXAMPLES)]
    columns: dict[str, list[Any]] = {
        "deformed_before": [row.deformed_before for row in rows],
        "before": [row.before for row in rows],
        "deformed_after": [row.deformed_after for row in rows],
        "after": [row.after for row in rows],
        "scenario": [row.scenario.value for row in rows],
        **{name: [example[name] for example in examples] for name in examples[0]},
    }
    data = dataset({name: ("row", np.array(values)) for name, values in columns.items()}, what="impact scenarios")
    return tree(
        {"rows": data, "angles": _refusal(model)},
        what="Table 1 with examples at beta0 = 80 deg, m = 0, s = 1",
        beta0_degrees=beta0,
    )


def _example(model: Any, theta_2: float, before: tuple[float, float], after_1: float, row: int) -> dict[str, Any]:
    """An impact on the lower layer whose velocity becomes `after_1`; the other velocity follows from its momentum balance."""
    from saltus.systems import LayerState, name_impact, other_impulse

    theta = (0.0, theta_2)
    matrix = model.mass_matrix(theta)
    free = before[1] - matrix[1][0] / matrix[1][1] * (after_1 - before[0])
    after_2 = 0.0 if row == 1 else float(free)  # row 2, bouncing: the other layer's contact holds it
    first, second = LayerState(theta, before), LayerState(theta, (after_1, after_2))
    named = name_impact(first, second, model=model)
    held = LayerState(theta, (after_1, before[1]))
    return {
        "velocity_before_1": before[0],
        "velocity_before_2": before[1],
        "velocity_after_1": after_1,
        "velocity_after_2": after_2,
        "named": named.scenario.value,
        "named_before": named.deformed_before,
        "named_after": named.deformed_after,
        "impulse": other_impulse(model, first, second, 1),
        "impulse_if_unchanged": other_impulse(model, first, held, 1),
    }


def _refusal(model: Any) -> Any:
    """Whether an impact across which an angle jumps, as Table 1 prints it, is refused."""
    from saltus.errors import ParameterError
    from saltus.systems import LayerState, name_impact

    try:
        name_impact(LayerState((0.0, OPEN), (-0.5, 0.2)), LayerState((0.0, OPEN / 2), (0.0, 0.2)), model=model)
    except ParameterError as error:
        return dataset({"refused": ((), True)}, what=str(error))
    return dataset({"refused": ((), False)}, what="a jump of an angle was accepted")


def table(data: Any) -> str:
    """Table 1 in Markdown."""
    rows = data["rows"]
    lines = [
        "# Table 1: impact scenarios",
        "",
        "s is the impacting layer, j the other one; angles are continuous, so that the cases differ in velocities (erratum 16). "
        "The example is an impact on the lower layer at β₀ = 80°, m = 0.",
        "",
        "| deformed before | before | deformed after | after | scenario | example: (θ₁', θ₂') before → after |",
        "|---|---|---|---|---|---|",
    ]
    for i in range(rows.sizes["row"]):
        row = {name: rows[name].values[i] for name in rows.data_vars}
        example = (
            f"({row['velocity_before_1']:.3g}, {row['velocity_before_2']:.3g}) → "
            f"({row['velocity_after_1']:.3g}, {row['velocity_after_2']:.3g})"
        )
        cells = [
            row["deformed_before"],
            _pretty(row["before"]),
            row["deformed_after"],
            _pretty(row["after"]),
            row["scenario"],
            example,
        ]
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines) + "\n"


def _pretty(text: Any) -> str:
    names = {"theta_s": "θₛ", "theta_j": "θⱼ", "M_sj": "Mₛⱼ", "M_jj": "Mⱼⱼ", "!=": "≠", "(+)": "⁺", "(-)": "⁻"}
    out = str(text)
    for name, pretty in names.items():
        out = out.replace(name, pretty)
    return out


def claims(data: Any) -> list[Claim]:
    """The table's scenarios, and erratum 16."""
    rows = data["rows"]
    same = all((rows[a].values == rows[b].values).all() for a, b in (("named", "scenario"), ("named_after", "deformed_after")))
    last = {name: float(rows[name][-1]) for name in ("impulse", "impulse_if_unchanged", "velocity_before_2", "velocity_after_2")}
    return [
        check(
            "table1-scenarios",
            "Table 1",
            "An impact leads to no bouncing, bouncing or partial bouncing, by the number of deformed layers before and after",
            printed=bool(same),
            evidence=f"{rows.sizes['row']} computed states are named {rows['named'].values.tolist()}",
        ),
        check(
            "table1-angles",
            "Table 1",
            "The angle |θⱼ| after an impact differs from θ*, the one before",
            printed=not bool(data["angles"]["refused"]),
            corrected=bool(data["angles"]["refused"]),
            erratum=16,
            evidence=f"`controtrot` makes angles continuous: {data['angles'].attrs['what']}",
        ),
        check(
            "table1-other-layer",
            "impact_condition2, Table 1",
            "Bouncing leaves the velocity of the other, open layer unchanged",
            printed=last["impulse_if_unchanged"],
            corrected=last["impulse"],
            erratum=16,
            tolerance=1e-12,
            evidence=f"M₁₂ ≠ 0: an unchanged θ₂' needs an impulse of {last['impulse_if_unchanged']:.4f} on the "
            "layer that is not hit; its "
            f"balance takes θ₂' from {last['velocity_before_2']:.4f} to {last['velocity_after_2']:.4f}",
        ),
    ]


FIGURE = PaperFigure(
    name="table1",
    title="Table 1: impact scenarios",
    caption="Impact scenarios when the s-th layer impacts, as corrected by erratum 16, with a computed example of each row.",
    compute=compute,
    claims=claims,
    table=table,
)
