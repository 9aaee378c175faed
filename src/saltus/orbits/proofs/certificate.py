"""The certificate of a proof: the inclusions that were verified, as plain data.

Numbers are hexadecimal doubles, so that nothing is lost.
An expression is a tape: a list of nodes [operation, operands...], each operand the number of an
earlier node, and the numbers of the roots.
A program that knows nothing of saltus can thus enclose the motion by itself and check that the
operator of Krawczyk maps the box into its interior. `docs/check_certificate.py` does so in the ball
arithmetic of FLINT.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.bounds import Ball, Segment, contraction
from saltus.errors import ParameterError
from saltus.orbits.proofs.resting_segments import rest_by
from saltus.orbits.proofs.segments import least_speed
from saltus.systems import numbers
from saltus.taylor import Expr, ordered

if TYPE_CHECKING:
    from saltus.orbits.proofs.orbit_proof import OrbitProof

FORMAT = "saltus proof 1"
LEAVES = ("parameter", "coordinate", "velocity")


def certificate_of(proof: OrbitProof) -> dict[str, Any]:
    """The certificate; `OrbitProof.certificate` says what it is.

    Raises
    ------
    ParameterError
        Nothing is proved.
    """
    shooting = proof.shooting
    zero = proof.zero
    if not proof.proved or shooting is None or zero is None:
        raise ParameterError(f"there is no certificate, as nothing is proved: {proof.reason}")
    if proof.made is not None and proof.made.rests:
        raise ParameterError(
            "there is no certificate of an orbit with rests yet; proof.check() repeats its"
            " inclusions"
        )
    return {
        "format": FORMAT,
        "statement": proof.statement,
        "assumptions": list(proof.assumptions),
        "system": proof.orbit.system.to_json(),
        "parameters": {
            "names": [name for name, _ in numbers(shooting.system)],
            "middle": _hex(shooting.parameters.middle),
            "radius": _hex(shooting.parameters.radius),
            "frequency": shooting.frequency_place,
        },
        "coordinates": shooting.dof,
        "order": shooting.settings.order,
        "span": float(shooting.span).hex(),
        "events": shooting.event_count,
        "event_size": shooting.event_size,
        "free_time": shooting.free_time,
        "segments": [_segment(segment) for segment in shooting.segments],
        "steps": [
            {
                "segment": step.segment,
                "begin": step.begin,
                "from_event": step.from_event,
                "begin_time": None if step.from_event else float(step.begin_time).hex(),
                "close": step.close,
                "to_event": step.to_event,
                "close_time": None if step.to_event else float(step.close_time).hex(),
                "wraps": step.wraps,
            }
            for step in shooting.steps
        ],
        "middle": _hex(zero.middle),
        "radius": _hex(zero.radius),
        "box": _hex(_checked_box(proof)),
    }


def _checked_box(proof: OrbitProof) -> np.ndarray:
    """A box a little wider than the zero's, which the operator maps into its interior."""
    shooting = proof.shooting
    zero = proof.zero
    assert shooting is not None
    assert zero is not None
    return np.asarray(np.minimum(16.0 * zero.radius, np.maximum(zero.unique, zero.radius)))


def _segment(segment: Segment) -> dict[str, Any]:
    return {
        "acceleration": _tape(segment.acceleration),
        "start": _tape(segment.start),
        "end": _tape(segment.end),
        "gaps": [
            {
                "coordinate": gap.coordinate,
                "sign": gap.sign,
                "position": _tape([gap.position]),
                "start": gap.start,
                "stop": gap.stop,
            }
            for gap in segment.gaps
        ],
    }


def _tape(roots: Sequence[Expr]) -> dict[str, Any]:
    nodes = ordered(list(roots))
    place = {id(node): i for i, node in enumerate(nodes)}
    rows: list[list[Any]] = []
    for node in nodes:
        if node.op == "number":
            rows.append(["number", float(node.value).hex()])
        elif node.op in LEAVES:
            rows.append([node.op, int(node.value)])
        else:
            rows.append([node.op, *(place[id(operand)] for operand in node.args)])
    return {"nodes": rows, "roots": [place[id(root)] for root in roots]}


def _hex(values: np.ndarray) -> list[str]:
    return [float(value).hex() for value in values]


def holds(proof: OrbitProof) -> bool:
    """Whether the inclusions of a proof hold when they are computed anew."""
    shooting = proof.shooting
    zero = proof.zero
    if not proof.proved or shooting is None or zero is None:
        return False
    at = shooting.enclose(Ball(zero.middle))
    residual = shooting.system_rows(at, Ball(zero.middle))[0]
    radius = _checked_box(proof)
    over = shooting.enclose(Ball(zero.middle, radius))
    jacobian = shooting.system_rows(over, Ball(zero.middle, radius))[1]
    reach = contraction(zero.inverse, residual, jacobian, radius)
    inner = shooting.enclose(zero.box)
    return bool(
        at.proved
        and over.proved
        and inner.proved
        and (reach < radius).all()
        and shooting.is_open(inner, zero.box)
        and proof.made is not None
        and least_speed(shooting, zero.box, proof.made) > 0.0
        and all(rest_by(shooting, zero.box, rest) is not None for rest in proof.made.rests)
    )
