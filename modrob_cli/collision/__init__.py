"""Collision thresholds: torque bands no admissible parameter leaves without contact, and their sensitivity."""
