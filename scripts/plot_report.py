#!/usr/bin/env python3
"""Draws the report of one drive: trajectory from above, error over path length, features and time per stage."""
import argparse
import csv
import json
import sys

try:
    import matplotlib
except ImportError:
    sys.exit("error: drawing needs matplotlib (python3-matplotlib)")

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

STAGES = ["detect_time", "stereo_time", "describe_time", "match_time", "motion_time"]
FUNNEL = ["detected", "features", "matches", "inliers"]


def read_positions(path):
    return np.loadtxt(path, ndmin=2)[:, [3, 7, 11]]


def print_table(info, column, errors):
    dropped = int(info[-1]["dropped_pairs"])
    tracking = sum(row["state"] == "TRACKING" for row in info)
    rows = [("pairs processed (tracking)", f"{len(info)} ({tracking})"),
            ("pairs dropped", f"{dropped}"),
            ("path length", f"{errors['path_length_m']:.1f} m"),
            ("translation error", f"{errors['mean']['translation_percent']:.3f} %"),
            ("rotation error", f"{errors['mean']['rotation_deg_per_m']:.5f} deg/m"),
            ("final drift", f"{errors['final_drift_m']:.3f} m ({errors['final_drift_percent']:.3f} %)"),
            ("inliers, median", f"{np.median(column['inliers'][1:]):.0f}")]
    rows += [(f"{stage.split('_')[0]}, median", f"{1e3 * np.median(column[stage]):.1f} ms") for stage in STAGES]
    print()
    for name, value in rows:
        print(f"{name:<28}{value:>18}")
    print()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--odometry", required=True, help="poses in KITTI format, base frame")
    parser.add_argument("--ground-truth", required=True, help="poses in KITTI format, base frame")
    parser.add_argument("--info", required=True, help="CSV of record_odometry.py")
    parser.add_argument("--errors", required=True, help="JSON of evaluate_trajectory")
    parser.add_argument("--output", required=True, help="PNG to write")
    parser.add_argument("--title", default="")
    parser.add_argument("--table", action="store_true", help="also print the figures")
    arguments = parser.parse_args()

    estimate, truth = read_positions(arguments.odometry), read_positions(arguments.ground_truth)
    with open(arguments.info) as file:
        info = list(csv.DictReader(file))
    with open(arguments.errors) as file:
        errors = json.load(file)
    column = {name: np.array([float(row[name]) for row in info]) for name in STAGES + FUNNEL}

    if arguments.table:
        print_table(info, column, errors)

    figure, axes = plt.subplots(2, 2, figsize=(12, 8.5))
    figure.suptitle(arguments.title)

    axis = axes[0, 0]
    axis.plot(-truth[:, 1], truth[:, 0], color="tab:green", linewidth=3, alpha=0.6, label="ground truth")
    axis.plot(-estimate[:, 1], estimate[:, 0], color="tab:blue", linewidth=1.2, label="odometry")
    axis.plot(0, 0, "k^", label="start")
    axis.set_aspect("equal", adjustable="datalim")
    axis.set(title="trajectory from above", xlabel="right [m]", ylabel="forward [m]")
    axis.legend()
    axis.grid(alpha=0.3)

    axis = axes[0, 1]
    rows = [row for row in errors["per_length"] if row["sub_paths"] > 0]
    lengths = [row["length_m"] for row in rows]
    axis.plot(lengths, [row["translation_percent"] for row in rows], "o-", color="tab:blue")
    axis.set(title="error over path length", xlabel="length of the sub-path [m]")
    axis.set_ylabel("translation [%]", color="tab:blue")
    axis.set_ylim(bottom=0)
    axis.grid(alpha=0.3)
    rotation = axis.twinx()
    rotation.plot(lengths, [row["rotation_deg_per_m"] for row in rows], "s--", color="tab:red")
    rotation.set_ylabel("rotation [deg/m]", color="tab:red")
    rotation.set_ylim(bottom=0)

    axis = axes[1, 0]
    for name in FUNNEL:
        axis.plot(column[name], label=name)
    axis.set(title="what survives each stage", xlabel="pair", ylabel="count")
    axis.set_ylim(bottom=0, top=1.2 * axis.get_ylim()[1])  # room for the legend
    axis.legend(loc="upper center", ncol=4, fontsize="small")
    axis.grid(alpha=0.3)

    axis = axes[1, 1]
    axis.stackplot(range(len(info)), [1e3 * column[name] for name in STAGES], labels=[s.split("_")[0] for s in STAGES])
    axis.set(title="time of each stage", xlabel="pair", ylabel="ms")
    axis.legend(loc="upper right")
    axis.grid(alpha=0.3)

    figure.tight_layout()
    figure.savefig(arguments.output, dpi=100)


if __name__ == "__main__":
    main()
