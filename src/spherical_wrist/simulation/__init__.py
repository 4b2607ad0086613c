"""The closed loop: parts in, compiled loop, series and outcome out."""
