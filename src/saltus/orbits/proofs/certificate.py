"""The certificate of a proof: the inclusions that were verified, as plain data.

Numbers are hexadecimal doubles, so that nothing is lost.
An expression is a tape: a list of nodes [operation, operands...], each operand the number of an
earlier node, and the numbers of the roots.
A program that knows nothing of saltus can thus enclose the motion by itself and check that the
operator of Krawczyk maps the boxes into their interior. `docs/check_certificate.py` does so in the
ball arithmetic of FLINT.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.bounds import UP, Segment, Step
from saltus.errors import ParameterError
from saltus.systems import numbers
from saltus.taylor import Expr, ordered

if TYPE_CHECKING:
    from saltus.orbits.orbit import PeriodicOrbit
    from saltus.orbits.proofs.orbit_proof import OrbitProof
    from saltus.orbits.proofs.special_proof import SpecialProof

FORMAT = "saltus proof 2"
LEAVES = ("parameter", "coordinate", "velocity")
REST_ROOTS = ("pull", "held_pull", "held_rate", "speed_after", "restitution", "position", "rate")
# The time is a matter of the machine, and the others are computed anew or by their own means.
NOT_COMPARED = ("seconds", "orbit", "special", "radii", "made", "shooting", "zero", "moduli")
ROOM = 1.01  # by which balls of moduli are told wider, so that other machines verify them too
WIDER = 1.1  # the most that the ball of a modulus may exceed the computed one


def certificate_of(proof: OrbitProof) -> dict[str, Any]:
    """The certificate; `OrbitProof.certificate` says what it is.

    Raises
    ------
    ParameterError
        Nothing is proved.
    """
    made = proof.made
    rests = zip(() if made is None else made.rests, proof.rests_by, strict=True)
    return _of_zero(proof, proof.orbit) | {
        "stable": proof.stable,
        "moduli": [_hex(modulus) for modulus in proof.moduli],
        "least_speed": float(proof.least_speed).hex(),
        "releases": [] if made is None else [int(i) for i in made.releases],
        "rests": [
            {
                "last": rest.last,
                "release": rest.release,
                "over": float(over).hex(),
                "roots": _tape([getattr(rest, name) for name in REST_ROOTS]),
            }
            for rest, over in rests
        ],
    }


def special_certificate_of(proof: SpecialProof) -> dict[str, Any]:
    """The certificate; `SpecialProof.certificate` says what it is.

    Raises
    ------
    ParameterError
        Nothing is proved.
    """
    result = _of_zero(proof, proof.special.orbit)
    assert proof.shooting is not None
    return result | {
        "kind": proof.kind,
        "path": proof.shooting.path_place,
        "pins": [
            {"row": _hex(row), "goal": float(goal).hex()} for row, goal in proof.shooting.pins or []
        ],
        "only": {name: float(radius).hex() for name, radius in proof.only_within.items()},
    }


def _of_zero(proof: OrbitProof | SpecialProof, orbit: PeriodicOrbit) -> dict[str, Any]:
    """The equations of a proof, and the boxes of their zero."""
    shooting = proof.shooting
    zero = proof.zero
    if not proof.proved or shooting is None or zero is None:
        raise ParameterError(f"there is no certificate, as nothing is proved: {proof.reason}")
    return {
        "format": FORMAT,
        "statement": proof.statement,
        "assumptions": list(proof.assumptions),
        "system": orbit.system.to_json(),
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
        "steps": [_step(step) for step in shooting.steps],
        "middle": _hex(zero.middle),
        "radius": _hex(zero.radius),
        "unique": _hex(zero.unique),
    }


def _step(step: Step) -> dict[str, Any]:
    return asdict(step) | {
        "begin_time": None if step.from_event else float(step.begin_time).hex(),
        "close_time": None if step.to_event else float(step.close_time).hex(),
    }


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


def differences(proof: OrbitProof | SpecialProof, again: Any) -> list[str]:
    """What a proof or its certificate says that does not follow, or not in this form, from the same
    proof computed anew: the names of fields and of entries; empty where all of it does.
    """
    differing = [
        entry.name
        for entry in fields(proof)
        if entry.name not in NOT_COMPARED
        and not np.array_equal(getattr(proof, entry.name), getattr(again, entry.name))
    ]
    moduli = getattr(proof, "moduli", None)
    if moduli is not None:
        if not _follow(moduli, again.moduli):
            differing.append("moduli")
        # Words and numbers of moduli are those of the proof, where these follow.
        again = replace(again, moduli=moduli)
    if differing or not again.proved:
        return differing
    computed = again.certificate
    for certificate in (proof.certificate, replace(proof).certificate):
        names = [*computed, *certificate]
        differing += [name for name in names if certificate.get(name) != computed.get(name)]
    return list(dict.fromkeys(differing))


def _follow(moduli: np.ndarray, computed: np.ndarray) -> bool:
    """Whether balls of moduli contain those that were computed anew, and are hardly wider."""
    if moduli.shape != computed.shape:
        return False
    apart = np.abs(moduli[:, 0] - computed[:, 0]) * UP
    # Both are told wider by ROOM than they were computed.
    inside = apart + computed[:, 1] / ROOM * UP <= moduli[:, 1]
    return bool((inside & (moduli[:, 1] <= WIDER * computed[:, 1])).all())
