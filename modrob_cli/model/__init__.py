"""Frozen dataclasses of arrays: bodies, joints, robots, modules, tables, logs."""
