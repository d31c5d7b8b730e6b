"""Rigid-body algorithms, with Pinocchio behind one file."""
