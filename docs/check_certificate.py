"""Check the certificate of a proof of saltus with the ball arithmetic of FLINT, without saltus.

    python check_certificate.py certificate.json

Needs python-flint alone.
The motion is enclosed anew by Taylor steps, with derivatives by dual numbers instead of derivative
columns, and the operator of Krawczyk is applied to the box of the certificate.
"""

import itertools
import json
import sys

from flint import arb, arb_mat, ctx

ctx.prec = 100


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


def hull(values):
    result = values[0]
    for value in values[1:]:
        result = result.union(value)
    return result


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
    box = [[inflated(horner(y, span, d)) for d in range(2)] for y in series]
    during = leaves | {"time": leaves["time"] + constant(span, width)}
    for _ in range(8):
        remainder = [list(y) for y in box]
        coefficients(tape, order - 1, during, remainder, width, True)
        whole = [
            [
                horner(y, span, d) + last[-1].scaled(span ** (order + 1 - d) * (order + 1) ** d)
                for d in range(2)
            ]
            for y, last in zip(series, remainder, strict=True)
        ]
        inside = all(
            contains(b, w)
            for bs, ws in zip(box, whole, strict=True)
            for b, w in zip(bs, ws, strict=True)
        )
        if inside:
            return [[*y, last[-1]] for y, last in zip(series, remainder, strict=True)]
        box = [[inflated(w) for w in ws] for ws in whole]
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
    period = 2 * arb.pi() * exact(certificate["span"]) / numbers[given["frequency"]]
    values, jacobian, opened = [], [], True
    for row in certificate["steps"]:
        segment = certificate["segments"][row["segment"]]
        # The unknowns of the begin, then those of the close, are the directions of the duals.
        first = events if row["from_event"] else 2 * d
        last = events if row["to_event"] else 2 * d
        places = [*range(row["begin"], row["begin"] + first)]
        places += [*range(row["close"], row["close"] + last)]
        width = len(places)

        def unknown(i, width=width, places=places):
            return Dual(box[places[i]], [arb(j == i) for j in range(width)])

        known = [constant(value, width) for value in numbers]
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
                end = end + constant(period, width)
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
    return values, jacobian, opened


def check(certificate):
    """Whether the box contains exactly one zero, with open gaps."""
    middle = [exact(m) for m in certificate["middle"]]
    size = len(middle)
    radius = [exact(r) for r in certificate["box"]]
    values, _, _ = rows_of(certificate, middle, False)
    box = [arb(m, r) for m, r in zip(middle, radius, strict=True)]
    _, jacobian, _ = rows_of(certificate, box, False)
    matrix = arb_mat(jacobian)
    inverse = arb_mat([[x.mid() for x in row] for row in matrix.tolist()]).inv()
    inverse = arb_mat([[x.mid() for x in row] for row in inverse.tolist()])
    near = inverse * arb_mat([[v] for v in values])
    eye = arb_mat([[arb(i == j) for j in range(size)] for i in range(size)])
    defect = eye - inverse * matrix
    for i in range(size):
        reach = near[i, 0].abs_upper()
        for j in range(size):
            reach += defect[i, j].abs_upper() * radius[j]
        if not reach < radius[i]:
            return False
    inner = [ball(m, r) for m, r in zip(certificate["middle"], certificate["radius"], strict=True)]
    return rows_of(certificate, inner, True)[2]


if __name__ == "__main__":
    with open(sys.argv[1]) as file:
        certificate = json.load(file)
    print(certificate["statement"])
    verified = check(certificate)
    print("The inclusions hold." if verified else "The inclusions do not hold.")
    sys.exit(not verified)
