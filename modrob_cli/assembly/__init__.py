"""Modules and connections to robots; D-H tables, link parameters and their intervals as views of the result."""
