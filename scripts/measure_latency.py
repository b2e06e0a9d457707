#!/usr/bin/python3
"""Feeds a drive in KITTI layout to the nodelets in one manager at some rates and prints a Markdown table: how long after an
image's stamp its odometry is out, and how much of that is not the core's own work. The images come from this process, over a
socket, so their way counts, too. Prints the manager's memory over that of an empty one. Starts a ROS master of its own;
needs the build and . .catkin_ws/devel/setup.sh."""
import argparse
import os
import pathlib
import socket
import statistics
import subprocess
import sys
import time

os.environ["ROS_NAMESPACE"] = "stereo"  # of the topics; rospy reads it when imported
import rospy  # noqa: E402

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import soak  # noqa: E402

STAGES = ("detect_time", "stereo_time", "describe_time", "match_time", "motion_time")
MANAGER, EMPTY = "/stereo/stereo_vo_manager", "/empty_manager"


def free_port():
    with socket.socket() as s:
        s.bind(("localhost", 0))
        return s.getsockname()[1]


def settled_memory(node, seconds=5.0):
    for _ in range(100):
        try:
            pid = soak.pid_of(node)
            break
        except Exception:  # not registered yet
            time.sleep(0.2)
    time.sleep(seconds)
    return soak.resident_memory(pid)


def measure(feeder, rate, seconds):
    feeder.rate = rate
    feeder.info.clear()
    _, published = feeder.run(seconds, MANAGER)
    info = [i for i in feeder.info[10:] if i.state == "TRACKING"]  # without the first pairs of a jump
    if not info:
        raise SystemExit(f"no pair was tracked at {rate:g} Hz")
    own = [sum(getattr(i, stage) for stage in STAGES) for i in info]
    over = sorted(i.latency - t for i, t in zip(info, own))
    columns = [statistics.median(i.latency for i in info), statistics.median(own), statistics.median(over),
               over[int(0.95 * (len(over) - 1))]]
    return f"| {rate:g} | " + " | ".join(f"{1e3 * c:.1f}" for c in columns) + f" | {published - len(feeder.info)} of {published} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drive", help="folder in KITTI layout")
    parser.add_argument("--rates", type=float, nargs="+", default=[10.0, 30.0, 60.0], help="pairs per second")
    parser.add_argument("--seconds", type=float, default=10.0, help="for each rate")
    arguments = parser.parse_args(rospy.myargv()[1:])
    port = free_port()
    os.environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
    environment = {name: value for name, value in os.environ.items() if name != "ROS_NAMESPACE"}
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": environment}
    processes = [subprocess.Popen(["roscore", "-p", str(port)], **quiet)]
    try:
        while subprocess.run(["rosparam", "list"], check=False, **quiet).returncode:
            time.sleep(0.2)
        rospy.init_node("soak", disable_signals=True)
        processes.append(subprocess.Popen(["rosrun", "nodelet", "nodelet", "manager", f"__name:={EMPTY[1:]}"], **quiet))
        empty = settled_memory(EMPTY)
        processes.append(subprocess.Popen(["roslaunch", "stereo_descriptor_vo", "stereo_vo.launch"], **quiet))
        feeder = soak.Soak(arguments.drive, arguments.rates[0])
        feeder.broadcaster.sendTransform(soak.transform_of_camera())
        start = time.monotonic()
        while not feeder.is_connected():
            if time.monotonic() - start > 60.0:
                raise SystemExit("the nodelets did not start")
            time.sleep(0.1)
        rows = [measure(feeder, rate, arguments.seconds) for rate in arguments.rates]
        memory = soak.resident_memory(soak.pid_of(MANAGER))
    finally:
        for process in reversed(processes):
            process.terminate()
            process.wait()
    print("| pairs a second | stamp to odometry [ms] | core's own [ms] | over it, median | p95 | without an answer |")
    print("| --- | --- | --- | --- | --- | --- |")
    print("\n".join(rows))
    print(f"\nThe manager has {memory:.0f} MB of resident memory then, an empty one {empty:.0f} MB.")


if __name__ == "__main__":
    main()
