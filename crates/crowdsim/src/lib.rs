//! The simulated truth: scenario, pedestrians, lidar, robot plant, world and metrics.
