"""Side by side with FIGAROH (PyPI `figaroh`, 1.0.2): one real set, the same split, the same free frame of measurement.

    pip install figaroh && KINCAL_DATA_DIR=... python3 tests/python/figaroh_comparison.py [KINCAL]

UR5 and laser tracker: fitted to the grid, judged by the 20 random poses (`ur5_tracker` of the data folder). FIGAROH estimates base, tool and
joint placements ("full_params") by its structural selection; both programs see positions alone.
"""
import contextlib
import csv
import io
import json
import logging
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import warnings

warnings.filterwarnings("ignore")
logging.disable(logging.CRITICAL)

import numpy
from figaroh.calibration.base_calibration import BaseCalibration
from figaroh.calibration.calibration_tools import calc_updated_fkm
from figaroh.tools.robot import load_robot

METHODS = ("structural", "map")
CONFIG = """
robot:
  name: "ur5"
  properties:
    joints:
      active_joints: [joint1, joint2, joint3, joint4, joint5, joint6]
tasks:
  calibration:
    enabled: true
    type: "kinematic_calibration"
    joints:
      active_joints: [joint1, joint2, joint3, joint4, joint5, joint6]
    kinematics: {base_frame: "universe", tool_frame: "tool"}
    parameters: {calibration_level: "full_params", outlier_threshold: 0.05%s}
    measurements:
      markers: [{ref_joint: "joint6", position: [0, 0, 0], measurable_dof: [true, true, true, false, false, false]}]
      poses: {base_pose: [0, 0, 0, 0, 0, 0], tool_pose: [0, 0, 0, 0, 0, 0]}
    data: {source_file: "%s", number_of_samples: %d}
"""


class Calibration(BaseCalibration):
    def cost_function(self, var):
        estimated = calc_updated_fkm(self.model, self.data, var, self.q_measured, self.calib_config)
        return self._compute_logmap_residuals(self.PEE_measured, estimated, position_frame="world") / 25e-6


def rows(path):
    with open(path) as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            yield [math.radians(float(row[f"q{joint}_deg"])) for joint in range(1, 7)] + [1e-3 * float(row[f"{axis}_mm"]) for axis in "xyz"]


def table(path, of):
    with open(path, "w") as file:
        file.write(",".join([f"joint{joint}" for joint in range(1, 7)] + ["x1", "y1", "z1"]) + "\n")
        file.writelines(",".join(repr(value) for value in row) + "\n" for row in of)


def figaroh(data, folder, method):
    fitted, fresh = list(rows(data / "grid.csv")), list(rows(data / "random.csv"))
    table(folder / "grid.csv", fitted)
    (folder / "config.yaml").write_text(CONFIG % (method, folder / "grid.csv", len(fitted)))
    begun = time.perf_counter()
    robot = load_robot(str(data / "ur5.urdf"), load_by_urdf=True)
    calibration = Calibration(robot, str(folder / "config.yaml"))
    calibration.calib_config.update(known_baseframe=False, known_tipframe=False)
    calibration.initialize()
    calibration.solve(enable_logging=False)
    took = time.perf_counter() - begun
    config = dict(calibration.calib_config, NbSample=len(fresh))
    joints = numpy.array([row[:6] for row in fresh])
    estimated = calc_updated_fkm(calibration.model, calibration.data, calibration.LM_result.x, joints, config)
    away = estimated.reshape(3, len(fresh)).T - numpy.array([row[6:] for row in fresh])
    names = calibration.calib_config["param_name"]
    return took, rms(away), calibration.evaluation_metrics["rmse"] * 1e3, dict(zip(names, calibration.std_dev))


def rms(away):
    return 1e3 * math.sqrt((away**2).sum(axis=1).mean())


def kincal(program, data, folder):
    command = [program, "--json", "-q", "--rerun", "off", "--out", folder, "identify", data / "grid.csv", "--robot", data / "ur5.urdf",
               "--evaluate", data / "random.csv", "--position-noise-um", "25"]
    begun = time.perf_counter()
    found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    took = time.perf_counter() - begun
    return took, 1e3 * found["held_out"]["position_m"]["rms"], 1e3 * found["fitted"]["position_m"]["rms"], found["joint_frames"]


def main(program):
    data = pathlib.Path(os.environ["KINCAL_DATA_DIR"]) / "ur5_tracker"
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        took, held_out, fitted, frames = kincal(program, data, folder)
        print("                         time (s)   fitted (mm RMS)   held out (mm RMS)")
        print(f"kincal                  {took:9.2f} {fitted:17.4f} {held_out:19.4f}", flush=True)
        for method in METHODS:
            setting = "" if method == "structural" else f', estimation: {{method: "{method}"}}'
            try:
                with contextlib.redirect_stdout(io.StringIO()):
                    took, held_out, fitted, deviations = figaroh(data, folder, setting)
            except Exception as error:
                print(f"FIGAROH, {method:14} failed: {type(error).__name__}: {error}")
                continue
            print(f"FIGAROH, {method:14} {took:9.2f} {fitted:17.4f} {held_out:19.4f}   ({len(deviations)} parameters)", flush=True)
            zeros = {name: value for name, value in deviations.items() if "d_phiz_joint" in name or name.startswith("offset")}
            if method == "structural":
                print("standard error of joint zeros, mrad:")
                for frame in frames:
                    theirs = next((f"{1e3 * value:.4f}" for name, value in zeros.items() if name.endswith(frame["joint"])), "not in its base set")
                    print(f"    {frame['joint']}: kincal {1e3 * frame['zero']['standard_error']:.4f}, FIGAROH {theirs}")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "target/release/kincal")
