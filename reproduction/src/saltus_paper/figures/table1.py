"""Table 1: the impact scenarios, with conditions in the velocities and one computed example of each
(erratum 16).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus import ParameterError, TwoLayer
from saltus.systems import LayerState, name_impact, other_impulse, table_1
from saltus_paper.claims.claim import Measured, measured, with_fields
from saltus_paper.figure_data import dataset, tree
from saltus_paper.figures.figure import paper_figure

# Table 1 as it is printed: deformed layers before, those after, and the scenario.
PRINTED = (
    (1, 1, "no bouncing"),
    (1, 1, "bouncing"),
    (1, 2, "partial bouncing"),
    (2, 1, "no bouncing"),
    (2, 2, "bouncing"),
)
OPEN = -0.3  # rad, theta_2 of the examples with both layers deformed
EXAMPLES: tuple[tuple[float, tuple[float, float], float], ...] = (
    (0.0, (-0.5, 0.0), 0.0),  # theta_2, velocities before, theta_1' after: row 1
    (0.0, (-0.5, 0.0), 0.3),
    (0.0, (-0.5, 0.0), 0.1),
    (OPEN, (-0.5, 0.2), 0.0),
    (OPEN, (-0.5, 0.2), 0.3),
)


def compute(beta0: float = 80.0) -> Any:
    """The rows, an example state after each kind of impact on the lower layer, and its name;
    `beta0` in degrees.
    """
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
    data = dataset(
        {name: ("row", np.array(values)) for name, values in columns.items()},
        what="impact scenarios",
    )
    return tree(
        {
            "rows": data,
            "angles": _refusal(model),
            "random": _random_impacts(model, np.random.default_rng(11)),
        },
        what="Table 1 with examples at beta0 = 80 deg, m = 0, s = 1",
        beta0_degrees=beta0,
    )


def _example(
    model: Any, theta_2: float, before: tuple[float, float], after_1: float, row: int
) -> dict[str, Any]:
    """An impact on the lower layer whose velocity becomes `after_1`; the other velocity follows
    from its momentum balance.
    """
    theta = (0.0, theta_2)
    matrix = model.mass_matrix(theta)
    free = before[1] - matrix[1][0] / matrix[1][1] * (after_1 - before[0])
    # row 2, bouncing: the other layer's contact holds it
    after_2 = 0.0 if row == 1 else float(free)
    first = LayerState(theta, before)
    second = LayerState(theta, (after_1, after_2))
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


def _random_impacts(model: Any, rng: np.random.Generator, impacts: int = 300) -> Any:
    """How many random impacts on either layer get another name than by `impact_condition1` to
    `impact_condition3`.

    The conditions are those of the text, on the velocities of the hit and of the other layer; which
    layers are deformed afterwards follows from a short motion with the velocities after the impact.
    """
    wrong = 0
    kinds = set()
    for _ in range(impacts):
        s = int(rng.integers(2))
        # layer 1 opens to positive angles, layer 2 to negative ones
        j = 1 - s
        sign = (1.0, -1.0)[s]
        other_open, stops, holds = rng.random(3) < 0.5
        theta = np.zeros(2)
        before = np.zeros(2)
        after = np.zeros(2)
        theta[j], before[j] = (sign * OPEN, float(rng.normal())) if other_open else (0.0, 0.0)
        before[s] = -sign * rng.uniform(0.1, 1)
        after[s] = 0.0 if stops else sign * rng.uniform(0.1, 1)
        row = model.mass_matrix(tuple(theta))[j]
        after[j] = before[j] - row[s] / row[j] * (after[s] - before[s])
        if not other_open:
            after[j] = 0.0 if holds and not stops else -sign * abs(after[j])
        soon = theta + 1e-6 * after
        turned = "bouncing" if other_open or after[j] == before[j] else "partial bouncing"
        said = "no bouncing" if after[s] == 0.0 else turned
        expected = (1 + int(other_open), int((abs(soon) > 0).sum()), said)
        named = name_impact(_state(theta, before), _state(theta, after), model=model)
        kinds.add(expected)
        wrong += (
            named.deformed_before,
            named.deformed_after,
            named.scenario.value,
        ) != expected or named.layer != s + 1
    return dataset(
        {
            "wrong": ((), wrong),
            "impacts": ((), impacts),
            "printed_kinds": ((), int(kinds == set(PRINTED))),
        },
        what="random impacts named by the conditions of the text",
    )


def _state(theta: np.ndarray, velocity: np.ndarray) -> LayerState:
    return LayerState((float(theta[0]), float(theta[1])), (float(velocity[0]), float(velocity[1])))


def _refusal(model: Any) -> Any:
    """Whether an impact across which an angle jumps, as Table 1 prints it, is refused."""
    try:
        name_impact(
            LayerState((0.0, OPEN), (-0.5, 0.2)),
            LayerState((0.0, OPEN / 2), (0.0, 0.2)),
            model=model,
        )
    except ParameterError as error:
        return dataset({"refused": ((), True)}, what=str(error))
    return dataset({"refused": ((), False)}, what="a jump of an angle was accepted")


def table(data: Any) -> str:
    """Table 1 in Markdown."""
    rows = data["rows"]
    lines = [
        "# Table 1: impact scenarios",
        "",
        (
            "s is the impacting layer, j the other one; angles are continuous, so that the cases"
            " differ in velocities (erratum 16). The example is an impact on the lower layer at β₀"
            " = 80°, m = 0."
        ),
        "",
        (
            "| deformed before | before | deformed after | after | scenario | example: (θ₁', θ₂')"
            " before → after |"
        ),
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
    names = {
        "theta_s": "θₛ",
        "theta_j": "θⱼ",
        "M_sj": "Mₛⱼ",
        "M_jj": "Mⱼⱼ",
        "!=": "≠",
        "(+)": "⁺",
        "(-)": "⁻",
    }
    out = str(text)
    for name, pretty in names.items():
        out = out.replace(name, pretty)
    return out


def measure(data: Any) -> dict[str, Measured]:
    """The table's scenarios, and erratum 16."""
    rows = data["rows"]
    refused = bool(data["angles"]["refused"])
    named = tuple(
        (int(a), int(b), str(c))
        for a, b, c in zip(
            *(rows[f"named{x}"].values for x in ("_before", "_after", "")), strict=True
        )
    )
    found = {name: int(data["random"][name]) for name in ("wrong", "impacts", "printed_kinds")}
    same = named == PRINTED and found["wrong"] == 0 and found["printed_kinds"] == 1
    last = {
        name: float(rows[name][-1])
        for name in ("impulse", "impulse_if_unchanged", "velocity_before_2", "velocity_after_2")
    }
    measures = {
        "table1-scenarios": measured(
            same, states=rows.sizes["row"], named=rows["named"].values.tolist(), **found
        ),
        "table1-angles": measured(not refused, refused, refusal=data["angles"].attrs["what"]),
        "table1-other-layer": measured(last["impulse_if_unchanged"], last["impulse"]),
    }
    return with_fields(last, measures)


FIGURE = paper_figure("table1", compute=compute, table=table, measure=measure)
