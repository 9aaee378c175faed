"""Check the certificate of a proof of saltus with the ball arithmetic of FLINT, without saltus.

    python check_certificate.py certificate.json

Needs python-flint alone.
The motion is enclosed anew by Taylor steps, with derivatives by dual numbers instead of derivative
columns, and the operator of Krawczyk is applied to the boxes of the certificate.

Verified: one zero within `radius` of `middle`, no other one within `unique`; each gap of the
certificate is open between events; impacts have at least the `least_speed`; the orbit is `stable`,
or not, and its multipliers have the `moduli`; at each rest all impacts are `over` in time, and the
contact stays closed until the release.
Of a special point, whose parameter and kernel vector are unknowns too: its one zero and its gaps.
The program prints what it verified in its own words and numbers.

Not verified: that the expressions and the gaps of the `segments`, and those of the `rests`, are those
of the `system`, and that all of its gaps are there (saltus alone can trace a model: `proof.check()`);
that those of a special point hold the variational equation, and its radii `only`;
the texts `statement`, `assumptions`, `system` and `names`, which are not used.
"""

import itertools
import json
import sys

from flint import acb_mat, arb, arb_mat, ctx

ctx.prec = 100
PIECES = 6  # into which a step is cut where a polynomial is bounded over it


class Dual:
    """A ball and its derivatives to some unknowns."""

    def __init__(self, value, slopes):
        self.value = arb(value)
        self.slopes = slopes

    def _with(self, value, other, own, others):
        pairs = zip(self.slopes, other.slopes, strict=True)
        return Dual(value, [own * a + others * b for a, b in pairs])

    def __add__(self, other):
        return self._with(self.value + other.value, other, arb(1), arb(1))

    def __sub__(self, other):
        return self._with(self.value - other.value, other, arb(1), arb(-1))

    def __mul__(self, other):
        return self._with(self.value * other.value, other, other.value, self.value)

    def __truediv__(self, other):
        value = self.value / other.value
        return self._with(value, other, 1 / other.value, -value / other.value)

    def scaled(self, factor):
        return Dual(self.value * factor, [slope * factor for slope in self.slopes])

    def function(self, value, slope):
        return Dual(value, [slope * s for s in self.slopes])


def constant(value, like):
    return Dual(value, [arb(0)] * like)


def exact(text):
    return arb(float.fromhex(text))


def ball(middle, radius):
    return arb(float.fromhex(middle), float.fromhex(radius))


FIRST = {
    "sin": lambda u: u.function(u.value.sin(), u.value.cos()),
    "cos": lambda u: u.function(u.value.cos(), -u.value.sin()),
    "exp": lambda u: u.function(u.value.exp(), u.value.exp()),
    "log": lambda u: u.function(u.value.log(), 1 / u.value),
    "sqrt": lambda u: u.function(u.value.sqrt(), 1 / (2 * u.value.sqrt())),
}


def total(terms, like):
    result = constant(0, like)
    for term in terms:
        result = result + term
    return result


def coefficients(tape, order, leaves, state, width, accelerate):
    """Taylor coefficients of the roots; `state` has two coefficients of each coordinate and gets
    the others."""
    rows = tape["nodes"]
    partner = {}  # sin and cos of one argument are computed together
    for i, row in enumerate(rows):
        if row[0] in ("sin", "cos"):
            partner[i] = []
    series = [[] for _ in rows]
    for k in range(order + 1):
        for i, (op, *args) in enumerate(rows):
            c = series[i]
            if op == "number":
                c.append(constant(exact(args[0]) if k == 0 else 0, width))
            elif op == "parameter":
                c.append(leaves["parameter"][args[0]] if k == 0 else constant(0, width))
            elif op == "time":
                c.append(leaves["time"] if k == 0 else constant(k == 1, width))
            elif op == "coordinate":
                c.append(state[args[0]][k])
            elif op == "velocity":
                c.append(state[args[0]][k + 1].scaled(k + 1))
            else:
                u = series[args[0]]
                w = series[args[-1]]
                if op == "add":
                    c.append(u[k] + w[k])
                elif op == "sub":
                    c.append(u[k] - w[k])
                elif op == "mul":
                    c.append(total((u[j] * w[k - j] for j in range(k + 1)), width))
                elif op == "div":
                    rest = total((w[j] * c[k - j] for j in range(1, k + 1)), width)
                    c.append((u[k] - rest) / w[0])
                elif k == 0:
                    c.append(FIRST[op](u[0]))
                    if i in partner:
                        partner[i].append(FIRST["cos" if op == "sin" else "sin"](u[0]))
                elif op in ("sin", "cos"):
                    sign = 1 if op == "sin" else -1
                    own = total(
                        (u[j].scaled(j) * partner[i][k - j] for j in range(1, k + 1)), width
                    )
                    other = total((u[j].scaled(j) * c[k - j] for j in range(1, k + 1)), width)
                    c.append(own.scaled(arb(sign) / k))
                    partner[i].append(other.scaled(arb(-sign) / k))
                elif op == "exp":
                    rest = total((u[j].scaled(j) * c[k - j] for j in range(1, k + 1)), width)
                    c.append(rest.scaled(arb(1) / k))
                elif op == "sqrt":
                    rest = total((c[j] * c[k - j] for j in range(1, k)), width)
                    c.append((u[k] - rest) / c[0].scaled(2))
                elif op == "log":
                    rest = total((c[j].scaled(j) * u[k - j] for j in range(1, k)), width)
                    c.append((u[k] - rest.scaled(arb(1) / k)) / u[0])
                else:
                    raise SystemExit(f"the checker does not know {op}")
        if accelerate:
            for y, root in zip(state, tape["roots"], strict=True):
                y.append(series[root][k].scaled(arb(1) / ((k + 1) * (k + 2))))
    return [series[root] for root in tape["roots"]]


def horner(series, h, derivative):
    """sum_k c_k k .. (k - derivative + 1) h^(k - derivative)."""
    value = constant(0, len(series[0].slopes))
    h = Dual(h, [arb(0)] * len(series[0].slopes)) if not isinstance(h, Dual) else h
    for k in reversed(range(derivative, len(series))):
        factor = 1
        for d in range(derivative):
            factor *= k - d
        value = value * h + series[k].scaled(factor)
    return value


def over(series, span, derivative):
    """A box of the same over all h of a span, from pieces of it."""
    cuts = [span * i / PIECES for i in range(PIECES + 1)]
    pieces = [horner(series, a.union(b), derivative) for a, b in itertools.pairwise(cuts)]
    result = pieces[0]
    for piece in pieces[1:]:
        slopes = [a.union(b) for a, b in zip(result.slopes, piece.slopes, strict=True)]
        result = Dual(result.value.union(piece.value), slopes)
    return result


def contains(outer, inner):
    pairs = zip([outer.value, *outer.slopes], [inner.value, *inner.slopes], strict=True)
    return all(a.contains_interior(b) for a, b in pairs)


def inflated(value):
    def wider(x):
        return arb(x.mid(), x.rad() * arb("1.1") + x.abs_upper() * arb("1e-9") + arb("1e-30"))

    return Dual(wider(value.value), [wider(slope) for slope in value.slopes])


def step(tape, order, leaves, state, length, width):
    """The coefficients of a validated step, that of the remainder last."""
    series = [list(y) for y in state]
    coefficients(tape, order - 2, leaves, series, width, True)
    span = arb(0).union(length)
    whole = [[over(y, length, d) for d in range(2)] for y in series]
    box = [[inflated(w) for w in ws] for ws in whole]
    during = leaves | {"time": leaves["time"] + constant(span, width)}
    for _ in range(8):
        remainder = [list(y) for y in box]
        coefficients(tape, order - 1, during, remainder, width, True)
        later = [
            [
                w + last[-1].scaled(span ** (order + 1 - d) * (order + 1) ** d)
                for d, w in enumerate(ws)
            ]
            for ws, last in zip(whole, remainder, strict=True)
        ]
        inside = all(
            contains(b, w)
            for bs, ws in zip(box, later, strict=True)
            for b, w in zip(bs, ws, strict=True)
        )
        if inside:
            return [[*y, last[-1]] for y, last in zip(series, remainder, strict=True)]
        box = [[inflated(w) for w in ws] for ws in later]
    raise SystemExit("a Taylor step has no enclosure")


def is_open(series, sign, contact, length, start, stop):
    """Whether sign (q - contact) > 0 inside the step."""
    gap = [arb(c.value) for c in series]
    gap[0] = gap[0] - contact
    gap = [sign * c for c in gap]

    def value(low, high, first, derivative):
        t = low.union(high)
        result = arb(0)
        for k in reversed(range(first, len(gap))):
            factor = 1
            for d in range(derivative):
                factor *= k - d
            result = result * t + factor * gap[k]
        return result

    # What is divided out must vanish, as far as the enclosures tell.
    if not all(gap[k].contains(0) for k in range(start)):
        return False
    if not all(value(length, length, 0, k).contains(0) for k in range(stop)):
        return False
    end = length.abs_upper()
    if stop:
        for tries in range(40):
            begin = end * (1 - arb(0.5) ** tries) if tries else arb(0)
            cuts = [begin + (end - begin) * i / 8 for i in range(9)]
            bent = [value(a, b, stop, stop) for a, b in itertools.pairwise(cuts)]
            if all(v < 0 for v in bent) if stop == 1 else all(v > 0 for v in bent):
                end = begin
                break
        else:
            return False
    pieces = [(arb(0), end, 0)] if end > 0 else []
    while pieces:
        low, high, depth = pieces.pop()
        if value(low, high, start, 0) > 0:
            continue
        if depth > 40:
            return False
        middle = (low + high) / 2
        pieces += [(low, middle, depth + 1), (middle, high, depth + 1)]
    return True


def rows_of(certificate, box, with_gaps):
    """Balls of the equations over a box and of their derivatives, and whether the gaps are open."""
    d = certificate["coordinates"]
    events = certificate["event_size"]
    free = certificate["free_time"]
    size = len(box)
    given = certificate["parameters"]
    numbers = [ball(m, r) for m, r in zip(given["middle"], given["radius"], strict=True)]
    path = certificate.get("path")
    if path is not None:
        numbers[path] = box[-1]
    values, jacobian, opened = [], [], True
    for row in certificate["steps"]:
        segment = certificate["segments"][row["segment"]]
        # The unknowns of the begin, then those of the close, are the directions of the duals.
        first = events if row["from_event"] else 2 * d
        last = events if row["to_event"] else 2 * d
        places = [*range(row["begin"], row["begin"] + first)]
        places += [*range(row["close"], row["close"] + last)]
        places += [size - 1] * (path is not None)
        width = len(places)

        def unknown(i, width=width, places=places):
            return Dual(box[places[i]], [arb(j == i) for j in range(width)])

        known = [constant(value, width) for value in numbers]
        if path is not None:
            known[path] = unknown(width - 1)
        if row["from_event"]:
            begin = [unknown(i) for i in range(first)]
            time = begin[0] if free else constant(0, width)
            leaves = {"parameter": known + begin, "time": time}
            start = coefficients(segment["start"], 0, leaves, [], width, False)
            state = [[start[i][0], start[d + i][0]] for i in range(d)]
        else:
            time = constant(exact(row["begin_time"]), width)
            state = [[unknown(i), unknown(d + i)] for i in range(d)]
        if row["to_event"]:
            close = [unknown(first + i) for i in range(last)]
            end = close[0] if free else constant(0, width)
            if row["wraps"]:
                turns = 2 * arb.pi() * exact(certificate["span"])
                end = end + constant(turns, width) / known[given["frequency"]]
        else:
            end = constant(exact(row["close_time"]), width)
        length = end - time
        series = step(
            segment["acceleration"],
            certificate["order"],
            {"parameter": known, "time": time},
            state,
            length.value,
            width,
        )
        # The start's time moves the whole step: the series is one in t - time, both duals.
        at_end = [[horner(y, length, 0), horner(y, length, 1)] for y in series]
        if row["to_event"]:
            leaves = {"parameter": known + close, "time": end}
            found = coefficients(segment["end"], 0, leaves, at_end, width, False)
            residual = [each[0] for each in found]
        else:
            node = [unknown(first + i) for i in range(last)]
            flat = [y[0] for y in at_end] + [y[1] for y in at_end]
            residual = [a - b for a, b in zip(flat, node, strict=True)]
        for value in residual:
            values.append(value.value)
            line = [arb(0)] * size
            for place, slope in zip(places, value.slopes, strict=True):
                line[place] += slope
            jacobian.append(line)
        for gap in segment["gaps"] if with_gaps else []:
            leaves = {"parameter": known, "time": time}
            contact = coefficients(gap["position"], 0, leaves, [], width, False)[0][0].value
            start = gap["start"] if row["from_event"] else 0
            stop = gap["stop"] if row["to_event"] else 0
            own = series[gap["coordinate"]]
            opened = opened and is_open(own, int(gap["sign"]), contact, length.value, start, stop)
    for pin in certificate.get("pins", []):
        line = [exact(c) for c in pin["row"]]
        jacobian.append(line)
        values.append(sum((c * x for c, x in zip(line, box, strict=True)), -exact(pin["goal"])))
    return values, jacobian, opened


def is_whole(certificate):
    """Whether the steps lead from each event to the next one, through all nodes, in time."""
    steps = certificate["steps"]
    events, size = certificate["events"], certificate["event_size"]
    last_node = len(certificate["middle"]) - len(certificate.get("pins", []))
    nodes = iter(range(events * size, last_node, 2 * certificate["coordinates"]))
    middle = [float.fromhex(m) for m in certificate["middle"]]
    if events != len(certificate["segments"]) or events < 1:
        return False
    k = 0
    for event in range(events):
        place, time = size * event, middle[size * event] if certificate["free_time"] else 0.0
        first = True
        while True:
            if k == len(steps):
                return False
            step = steps[k]
            k += 1
            whole = step["segment"] == event and step["begin"] == place
            if not whole or step["from_event"] != first:
                return False
            if not first and float.fromhex(step["begin_time"]) != time:
                return False
            first = False
            if step["to_event"]:
                break
            place = next(nodes, None)
            later = float.fromhex(step["close_time"])
            if step["close"] != place or step["wraps"] or not later > time:
                return False
            time = later
        last = event == events - 1
        if step["wraps"] != last or step["close"] != (0 if last else size * (event + 1)):
            return False
    return k == len(steps) and next(nodes, None) is None


def image(certificate, at_middle, middle, radius):
    """The radii of the operator's image of middle +- radius if it lies in the interior, else None;
    `at_middle` are the values of the equations and their derivatives there.
    """
    size = len(middle)
    if not all(0 < r < arb("inf") for r in radius):
        return None
    box = [arb(m, r) for m, r in zip(middle, radius, strict=True)]
    matrix = arb_mat(rows_of(certificate, box, False)[1])
    values, slopes = at_middle
    inverse = arb_mat([[x.mid() for x in row] for row in slopes]).inv()
    inverse = arb_mat([[x.mid() for x in row] for row in inverse.tolist()])
    near = inverse * arb_mat([[v] for v in values])
    eye = arb_mat([[arb(i == j) for j in range(size)] for i in range(size)])
    defect = eye - inverse * matrix
    reach = [near[i, 0].abs_upper() for i in range(size)]
    for i in range(size):
        for j in range(size):
            reach[i] += defect[i, j].abs_upper() * radius[j]
    return reach if all(x < r for x, r in zip(reach, radius, strict=True)) else None


def moduli_of(certificate, jacobian):
    """Balls of the moduli of the multipliers, largest first: the derivative M of the return map of
    the first event's unknowns solves L d = -B d_1, with B the first step's part of the Jacobian.
    """
    size = certificate["event_size"]
    rows = 2 * certificate["coordinates"]
    left = [list(row) for row in jacobian]
    right = [[arb(0)] * size for _ in left]
    own = certificate["steps"][0]["to_event"] and certificate["events"] == 1
    for i in range(rows):
        for j in range(size):
            # A single step from the first event to itself has both parts in these columns.
            right[i][j] = -left[i][j]
            left[i][j] = arb(0)
    if own:
        return None
    found = arb_mat(left).solve(arb_mat(right)).tolist()[:size]
    if size == 2:
        half = (found[0][0] + found[1][1]) / 2
        determinant = found[0][0] * found[1][1] - found[0][1] * found[1][0]
        bent = half * half - determinant
        if bent < 0:
            return [determinant.sqrt()] * 2
        if bent > 0:
            return sorted(
                (abs(half + bent.sqrt()), abs(half - bent.sqrt())), key=lambda m: -m.mid()
            )
        return None
    try:
        values = acb_mat(arb_mat(found)).eig(multiple=True)
    except (ValueError, ArithmeticError):
        return None
    return sorted((abs(value) for value in values), key=lambda m: -m.mid())


def are_stable(certificate, jacobian):
    """Whether stability and moduli follow; a claim that says nothing follows always."""
    stable = certificate["stable"]
    said = [ball(*modulus) for modulus in certificate["moduli"]]
    if certificate["rests"]:
        # A rest forgets everything.
        return stable is True and all(m.contains(0) for m in said)
    if stable is None and not said:
        return True
    moduli = moduli_of(certificate, jacobian)
    if moduli is None:
        return False
    verdict = {True: all(m < 1 for m in moduli), False: moduli[0] > 1, None: True}[stable]
    pairs = zip(said, moduli, strict=True) if said else []
    return bool(verdict) and all(m.contains(found) for m, found in pairs)


def rest_holds(certificate, rest, box):
    """Whether all impacts of an accumulation are over in time, and the contact then stays closed up
    to its release.
    """
    size = certificate["event_size"]
    time, speed = box[size * rest["last"]], box[size * rest["last"] + 1]
    release = box[size * rest["release"]]
    given = certificate["parameters"]
    numbers = [ball(m, r) for m, r in zip(given["middle"], given["radius"], strict=True)]
    if rest["release"] == 0:
        release += 2 * arb.pi() * exact(certificate["span"]) / numbers[given["frequency"]]
    over = exact(rest["over"])

    def roots(moment, gap, rate, unknown):
        """Pull, held pull and its rate, speed after, restitution, position and slope."""
        leaves = {
            "parameter": [constant(n, 0) for n in [*numbers, arb(0), unknown]],
            "time": constant(moment, 0),
        }
        zero = [[constant(0, 0)] * 2]
        place, slope = (
            r[0].value for r in coefficients(rest["roots"], 0, leaves, zero, 0, False)[5:]
        )
        state = [[constant(place + gap / slope, 0), constant(rate / slope, 0)]]
        found = coefficients(rest["roots"], 0, leaves, state, 0, False)
        return [root[0].value for root in found]

    begin, fast = arb(time.lower()), arb(speed.upper())
    window = arb(0).union(over.upper() - begin)
    low = roots(begin, 0, 0, 0)[0]
    if not low < 0:
        return False
    gap = fast * fast / -low.upper()
    pull = roots(begin + window, arb(0).union(gap), arb(0, fast), 0)[0]
    law = roots(begin + window, 0, 0, arb(0).union(fast))[4]
    at_rest = roots(begin + window, 0, 0, 0)[3]
    if not (pull < 0 and law.lower() >= 0 and at_rest.abs_upper() < arb("1e-280")):
        return False
    least, most = -pull.upper(), -pull.lower()
    ratio = law.upper() * (most / least).sqrt()
    rise = fast * law.upper()
    if not (ratio < 1 and rise * rise / (2 * least) < gap):
        return False
    if not time + 2 * rise / (least * (1 - ratio)) <= over or not over < release:
        return False

    def negative(root, sign, low, high, depth):
        if sign * roots(low.union(high), 0, 0, 0)[root] < 0:
            return True
        middle = (low + high) / 2
        return depth > 0 and all(
            negative(root, sign, *part, depth - 1) for part in ((low, middle), (middle, high))
        )

    share = arb(0.5)
    for _ in range(8):
        near = release.lower() - share * (release.lower() - over)
        if negative(2, -1, near, release.upper(), 14):
            return negative(1, 1, over, near, 14)
        share /= 2
    return False


def verified(certificate):
    """For each claim of a certificate, whether it was verified."""
    whole = is_whole(certificate)
    claims = ["steps", "existence", "uniqueness", "gaps", "speeds", "stability"]
    special = "kind" in certificate
    result = dict.fromkeys(claims[:4] if special else claims, False)
    if not whole:
        return result
    result["steps"] = True
    middle = [exact(m) for m in certificate["middle"]]
    radius = [exact(r) for r in certificate["radius"]]
    unique = [exact(r) for r in certificate["unique"]]
    at_middle = rows_of(certificate, middle, False)[:2]
    reach = image(certificate, at_middle, middle, radius)
    if reach is None:
        return result
    result["existence"] = True
    wider = all(r <= u for r, u in zip(radius, unique, strict=True))
    result["uniqueness"] = wider and image(certificate, at_middle, middle, unique) is not None
    box = [arb(m, x.upper()) for m, x in zip(middle, reach, strict=True)]
    _, jacobian, result["gaps"] = rows_of(certificate, box, True)
    if special:
        return result
    least = exact(certificate["least_speed"])
    size = certificate["event_size"]
    impacts = set(range(certificate["events"])) - set(certificate["releases"])
    speeds = [box[size * i + 1] for i in impacts] if certificate["free_time"] else []
    result["speeds"] = least > 0 and all(speed >= least for speed in speeds)
    result["stability"] = are_stable(certificate, jacobian)
    if certificate["rests"]:
        result["rests"] = all(rest_holds(certificate, rest, box) for rest in certificate["rests"])
    return result


def check(certificate):
    """Whether every claim was verified."""
    return all(verified(certificate).values())


if __name__ == "__main__":
    with open(sys.argv[1]) as file:
        certificate = json.load(file)
    claims = verified(certificate)
    for claim, holds in claims.items():
        print(f"{claim}: {'verified' if holds else 'NOT verified'}")
    if certificate["free_time"] and claims["existence"]:
        size = certificate["event_size"]
        for i in range(certificate["events"]):
            time, speed = (
                ball(certificate["middle"][size * i + j], certificate["radius"][size * i + j])
                for j in range(2)
            )
            print(f"event {i + 1}: t = {time.str(20)}, speed {speed.str(20)}")
    sys.exit(not all(claims.values()))
