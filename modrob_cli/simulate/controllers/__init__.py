"""Controllers of joint torque behind one small interface."""
