"""modrob: models, torque bounds and evidence for robot arms whose dynamics are not exactly known."""

__version__ = "0.1.0"
