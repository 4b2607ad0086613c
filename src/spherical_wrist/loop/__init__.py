"""The closed loop, compiled and interpreted: arrays in, log out."""
