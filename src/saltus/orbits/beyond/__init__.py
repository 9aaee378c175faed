"""Points of a curve of orbits, what happens at their special points, and what continues beyond them."""
