#!/usr/bin/env python3
"""Feeds a drive in KITTI layout to the running pipeline for some minutes, again and again while the stamps only grow, and
watches the nodelet manager's memory. Stamps are even, as those of a triggered camera are, also where this program is late. A
drive that ends where it began goes round; another one goes forwards and backwards in turn, which no vehicle does: at each end
it is DEGRADED for 2 s. In the first minute the pairs of half a second come at once, five times: most of them are dropped, and
the manager takes the room that so many need and keeps it. From then on exits 1 when memory grows, a pair is dropped though it
was published in time and the hypervisor withheld no processor, a pair gets no answer, an error is logged or the odometry does
not track. What was withheld is printed for each drop."""
import argparse
import collections
import glob
import os
import statistics
import sys
import time
import xmlrpc.client

import cv2
import cv_bridge
import numpy as np
import rosgraph
import rospy
import sensor_msgs.msg
import tf2_ros
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log

from stereo_descriptor_vo.msg import VoInfo

FRAME = "soak_left_optical"
SIDES = ("left", "right")
WARM_UP = 60.0  # s
BUNCH, EVERY = 0.5, 10.0  # s: the pairs of so long at once, so often in the warm-up


def read_drive(directory):
    """(pairs of images, [P of left and right])."""
    count = sum(1 for line in open(os.path.join(directory, "times.txt")) if line.strip())
    pairs = [[cv2.imread(os.path.join(directory, f"image_{side}", f"{i:06d}.png"), cv2.IMREAD_GRAYSCALE)
              for side in range(2)] for i in range(count)]
    with open(os.path.join(directory, "calib.txt")) as file:
        rows = dict(line.split(":") for line in file if line.strip())
    return pairs, [[float(x) for x in rows[f"P{side}"].split()] for side in range(2)]


def camera_info(p, image):
    info = sensor_msgs.msg.CameraInfo()
    info.height, info.width = image.shape
    info.distortion_model, info.D = "plumb_bob", [0.0] * 5
    info.K = [p[0], 0, p[2], 0, p[5], p[6], 0, 0, 1]
    info.R = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    info.P = p
    return info


def transform_of_camera():
    """Of a camera that looks ahead, at the base's origin."""
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id = "base_link", FRAME
    q = transform.transform.rotation
    q.x, q.y, q.z, q.w = -0.5, 0.5, -0.5, 0.5
    return transform


def resident_memory(pid):
    """MB."""
    with open(f"/proc/{pid}/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def pid_of(node):
    return xmlrpc.client.ServerProxy(rosgraph.Master("/soak").lookupNode(node)).getPid("/soak")[2]


class Withheld:
    """What kept a process from running: processors that the hypervisor gave to others (steal), and threads that were ready to
    run and had to wait for other programs of this machine."""

    def __init__(self, pid):
        self.pid, self.samples = pid, []  # (monotonic time, s; steal of each processor, s; wait of each thread, s)

    def sample(self):
        with open("/proc/stat") as file:
            lines = (line.split() for line in file if line.startswith("cpu") and line[3].isdigit())
            steal = [int(line[8]) / os.sysconf("SC_CLK_TCK") for line in lines]
        waits = {}
        for path in glob.glob(f"/proc/{self.pid}/task/*/schedstat"):
            try:
                with open(path) as file:
                    waits[path] = 1e-9 * int(file.read().split()[1])
            except OSError:  # the thread has ended
                pass
        self.samples.append((time.monotonic(), steal, waits))
        if len(self.samples) > 1000:
            del self.samples[:500]

    def since(self, moment):
        """(most steal of a processor, longest wait of a thread) from a moment to the last sample, s."""
        window = [s for s in self.samples if s[0] >= moment]
        (_, steal, waits), (_, last_steal, last_waits) = window[0], window[-1]
        return (max(b - a for a, b in zip(steal, last_steal)),
                max((wait - waits.get(thread, 0.0) for thread, wait in last_waits.items()), default=0.0))


class Soak:
    def __init__(self, drive, rate, closed, manager):
        self.rate, self.closed = rate, closed
        self.pairs, self.projections = read_drive(drive)
        self.answers, self.last, self.errors, self.poses = [], VoInfo(), [], 0
        self.late, self.drops = [], []  # (monotonic time, s or number)
        self.causes, self.seconds = [], []  # what Withheld says of the second before each drop, and of every second
        self.manager = manager
        self.broadcaster = tf2_ros.StaticTransformBroadcaster()
        self.broadcaster.sendTransform(transform_of_camera())
        self.images = [rospy.Publisher(f"{s}/image_rect", sensor_msgs.msg.Image, queue_size=5) for s in SIDES]
        self.infos = [rospy.Publisher(f"{s}/camera_info", sensor_msgs.msg.CameraInfo, queue_size=5) for s in SIDES]
        rospy.Subscriber("/rosout", Log, self.on_log, queue_size=100)
        rospy.Subscriber("vo_info", VoInfo, self.on_info, queue_size=100)
        rospy.Subscriber("odom", Odometry, self.on_odometry, queue_size=100)

    def on_log(self, log):
        if log.level >= Log.ERROR:
            self.errors.append(f"{log.name}: {log.msg}")

    def on_info(self, info):
        # No messages: the garbage collector would look through all of them again and again.
        self.answers.append((time.monotonic(), info.state, info.reason, 1e3 * info.latency))
        more = info.dropped_pairs + info.dropped_features - self.last.dropped_pairs - self.last.dropped_features
        if more:
            self.drops.append((time.monotonic(), more))
        self.last = info

    def on_odometry(self, _):
        self.poses += 1

    def is_connected(self):
        return all(p.get_num_connections() > 0 for p in self.images + self.infos)

    def publish(self, k, stamp):
        """The k-th pair of the endless way."""
        turns = len(self.pairs) if self.closed else 2 * (len(self.pairs) - 1)
        i = k % turns if self.closed else min(k % turns, turns - k % turns)
        header = rospy.Header(stamp=stamp, frame_id=FRAME)
        for side, image in enumerate(self.pairs[i]):
            info = camera_info(self.projections[side], image)
            info.header = header
            self.infos[side].publish(info)
            message = cv_bridge.CvBridge().cv2_to_imgmsg(image, "mono8")
            message.header = header
            self.images[side].publish(message)

    def published_late_before(self, moment):
        return any(0.0 <= moment - late < 1.0 for late, _ in self.late)

    def dropped_without_cause(self, since):
        """Pairs dropped after a moment though in the second before none was published late by a period or more, and no processor
        was withheld for as long."""
        return sum(count for (t, count), (steal, _) in zip(self.drops, self.causes)
                   if t > since and not self.published_late_before(t) and steal < 1.0 / self.rate)

    def explain_drops(self, withheld):
        withheld.sample()
        for moment, _ in self.drops[len(self.causes):]:
            self.causes.append(withheld.since(moment - 1.0))

    def run(self, seconds):
        """Returns [(time, MB)] and the number of pairs published."""
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))  # a camera waits for no other program
        except PermissionError:
            print("not allowed to run as a real-time process: pairs may be published late")
        pid = pid_of(self.manager)
        withheld, start, begin, memory, k = Withheld(pid), time.monotonic(), rospy.Time.now(), [], 0
        while time.monotonic() - start < seconds and not rospy.is_shutdown():
            late = time.monotonic() - start - k / self.rate
            if late > 1.0 / self.rate:
                self.late.append((time.monotonic(), late))
            self.publish(k, begin + rospy.Duration(k / self.rate))
            k += 1
            memory.append((time.monotonic() - start, resident_memory(pid)))
            self.explain_drops(withheld)
            if k % round(self.rate) == 0:
                self.seconds.append(withheld.since(time.monotonic() - 1.0))
            if k % (10 * int(self.rate)) == 0:
                print(f"\r{memory[-1][0]:.0f} of {seconds:.0f} s, {k} pairs, {memory[-1][1]:.1f} MB ", end="", flush=True)
            time.sleep(max(0.0, start + k / self.rate - time.monotonic()))
            if k / self.rate < WARM_UP and k % int(EVERY * self.rate) == 0:
                time.sleep(BUNCH)
        print()
        time.sleep(2.0)
        self.explain_drops(withheld)
        return memory, k


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drive", help="folder in KITTI layout")
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--rate", type=float, default=10.0, help="pairs per second")
    parser.add_argument("--closed", action="store_true", help="the drive's first pair follows its last one")
    parser.add_argument("--manager", default="/stereo/stereo_vo_manager")
    parser.add_argument("--growth", type=float, default=1.0, help="%% that the memory may grow from the second quarter to the last")
    arguments = parser.parse_args(rospy.myargv()[1:])
    rospy.init_node("soak", disable_signals=True)
    soak = Soak(arguments.drive, arguments.rate, arguments.closed, arguments.manager)
    while not soak.is_connected():
        time.sleep(0.1)
    begin = time.monotonic()
    memory, pairs = soak.run(60.0 * arguments.minutes)

    quarter = len(memory) // 4
    before, after = (statistics.median(m for _, m in part) for part in (memory[quarter:2 * quarter], memory[-quarter:]))
    states = collections.Counter(state for _, state, _, _ in soak.answers)
    last, count = soak.last, len(soak.answers)
    answered = count + last.dropped_pairs + last.dropped_features
    # ms, of the same two quarters
    latencies = [[latency for *_, latency in part] or [float("nan")]
                 for part in (soak.answers[count // 4:count // 2], soak.answers[-(count // 4):])]
    first, last_quarter = ("%.0f (95 %% below %.0f)" % tuple(np.percentile(part, (50, 95))) for part in latencies)
    print(f"{arguments.minutes:g} minutes at {arguments.rate:g} Hz: {pairs} pairs, {count} answered, {last.dropped_pairs} dropped, "
          f"{last.dropped_features} features dropped, {dict(states)}, {soak.poses} poses, {last.distance:.0f} m, {len(soak.errors)} errors")
    print(f"second quarter: latency {first} ms, memory {before:.1f} MB; last quarter: {last_quarter} ms, {after:.1f} MB "
          f"({100.0 * (after / before - 1.0):+.2f} %)")
    warm = begin + WARM_UP + 1.0
    late = [seconds for t, seconds in soak.late if t > warm]
    drops = [(*drop, *cause) for drop, cause in zip(soak.drops, soak.causes) if drop[0] > warm]
    without_cause = soak.dropped_without_cause(warm)
    print(f"after the first minute: {sum(drop[1] for drop in drops)} dropped, {without_cause} of them without a cause outside; "
          f"{len(late)} pairs published late by a period or more (at most {1e3 * max(late, default=0.0):.0f} ms)")
    steals, waits = zip(*soak.seconds)
    print(f"of each second the hypervisor withheld a processor for {1e3 * statistics.median(steals):.0f} ms (at most {1e3 * max(steals):.0f}), and "
          f"a thread of the manager waited for {1e3 * statistics.median(waits):.0f} ms (at most {1e3 * max(waits):.0f})")
    for t, number, steal, wait in drops:
        print(f"{number} dropped at {t - begin:.1f} s: in the second before, the hypervisor withheld a processor for {1e3 * steal:.0f} ms, "
              f"and a thread of the manager waited for {1e3 * wait:.0f} ms" + (", the feeder was late" if soak.published_late_before(t) else ""))
    minutes = [f"{m:.1f}" for (t, m), (next_t, _) in zip(memory, memory[1:]) if t // 60 < next_t // 60]
    print("memory after each minute:", ", ".join(minutes), "MB")
    untracked = collections.Counter((state, reason) for _, state, reason, _ in soak.answers if state != "TRACKING")
    print(f"after the first minute: {sum(t > warm and state != 'TRACKING' for t, state, _, _ in soak.answers)} pairs not TRACKING")
    for (state, reason), times in untracked.most_common(20):
        print(f"{times} pairs {state}: {reason}")
    for error in soak.errors[:5]:
        print(error)
    # A busy machine may lose pairs before they come to be counted, in the queues of publisher and subscriber.
    good = (after / before - 1.0 <= 0.01 * arguments.growth and not soak.errors and answered >= 0.95 * pairs
            and not without_cause and states["TRACKING"] >= 0.99 * count > 0)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
