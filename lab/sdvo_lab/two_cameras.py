"""Two cameras of one robot, fused by robot_localization: the recipe of docs/fusing.md on rendered drives, against the exact truth; each
drive is played through the launch files, once for all filters. Needs a sourced workspace with this package and robot_localization.

Errors are positions of base_link (m), without alignment: rms over the drive, and at its end."""
import math
import os
import re
import signal
import socket
import subprocess

import cv2
import numpy
import yaml

from . import drives, marks, poses, programs

# m ahead, deg to the right.
CAMERAS = {"front": {}, "rear": {"mount_z": -0.3, "mount_yaw": 180}}
SEEDS = (7701, 7702, 7703, 7704, 7705, 7706)
NAME = "two cameras"  # of the table
INPUTS = ("odom0", "odom1")
T_BASE_OPTICAL = numpy.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]], float)
STAMP_UNIT = 1000000  # ns
CLOCK_GOES_ON = 5.0  # s after the last pair; a filter works by the clock

LAUNCH = """<launch>
  <param name="use_sim_time" value="true"/>
  {cameras}
  {filters}
  <node pkg="rosbag" type="record" name="recorder" args="-O {record} --regex .*/(odom|filtered)"/>
  <node pkg="rosbag" type="play" name="player" args="{bag} --quiet --clock --wait-for-subscribers --rate {rate}" required="true"/>
</launch>
"""
CAMERA = """<include file="$(find stereo_descriptor_vo)/launch/stereo_vo.launch">
    <arg name="namespace" value="{0}"/>
    <arg name="publish_tf" value="false"/>
    <arg name="queue_size" value="300"/>
  </include>"""
FILTER = """<node pkg="robot_localization" type="ekf_localization_node" name="{0}">
    {1}
    <rosparam file="{2}"/>
    <remap from="odometry/filtered" to="{0}/filtered"/>
  </node>"""
NOISE = '<rosparam file="$(find stereo_descriptor_vo)/config/robot_localization.yaml"/>'


def recipe():
    """The filter's parameters for two cameras."""
    texts = re.findall(r"```yaml\n(.*?)```", (programs.ROOT / "docs/fusing.md").read_text(), re.DOTALL)
    return next(values for values in map(yaml.safe_load, texts) if "odom1" in values and values["odom1"].endswith("rear/odom"))


def filters():
    """Parameters by name, and whether they come with this package's process noise."""
    # A late pose changes the state at its stamp, which is reported again then.
    page = {**recipe(), "permit_corrected_publication": True}
    twists = [False] * 6 + [True] * 6 + [False] * 3
    other = {**page, "publish_tf": False}
    return {"poses": (page, False),
            "twists": ({**other, **{f"{name}_config": twists for name in INPUTS}}, True),
            "differential": ({**other, **{f"{name}_differential": True for name in INPUTS}}, True)}


def sources():
    return (*CAMERAS, *filters())


def root_mean_square(values):
    return numpy.mean(numpy.square(values)) ** 0.5


def mount(options):
    """T_base_left of a camera."""
    yaw = math.radians(options.get("mount_yaw", 0))
    T = poses.translation([options.get("mount_x", 0), 0, options.get("mount_z", 0)])
    T[:3, :3] = cv2.Rodrigues(numpy.array([0, yaw, 0], float))[0]
    return T_BASE_OPTICAL @ T


def static_transform(child, T):
    from geometry_msgs.msg import TransformStamped
    message = TransformStamped()
    message.header.frame_id, message.child_frame_id = "base_link", child
    v, q = message.transform.translation, message.transform.rotation
    v.x, v.y, v.z = T[:3, 3]
    turn = cv2.Rodrigues(T[:3, :3])[0].ravel()
    angle = numpy.linalg.norm(turn)
    q.x, q.y, q.z = turn / max(angle, 1e-9) * math.sin(angle / 2)
    q.w = math.cos(angle / 2)
    return message


def write_bag(path, by_camera, work):
    """One robot's bag: pairs of both cameras at the same stamps, and their mounts. Returns the stamps."""
    import rosbag
    import rospy
    from tf2_msgs.msg import TFMessage
    mounts = TFMessage([static_transform(f"{name}_optical", mount(CAMERAS[name])) for name in by_camera])
    stamps = set()
    with rosbag.Bag(str(path), "w") as both:
        for name, drive in by_camera.items():
            single = work / f"{name}.bag"
            programs.run("convert", drive.directory, "--output", single)
            with rosbag.Bag(str(single)) as bag:
                for topic, message, _ in bag.read_messages():
                    if not topic.startswith("/stereo/"):
                        continue
                    stamp = message.header.stamp
                    stamps.add(stamp)
                    message.header.frame_id = f"{name}_optical"
                    both.write(topic.replace("/stereo/", f"/{name}/"), message, stamp)
            single.unlink()
        stamps = sorted(stamps)
        for stamp in (stamps[0] - rospy.Duration(0.5), stamps[-1] + rospy.Duration(CLOCK_GOES_ON)):
            both.write("/tf_static", mounts, stamp)
    return stamps


def play(bag, work, rate):
    """Plays the bag through cameras and filters. Returns the bag of what they publish."""
    record = work / "live.bag"
    texts = []
    for name, (values, has_noise) in filters().items():
        (work / f"{name}.yaml").write_text(yaml.safe_dump(values))
        texts.append(FILTER.format(name, NOISE if has_noise else "", work / f"{name}.yaml"))
    launch = work / "two_cameras.launch"
    launch.write_text(LAUNCH.format(cameras="\n  ".join(map(CAMERA.format, CAMERAS)), filters="\n  ".join(texts), bag=bag, record=record, rate=rate))
    with socket.socket() as free:
        free.bind(("", 0))
        port = free.getsockname()[1]
    environment = dict(os.environ, ROS_MASTER_URI=f"http://localhost:{port}", ROS_HOME=str(work))
    with open(work / "launch.log", "w") as log:
        done = subprocess.Popen(["roslaunch", "-p", str(port), str(launch)], env=environment, stdout=log, stderr=log)
        try:
            done.wait()
        finally:
            done.send_signal(signal.SIGINT)
            done.wait()
    if not record.exists():
        raise SystemExit(f"error: nothing was recorded\n{(work / 'launch.log').read_text()}")
    return record


def positions(record):
    """Of each source: positions by stamp (ns). A filter reports a stamp again once the other camera's pose has come: the last one counts."""
    import rosbag
    result = {}
    with rosbag.Bag(str(record)) as bag:
        for topic, message, _ in bag.read_messages():
            if topic.endswith(("/odom", "/filtered")):
                p = message.pose.pose.position
                result.setdefault(topic.strip("/").split("/")[0], {})[message.header.stamp.to_nsec()] = (p.x, p.y, p.z)
    return result


def errors(found, truth, stamps):
    """Errors of the positions at the stamps of pairs (ns), by pair. A filter also predicts between them, and rounds stamps to 0.1 us."""
    at = {round(stamp / STAMP_UNIT): p for stamp, p in found.items()}
    units = [round(stamp / STAMP_UNIT) for stamp in stamps]
    return {i: numpy.linalg.norm(numpy.array(at[unit]) - truth[i]) for i, unit in enumerate(units) if unit in at}


def measure(seed, arguments, folder, work):
    by_camera = {name: drives.rendered(folder, arguments.trajectory, arguments.rig, seed, 0, arguments.pairs, **options)
                 for name, options in CAMERAS.items()}
    cameras = {name: drive.poses for name, drive in by_camera.items()}
    truth = T_BASE_OPTICAL @ cameras["front"] @ numpy.linalg.inv(T_BASE_OPTICAL)
    T = mount(CAMERAS["rear"])
    assert numpy.abs(T @ cameras["rear"] @ numpy.linalg.inv(T) - truth).max() < 1e-6, "the same drive"
    stamps = write_bag(work / "both.bag", by_camera, work)
    found = positions(play(work / "both.bag", work, arguments.rate))
    truth = truth[:, :3, 3]
    length = numpy.linalg.norm(numpy.diff(truth, axis=0), axis=1).sum()
    ns = [stamp.to_nsec() for stamp in stamps]
    return length, {name: errors(found.get(name, {}), truth, ns) for name in sources()}


def options(parser):
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS, help="[default: %(default)s]")
    parser.add_argument("--pairs", type=int, default=300, help="of each drive [default: %(default)s]")
    parser.add_argument("--trajectory", default="hand_held", help="[default: %(default)s]")
    parser.add_argument("--rig", default="d435_small", help="[default: %(default)s]")
    parser.add_argument("--rate", type=float, default=0.5, help="of playing, 1: real time [default: %(default)s]")
    drives.add_rendered(parser)
    marks.add_write(parser, marks.RENDERED)


def rows(arguments):
    yield ["seed", "m", *(f"{name}: rms; end [mm]" for name in sources())]
    ends = {name: [] for name in sources()}
    for seed in arguments.seeds:
        with drives.folders(arguments) as (work, folder):
            length, by_source = measure(seed, arguments, folder, work)
        cells = []
        for name, found in by_source.items():
            is_at_end = arguments.pairs - 1 in found
            ends[name].append(found[arguments.pairs - 1] if is_at_end else math.nan)
            cells.append(f"{1e3 * root_mean_square(list(found.values())):.1f}; {1e3 * ends[name][-1]:.1f}" if found else "–")
        yield [seed, f"{length:.1f}", *cells]
    yield ["rms", "", *(f"–; {1e3 * root_mean_square(values):.1f}" for values in ends.values())]


def main(arguments):
    for package in ("stereo_descriptor_vo", "robot_localization"):
        if subprocess.run(["rospack", "find", package], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode != 0:
            raise SystemExit(f"error: no package {package}: source a workspace that has it")
    marks.show(rows(arguments), arguments.write, NAME)
