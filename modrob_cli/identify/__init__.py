"""What a log says about an arm: signals, friction, prediction errors."""
