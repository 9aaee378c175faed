"""Parts of orbits in interval arithmetic: what proofs ask of an orbit's equations."""
