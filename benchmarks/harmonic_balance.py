"""A resonance curve with a soft stop by harmonic balance and by saltus, in one run.

    python benchmarks/harmonic_balance.py [--harmonics 15] [--rounds 5]

x'' + c x' + x + k max(x - edge, 0) = F sin(W t). Harmonic balance has the alternating frequency/time
scheme with its exact Jacobian, pseudo-arclength and Newton's method, in NumPy; its step adapts to
the iterations. saltus follows the same curve by exact motions, with multipliers, extrema and special points. The
largest displacements at one frequency differ by what the harmonics, and the samples of a period,
leave out.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import saltus

DAMPING, STOP, EDGE, FORCE = 0.1, 10.0, 0.5, 0.2
LOW, HIGH = 0.6, 2.0
SEEN = 1.0  # a frequency with one orbit, at which displacements are compared
SAMPLES = 2048  # of a period
LONGEST = 0.05  # step along the curve
TOLERANCE = 1e-10


class Balance:
    """The equations of harmonic balance, for the Fourier coefficients and the frequency."""

    def __init__(self, harmonics: int) -> None:
        """Prepare the transforms between coefficients and values."""
        self.orders = np.arange(1, harmonics + 1)
        phases = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES
        angles = np.outer(phases, self.orders)
        # 1, cos t, sin t, cos 2t, ...
        self.values = np.ones((SAMPLES, 2 * harmonics + 1))
        self.values[:, 1::2], self.values[:, 2::2] = np.cos(angles), np.sin(angles)
        self.coefficients = self.values.T * 2.0 / SAMPLES
        self.coefficients[0] /= 2.0
        self.load = np.zeros(2 * harmonics + 1)
        self.load[2] = FORCE

    def linear(self, frequency: float) -> tuple[np.ndarray, np.ndarray]:
        """The matrix of the linear terms, and its derivative to the frequency."""
        size = len(self.load)
        matrix, slope = np.eye(size), np.zeros((size, size))
        cosines, sines = 2 * self.orders - 1, 2 * self.orders
        rates = self.orders * frequency
        for rows in (cosines, sines):
            matrix[rows, rows] -= rates**2
            slope[rows, rows] -= 2.0 * self.orders * rates
        matrix[cosines, sines], matrix[sines, cosines] = DAMPING * rates, -DAMPING * rates
        slope[cosines, sines] = DAMPING * self.orders
        slope[sines, cosines] = -DAMPING * self.orders
        return matrix, slope

    def evaluate(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The residual and its derivatives."""
        matrix, slope = self.linear(place[-1])
        beyond = self.values @ place[:-1] - EDGE
        pressed = beyond > 0.0
        force = self.coefficients @ (STOP * np.where(pressed, beyond, 0.0))
        stiffness = self.coefficients[:, pressed] @ (STOP * self.values[pressed])
        residual = matrix @ place[:-1] + force - self.load
        return residual, np.column_stack([matrix + stiffness, slope @ place[:-1]])

    def corrected(self, guess: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, int] | None:
        """Newton's method in the plane through the guess."""
        place = guess.copy()
        for iteration in range(10):
            residual, derivatives = self.evaluate(place)
            if np.abs(residual).max() < TOLERANCE:
                return place, iteration
            right = np.append(-residual, normal @ (guess - place))
            place = place + np.linalg.solve(np.vstack([derivatives, normal]), right)
        return None

    def curve(self) -> np.ndarray:
        """The places along the curve from the lowest frequency to the highest."""
        start = np.append(np.zeros(len(self.load)), LOW)
        found = self.corrected(start, np.append(np.zeros(len(self.load)), 1.0))
        assert found is not None
        places, step = [found[0]], 0.5 * LONGEST
        tangent = np.append(np.zeros(len(self.load)), 1.0)
        while places[-1][-1] < HIGH:
            _, derivatives = self.evaluate(places[-1])
            unit = np.append(np.zeros(len(self.load)), 1.0)
            tangent = np.linalg.solve(np.vstack([derivatives, tangent]), unit)
            tangent /= np.linalg.norm(tangent)
            while (found := self.corrected(places[-1] + step * tangent, tangent)) is None:
                step /= 2.0
            places.append(found[0])
            step = min(LONGEST, step * (1.5 if found[1] <= 3 else 0.7))
        return np.array(places)

    def largest(self, places: np.ndarray) -> float:
        """The largest displacement where the curve passes the frequency `SEEN`."""
        near = places[np.argmin(np.abs(places[:, -1] - SEEN))].copy()
        near[-1] = SEEN
        found = self.corrected(near, np.append(np.zeros(len(self.load)), 1.0))
        assert found is not None
        return float((self.values @ found[0][:-1]).max())


def exact(frequency: float) -> saltus.PeriodicOrbit:
    """The orbit at a frequency by saltus."""
    model = saltus.Structure(
        mass=[[1.0]],
        damping=[[DAMPING]],
        stiffness=[[1.0]],
        surfaces=[saltus.Surface(name="stop", coordinate=0, position=EDGE, stiffness=STOP)],
        forces={"force": 0},
    )
    load = saltus.Load(frequency=frequency, force=saltus.Harmonic(amplitude=FORCE))
    return saltus.find_orbit(saltus.System(model=model, load=load), **model.start(displacement=0.0))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--harmonics", type=int, nargs="+", default=[5, 15, 45])
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    orbit = exact(LOW)
    codes = {"saltus": lambda: saltus.continue_orbit(orbit, "load.frequency", (LOW, HIGH))}
    balances = {f"{count} harmonics": Balance(count) for count in options.harmonics}
    codes |= {name: balance.curve for name, balance in balances.items()}
    least = dict.fromkeys(codes, np.inf)
    results = {name: code() for name, code in codes.items()}  # which compiles
    for _ in range(options.rounds):
        for name, code in codes.items():
            begin = time.process_time()
            results[name] = code()
            least[name] = min(least[name], time.process_time() - begin)
    branch = results["saltus"]
    true = exact(SEEN).reach[1]
    print("| | points | ms a point | s a curve | largest x | off by |\n|---|---|---|---|---|---|")
    for name, result in results.items():
        count = len(branch.points) if name == "saltus" else len(result)
        top = true if name == "saltus" else balances[name].largest(result)
        print(
            f"| {name} | {count} | {1e3 * least[name] / count:.2f} | {least[name]:.3f} |"
            f" {top:.6f} | {abs(top - true):.1e} |"
        )
    print("special points:", ", ".join(f"{p.kind} {p.parameter:.9f}" for p in branch.special))


if __name__ == "__main__":
    main()
