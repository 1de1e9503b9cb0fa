"""A bag of ROS 2, written by `rosbags` (PyPI), against the table of the same readings: `kincal import` and `identify` must say the same, and
find by how much poses are stamped late.

    pip install rosbags && python3 tests/python/ros_bag.py [LATE_MS] [KINCAL]      the comparison
    python3 tests/python/ros_bag.py write FOLDER [LATE_MS] [STANDS] [JOINT_HZ]     the bag alone
"""
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile

import numpy
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from calibration_studies import ROBOT, Arm, product, quaternion, wrong

STORE = get_typestore(Stores.ROS2_HUMBLE)
TYPES = STORE.types
NOISE_MM = 0.05


def header(seconds):
    nanoseconds = round(seconds * 1e9)
    stamp = TYPES["builtin_interfaces/msg/Time"](sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
    return TYPES["std_msgs/msg/Header"](stamp=stamp, frame_id="tracker")


def names():
    import xml.etree.ElementTree as ET
    return [joint.get("name") for joint in ET.parse(ROBOT).getroot().findall("joint") if joint.get("type") != "fixed"]


def write(folder, late_s, stands, joint_hz=100):
    """A bag of an arm that stands for one second and moves for one; joints at `joint_hz`, poses at 30 Hz. The rows of its stands."""
    rng = random.Random("ros bag")
    arm, base, target = wrong(rng, 0.3)
    known = names()
    places = [arm.draw(rng) for _ in range(stands + 1)]

    def at(seconds):
        number, within = int(seconds // 2), seconds % 2
        share = min(max(within - 1, 0), 1)
        share = share * share * (3 - 2 * share)
        return [a + share * (b - a) for a, b in zip(places[number], places[number + 1])]

    joint_state, pose_stamped = TYPES["sensor_msgs/msg/JointState"], TYPES["geometry_msgs/msg/PoseStamped"]
    pose, point, turn = (TYPES[f"geometry_msgs/msg/{name}"] for name in ("Pose", "Point", "Quaternion"))
    begin, rows = 1_700_000_000.0, {}
    events = [(tick / joint_hz, "joints") for tick in range(int(2 * stands * joint_hz))]
    events += [(tick / 30, "pose") for tick in range(int(2 * stands * 30)) if tick / 30 > late_s]
    bag = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
    bag.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with bag as writer:
        of_joints = writer.add_connection("/joint_states", joint_state.__msgtype__, typestore=STORE)
        of_poses = writer.add_connection("/tracker/pose", pose_stamped.__msgtype__, typestore=STORE)
        nothing = numpy.zeros(0)
        for seconds, what in sorted(events):
            if what == "joints":
                # In another order than the robot's, and a gripper beside them.
                joints = [0.02] + at(seconds)[::-1]
                message = joint_state(header=header(begin + seconds), name=["gripper"] + known[::-1], position=numpy.array(joints),
                                      velocity=nothing, effort=nothing)
                writer.write(of_joints, round((begin + seconds) * 1e9), STORE.serialize_cdr(message, joint_state.__msgtype__))
                continue
            joints = at(seconds - late_s)
            there = product(product(base, arm.forward(joints)), target)
            read = [there[axis][3] + 1e-3 * NOISE_MM * rng.gauss(0, 1) for axis in range(3)]
            qx, qy, qz, qw = quaternion(there)
            message = pose_stamped(header=header(begin + seconds),
                                   pose=pose(position=point(*read), orientation=turn(x=qx, y=qy, z=qz, w=qw)))
            writer.write(of_poses, round((begin + seconds) * 1e9), STORE.serialize_cdr(message, pose_stamped.__msgtype__))
            within = (seconds - late_s) % 2
            if 0.2 < within < 0.8:
                rows.setdefault(int((seconds - late_s) // 2), (joints, []))[1].append(read)
    return [joints + [1e3 * sum(read[axis] for read in reads) / len(reads) for axis in range(3)] for joints, reads in rows.values()]


def main(late_ms, kincal):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        rows = write(folder / "bag", 1e-3 * late_ms, 60)
        run = lambda *arguments: json.loads(subprocess.run([kincal, "--json", "-q", "--rerun", "off", "--out", folder, *arguments],
                                                           capture_output=True, text=True, check=True).stdout)
        imported = run("import", folder / "bag", "--robot", ROBOT)
        found = imported["latency_found"]
        print(f"poses late by {late_ms:.1f} ms: found {1e3 * found['seconds']:.2f} ms, standard error {1e3 * found['standard_error']:.2f} ms; "
              f"{imported['rows']} rows for 60 stands")
        header = ",".join([f"q{joint + 1}_rad" for joint in range(len(names()))] + ["x_mm", "y_mm", "z_mm"])
        (folder / "table.csv").write_text("\n".join([header] + [",".join(f"{value:.12g}" for value in row) for row in rows]) + "\n")
        text = (folder / "bag.csv").read_text().splitlines()
        # The table has positions alone.
        at = [column for column, name in enumerate(text[0].split(",")) if name[0] != "q" or name.startswith("q") and name[1].isdigit()]
        (folder / "bag.csv").write_text("\n".join(",".join(line.split(",")[column] for column in at) for line in text) + "\n")
        errors = []
        for name in ("table", "bag"):
            result = run("identify", folder / f"{name}.csv", "--robot", ROBOT, "--position-noise-um", "12", "--with-frames")
            errors.append(Arm(folder / f"{name}-identified.urdf", "target"))
        rng = random.Random(1)
        arm, base, target = wrong(random.Random("ros bag"), 0.3)
        away = [0.0, 0.0]
        for _ in range(100):
            joints = arm.draw(rng)
            truth = product(product(base, arm.forward(joints)), target)
            for which, calibrated in enumerate(errors):
                ours = calibrated.forward(joints)
                away[which] += sum((truth[axis][3] - ours[axis][3]) ** 2 for axis in range(3)) / 100
        print("error on fresh configurations, mm RMS: from the table {:.4f}, from the bag {:.4f}".format(*(1e3 * math.sqrt(of) for of in away)))


if __name__ == "__main__":
    if sys.argv[1:2] == ["write"]:
        late, count, hertz = (float(text) for text in (sys.argv[3:] + ["50", "60", "100"][len(sys.argv) - 3:])[:3])
        write(pathlib.Path(sys.argv[2]), 1e-3 * late, int(count), hertz)
    else:
        main(float(sys.argv[1]) if len(sys.argv) > 1 else 50.0, sys.argv[2] if len(sys.argv) > 2 else "target/release/kincal")
