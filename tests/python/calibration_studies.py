"""How robust a calibration is, and how few poses it needs: readings are made here (standard library only), `kincal identify` calibrates, and the
calibrated URDF is judged on configurations that nobody measured.

    python3 tests/python/calibration_studies.py outliers [SEEDS] [KINCAL]    gross outliers, 0 to 30 % of 60 readings
    python3 tests/python/calibration_studies.py poses [SEEDS] [KINCAL]       7 to 40 poses by a camera of 1 mm and 0.3 degrees
"""
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET

SHARES = (0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3)
ROBOT = pathlib.Path(__file__).parents[2] / "scenes" / "tutorial.urdf"


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]


def pose(x, y, z, roll, pitch, yaw):
    cr, sr, cp, sp, cy, sy = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch), math.cos(yaw), math.sin(yaw)
    return [[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, x], [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, y],
            [-sp, cp * sr, cp * cr, z], [0, 0, 0, 1]]


def about(axis, angle):
    x, y, z = axis
    c, s = math.cos(angle), math.sin(angle)
    return [[c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s, 0],
            [y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s, 0],
            [z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c), 0], [0, 0, 0, 1]]


class Arm:
    """The chain from the root to the only leaf, or to `tip`."""

    def __init__(self, path, tip=None):
        joints = ET.parse(path).getroot().findall("joint")
        above = {joint.find("child").get("link"): joint for joint in joints}
        parents = {joint.find("parent").get("link") for joint in joints}
        link = tip or next(name for name in above if name not in parents)
        self.steps = []
        while link in above:
            joint = above[link]
            origin = joint.find("origin")
            numbers = [float(value) for name in ("xyz", "rpy")
                       for value in ((origin.get(name) if origin is not None else None) or "0 0 0").split()]
            axis = [float(value) for value in (joint.find("axis").get("xyz") if joint.find("axis") is not None else "1 0 0").split()]
            limit = joint.find("limit")
            limits = (float(limit.get("lower")), float(limit.get("upper"))) if limit is not None else (-math.pi, math.pi)
            self.steps.insert(0, [numbers, None if joint.get("type") == "fixed" else axis, limits])
            link = joint.find("parent").get("link")

    def forward(self, joints):
        here, joints = pose(0, 0, 0, 0, 0, 0), iter(joints)
        for numbers, axis, _ in self.steps:
            here = product(here, pose(*numbers))
            if axis:
                here = product(here, about(axis, next(joints)))
        return here

    def draw(self, rng):
        return [rng.uniform(*limits) for _, axis, limits in self.steps if axis]


def quaternion(m):
    w = math.sqrt(max(0.0, 1 + m[0][0] + m[1][1] + m[2][2])) / 2
    x = math.copysign(math.sqrt(max(0.0, 1 + m[0][0] - m[1][1] - m[2][2])) / 2, m[2][1] - m[1][2])
    y = math.copysign(math.sqrt(max(0.0, 1 - m[0][0] + m[1][1] - m[2][2])) / 2, m[0][2] - m[2][0])
    z = math.copysign(math.sqrt(max(0.0, 1 - m[0][0] - m[1][1] + m[2][2])) / 2, m[1][0] - m[0][1])
    return [x, y, z, w]


def wrong(rng, size_mm):
    """An arm whose joint frames are each off by a normal error of so many mm and as many mrad; and where it stands, and its target."""
    arm = Arm(ROBOT)
    for numbers, axis, _ in arm.steps:
        if axis:
            for at in range(6):
                numbers[at] += size_mm * 1e-3 * rng.gauss(0, 1)
    base = pose(*[rng.uniform(-1, 1) for _ in range(6)])
    target = pose(*[rng.uniform(-0.08, 0.08) for _ in range(3)], 0, 0, 0)
    return arm, base, target


def readings(rng, arm, base, target, count, sigma_mm, sigma_deg=None):
    rows = []
    for _ in range(count):
        joints = arm.draw(rng)
        there = product(product(base, arm.forward(joints)), target)
        at = [1e3 * there[axis][3] + sigma_mm * rng.gauss(0, 1) for axis in range(3)]
        turn = []
        if sigma_deg is not None:
            noise = [math.radians(sigma_deg) * rng.gauss(0, 1) for _ in range(3)]
            size = math.sqrt(sum(value * value for value in noise)) or 1.0
            turn = quaternion(product(about([value / size for value in noise], size), [[*row[:3], 0] for row in there[:3]] + [[0, 0, 0, 1]]))
        rows.append(joints + at + turn)
    return rows


def identify(kincal, rows, options):
    with tempfile.TemporaryDirectory() as folder:
        joints = sum(axis is not None for _, axis, _ in Arm(ROBOT).steps)
        names = [f"q{joint + 1}_rad" for joint in range(joints)] + ["x_mm", "y_mm", "z_mm"] + ["qx", "qy", "qz", "qw"][:len(rows[0]) - joints - 3]
        path = pathlib.Path(folder) / "m.csv"
        path.write_text("\n".join([",".join(names)] + [",".join(f"{value:.12g}" for value in row) for row in rows]) + "\n")
        command = [kincal, "--json", "-q", "--rerun", "off", "--out", folder, "identify", path, "--robot", ROBOT, "--with-frames", *options]
        ran = subprocess.run(command, capture_output=True, text=True)
        calibrated = pathlib.Path(folder) / "m-identified.urdf"
        return (json.loads(ran.stdout), Arm(calibrated, "target")) if ran.stdout and calibrated.exists() else (None, None)


def error_mm(calibrated, arm, base, target, rng):
    """RMS distance on 100 configurations that nobody measured."""
    total = 0.0
    for _ in range(100):
        joints = arm.draw(rng)
        truth, ours = product(product(base, arm.forward(joints)), target), calibrated.forward(joints)
        total += sum((truth[axis][3] - ours[axis][3]) ** 2 for axis in range(3))
    return 1e3 * math.sqrt(total / 100)


def outliers(seeds, kincal):
    print("share    refused   error (mm RMS): median, largest   without the outliers   outliers named   good ones named   largest unnamed (mm)")
    for share in SHARES:
        errors, without, refused, named, planted, false, good, unnamed = [], [], 0, 0, 0, 0, 0, 0.0
        for seed in range(seeds):
            rng = random.Random(f"outliers {share} {seed}")
            arm, base, target = wrong(rng, 0.3)
            rows = readings(rng, arm, base, target, 60, 0.05)
            bad = set(rng.sample(range(60), round(60 * share)))
            sizes = {}
            clean = [row for at, row in enumerate(rows) if at not in bad]
            for row in sorted(bad):
                # 5 sigma to 1 m, any way.
                size = math.exp(rng.uniform(math.log(0.25), math.log(1000.0)))
                way = [rng.gauss(0, 1) for _ in range(3)]
                length = math.sqrt(sum(value * value for value in way))
                sizes[row] = size
                for axis in range(3):
                    rows[row][-3 + axis] += size * way[axis] / length
            found, calibrated = identify(kincal, rows, ["--position-noise-um", "50"])
            if calibrated is None:
                refused += 1
                continue
            fresh = rng.random()
            errors.append(error_mm(calibrated, arm, base, target, random.Random(fresh)))
            _, best = identify(kincal, clean, ["--position-noise-um", "50"])
            without.append(error_mm(best, arm, base, target, random.Random(fresh)) if best else math.nan)
            left = {entry["index"] for entry in found.get("left_out", [])}
            named, planted = named + len(left & bad), planted + len(bad)
            false, good = false + len(left - bad), good + 60 - len(bad)
            unnamed = max([unnamed] + [sizes[row] for row in bad - left])
        errors.sort()
        without.sort()
        median, largest = (errors[len(errors) // 2], errors[-1]) if errors else (math.nan, math.nan)
        told, wrongly = f"{named} of {planted}", f"{false} of {good}"
        print(f"{100 * share:4.0f} % {refused:9} {median:21.4f} {largest:12.4f} {without[len(without) // 2]:22.4f} {told:>16} {wrongly:>17} "
              f"{unnamed:22.3f}", flush=True)


def poses(seeds, kincal):
    ways = [("ladder", []), ("geometry", ["--only", "geometry"]), ("zeros", ["--only", "zeros"]), ("base", ["--only", "base"])]
    print("arm off by   poses   " + "   ".join(f"{name:>8}" for name, _ in ways) + "   ladder worse than base by over 5 %")
    for size in (0.0, 0.3, 1.5, 5.0):
        for count in (7, 10, 15, 20, 40):
            squares, worse = [0.0] * len(ways), 0
            for seed in range(seeds):
                rng = random.Random(f"poses {size} {count} {seed}")
                # Of an arm that is off by so much at its tip each frame is off by about a third.
                arm, base, target = wrong(rng, size / 3)
                rows = readings(rng, arm, base, target, count, 1.0, 0.3)
                of = []
                for _, options in ways:
                    noise = ["--position-noise-um", "1000", "--attitude-noise-deg", "0.3"]
                    _, calibrated = identify(kincal, rows, noise + options)
                    of.append(error_mm(calibrated, arm, base, target, random.Random(seed)) if calibrated else math.nan)
                squares = [total + value * value for total, value in zip(squares, of)]
                worse += of[0] > 1.05 * of[3]
            errors = "   ".join(f"{math.sqrt(total / seeds):8.3f}" for total in squares)
            print(f"{size:7.1f} mm {count:7}   {errors}   {worse:4} of {seeds}", flush=True)


if __name__ == "__main__":
    study = {"outliers": outliers, "poses": poses}[sys.argv[1]]
    study(int(sys.argv[2]) if len(sys.argv) > 2 else 200, sys.argv[3] if len(sys.argv) > 3 else "target/release/kincal")
