"""Lyapunov exponents, through saltation at every impact, of one motion and of many."""
