"""Benchmarks: what loop, wire, laws, plant and lockstep cost, each beside something else in the same run."""
