"""How fast a motion may be run: time-scaling factors that are safe for every admissible parameter."""
