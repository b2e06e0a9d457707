#!/usr/bin/env python3
"""Records a running odometry beside its ground truth: poses of both in KITTI format (base frame, equal stamps only) and one
CSV line for each vo_info. Ends when nothing has come for a while after the first message."""
import argparse
import csv
import math
import sys
import threading
import time

import nav_msgs.msg
import rospy

from stereo_descriptor_vo.msg import VoInfo

INFO_FIELDS = ["state", "detected", "features", "matches", "inliers", "coverage", "rms_reprojection_error", "detect_time",
               "stereo_time", "describe_time", "match_time", "motion_time", "latency", "dropped_pairs", "epoch",
               "disparity_offset", "disparity_offset_sigma"]


def pose_line(pose):
    """The 3x4 matrix of a pose, row-major, as KITTI writes it."""
    q, p = pose.orientation, pose.position
    x, y, z, w = q.x, q.y, q.z, q.w
    rows = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), p.x],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), p.y],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), p.z]]
    return " ".join(f"{value:.12e}" for row in rows for value in row)


class Recorder:
    def __init__(self):
        self.lock = threading.Lock()
        self.odometry, self.truth, self.info = {}, {}, {}
        self.last = None
        rospy.Subscriber("odom", nav_msgs.msg.Odometry, self.on_odometry, queue_size=1000)
        rospy.Subscriber("/ground_truth/odom", nav_msgs.msg.Odometry, self.on_truth, queue_size=1000)
        rospy.Subscriber("/ground_truth/path", nav_msgs.msg.Path, lambda _: None, queue_size=1)
        rospy.Subscriber("vo_info", VoInfo, self.on_info, queue_size=1000)

    def on_odometry(self, message):
        with self.lock:
            self.odometry[message.header.stamp] = pose_line(message.pose.pose)
            self.last = time.monotonic()

    def on_truth(self, message):
        with self.lock:
            self.truth[message.header.stamp] = pose_line(message.pose.pose)

    def on_info(self, message):
        with self.lock:
            self.info[message.header.stamp] = message
            self.last = time.monotonic()

    def wait(self, patience, idle):
        """False when nothing came at all."""
        start = time.monotonic()
        while not rospy.is_shutdown():
            time.sleep(0.2)
            with self.lock:
                if self.last is None and time.monotonic() - start > patience:
                    return False
                if self.last is not None and time.monotonic() - self.last > idle:
                    return True
        return self.last is not None

    def write(self, odometry_file, truth_file, info_file):
        with self.lock:
            stamps = sorted(set(self.odometry) & set(self.truth))
            for path, poses in ((odometry_file, self.odometry), (truth_file, self.truth)):
                with open(path, "w") as file:
                    file.writelines(poses[stamp] + "\n" for stamp in stamps)
            with open(info_file, "w", newline="") as file:
                writer = csv.writer(file)
                writer.writerow(["stamp"] + INFO_FIELDS)
                for stamp in sorted(self.info):
                    values = [getattr(self.info[stamp], field) for field in INFO_FIELDS]
                    writer.writerow([f"{stamp.to_sec():.9f}"] +
                                    ["" if isinstance(v, float) and math.isnan(v) else v for v in values])
        return len(stamps), len(self.info)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--odometry", required=True, help="poses to write")
    parser.add_argument("--ground-truth", required=True, help="poses to write")
    parser.add_argument("--info", required=True, help="CSV to write")
    parser.add_argument("--patience", type=float, default=120.0, help="seconds to wait for the first message")
    parser.add_argument("--idle", type=float, default=5.0, help="seconds of silence that end the recording")
    arguments = parser.parse_args(rospy.myargv()[1:])
    rospy.init_node("record_odometry", anonymous=True, disable_signals=True)
    recorder = Recorder()
    if not recorder.wait(arguments.patience, arguments.idle):
        print(f"error: no message on {rospy.resolve_name('odom')} or {rospy.resolve_name('vo_info')}", file=sys.stderr)
        return 1
    poses, infos = recorder.write(arguments.odometry, arguments.ground_truth, arguments.info)
    print(f"recorded {poses} poses with ground truth and {infos} info messages")
    return 0


if __name__ == "__main__":
    sys.exit(main())
