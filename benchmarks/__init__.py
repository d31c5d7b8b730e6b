"""Speed and memory of modrob, measured; never asserted. Run with ``python -m benchmarks``."""
