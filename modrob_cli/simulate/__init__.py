"""A robot to test against: plant, sensors, controllers, closed loop. Pure functions and objects of arrays."""
