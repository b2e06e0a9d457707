"""Draws the report of one drive: trajectory from above, error over path length, features and time per stage."""
import csv
import json

import numpy as np

from . import poses
from .pictures import plt, save

STAGES = ["detect_time", "stereo_time", "describe_time", "match_time", "motion_time"]
FUNNEL = ["detected", "features", "matches", "inliers"]


def print_table(info, column, errors):
    tracking = sum(row["state"] == "TRACKING" for row in info)
    rows = [("pairs processed (tracking)", f"{len(info)} ({tracking})"),
            ("pairs dropped", info[-1]["dropped_pairs"]),
            ("path length", f"{errors['path_length_m']:.1f} m"),
            ("translation error", f"{errors['mean']['translation_percent']:.3f} %"),
            ("rotation error", f"{errors['mean']['rotation_deg_per_m']:.5f} deg/m"),
            ("final drift", f"{errors['final_drift_m']:.3f} m ({errors['final_drift_percent']:.3f} %)"),
            ("inliers, median", f"{np.median(column['inliers'][1:]):.0f}")]
    rows += [(f"{stage.split('_')[0]}, median", f"{1e3 * np.median(column[stage]):.1f} ms") for stage in STAGES]
    print("\n".join(["", *(f"{name:<28}{value:>18}" for name, value in rows), ""]))


def draw_trajectories(axis, estimate, truth):
    for T, name, style in ((truth, "ground truth", {"color": "tab:green", "linewidth": 3, "alpha": 0.6}),
                           (estimate, "odometry", {"color": "tab:blue", "linewidth": 1.2})):
        axis.plot(-T[:, 1, 3], T[:, 0, 3], label=name, **style)
    axis.plot(0, 0, "k^", label="start")
    axis.set_aspect("equal", adjustable="datalim")
    axis.set(title="trajectory from above", xlabel="right [m]", ylabel="forward [m]")
    axis.legend()


def draw_errors(axis, errors):
    rows = [row for row in errors["per_length"] if row["sub_paths"] > 0]
    axis.set(title="error over path length", xlabel="length of the sub-path [m]")
    for side, name, label, style, color in ((axis, "translation_percent", "translation [%]", "o-", "tab:blue"),
                                            (axis.twinx(), "rotation_deg_per_m", "rotation [deg/m]", "s--", "tab:red")):
        side.plot([row["length_m"] for row in rows], [row[name] for row in rows], style, color=color)
        side.set_ylabel(label, color=color)
        side.set_ylim(bottom=0)


def options(parser):
    parser.add_argument("--odometry", required=True, help="poses in KITTI format, base frame")
    parser.add_argument("--ground-truth", required=True, help="poses in KITTI format, base frame")
    parser.add_argument("--info", required=True, help="CSV of record_odometry.py")
    parser.add_argument("--errors", required=True, help="JSON of evaluate_trajectory")
    parser.add_argument("--output", required=True, help="PNG to write")
    parser.add_argument("--title", default="")
    parser.add_argument("--table", action="store_true", help="also print the figures")


def main(arguments):
    with open(arguments.info) as file:
        info = list(csv.DictReader(file))
    with open(arguments.errors) as file:
        errors = json.load(file)
    column = {name: np.array([float(row[name]) for row in info]) for name in STAGES + FUNNEL}
    if arguments.table:
        print_table(info, column, errors)

    figure, ((trajectory, error), (funnel, time)) = plt.subplots(2, 2, figsize=(12, 8.5))
    figure.suptitle(arguments.title)
    draw_trajectories(trajectory, poses.read(arguments.odometry), poses.read(arguments.ground_truth))
    draw_errors(error, errors)
    for name in FUNNEL:
        funnel.plot(column[name], label=name)
    funnel.set(title="what survives each stage", xlabel="pair", ylabel="count")
    funnel.set_ylim(bottom=0, top=1.2 * funnel.get_ylim()[1])  # room for the legend
    funnel.legend(loc="upper center", ncol=4, fontsize="small")
    time.stackplot(range(len(info)), [1e3 * column[name] for name in STAGES], labels=[stage.split("_")[0] for stage in STAGES])
    time.set(title="time of each stage", xlabel="pair", ylabel="ms")
    time.legend(loc="upper right")
    for axis in (trajectory, error, funnel, time):
        axis.grid(alpha=0.3)
    save(figure, arguments.output, dpi=100)
