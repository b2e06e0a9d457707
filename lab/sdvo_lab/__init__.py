"""Measures the odometry: one module a subcommand of lab/run, over shared ones for drives, programs, poses and tables."""
