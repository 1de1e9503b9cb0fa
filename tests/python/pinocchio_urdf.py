"""A calibrated URDF as another program sees it: what changed in the text, and whether Pinocchio puts the tool where kincal does.

    pip install pin && python3 tests/python/pinocchio_urdf.py TABLE.csv ROBOT.urdf TIP_LINK [KINCAL] [-- OPTIONS of identify]

Pinocchio's poses of the calibrated robot at 200 configurations are given to `kincal identify --only base` as readings of that robot: what is
left of them is the difference of the two programs.
"""
import difflib
import json
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy
import pinocchio


def main(table, robot, tip, program, options):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        run = lambda *arguments: subprocess.run([program, "--json", "-q", "--rerun", "off", "--out", folder, *arguments], capture_output=True, text=True)
        first = run("identify", table, "--robot", robot, "--tip-link", tip, *options)
        if first.returncode not in (0, 1):
            sys.exit(first.stderr)
        calibrated = folder / f"{pathlib.Path(table).stem}-identified.urdf"
        before, after = pathlib.Path(robot).read_text().splitlines(), calibrated.read_text().splitlines()
        changed = [line for line in difflib.unified_diff(before, after, lineterm="", n=0) if line[:1] in "+-" and line[:3] not in ("+++", "---")]
        bare = lambda line: re.sub(r'(xyz|rpy)\s*=\s*"[^"]*"', r"\1", line[1:])
        minus, plus = ([bare(line) for line in changed if line[0] == sign] for sign in "-+")
        print(f"{len(before)} lines, {len(plus)} changed; but for the numbers of origins they are {'the same' if minus == plus else 'NOT the same'}")
        model = pinocchio.buildModelFromUrdf(str(calibrated))
        data, frame = model.createData(), model.getFrameId(tip)
        chain = [joint for joint in model.supports[model.frames[frame].parentJoint] if joint > 0]
        draw = numpy.random.default_rng(1)
        rows = [",".join([f"q{number + 1}_rad" for number in range(len(chain))] + ["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"])]
        for _ in range(200):
            joints = pinocchio.neutral(model)
            own = []
            for joint in chain:
                at = model.joints[joint].idx_q
                joints[at] = draw.uniform(max(model.lowerPositionLimit[at], -3), min(model.upperPositionLimit[at], 3))
                own.append(joints[at])
            pinocchio.framesForwardKinematics(model, data, joints)
            place = data.oMf[frame]
            rows.append(",".join(repr(float(value)) for value in [*own, *place.translation, *pinocchio.Quaternion(place.rotation).coeffs()]))
        (folder / "poses.csv").write_text("\n".join(rows) + "\n")
        second = run("identify", folder / "poses.csv", "--robot", calibrated, "--tip-link", tip, "--only", "base", "--position-noise-um", "1")
        if not second.stdout:
            sys.exit(second.stderr)
        found = json.loads(second.stdout)["fitted"]
        print(f"Pinocchio and kincal differ by {found['position_m']['max']:.1e} m and {found['rotation_rad']['max']:.1e} rad at most, 200 configurations")


if __name__ == "__main__":
    arguments = sys.argv[1:]
    at = arguments.index("--") if "--" in arguments else len(arguments)
    given, options = arguments[:at], arguments[at + 1:]
    main(*given[:3], given[3] if len(given) > 3 else "target/release/kincal", options)
