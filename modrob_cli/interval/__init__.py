"""Interval arithmetic with outward rounding."""

from modrob_cli.interval.array import Interval

__all__ = ["Interval"]
