"""Writes the tables of tests/reference/pinocchio: a Panda with other people's kinematics (Pinocchio) and formulas of its own.

    venv/bin/pip install -r tests/python/requirements.txt        (see check_recording.py)
    venv/bin/python tests/python/foreign_tables.py

Each arm has errors of its own in every frame (up to 1 mm and 2 mrad), a base that stands somewhere, a target on the tool, noise of 20 um
per axis and 30 urad, and one cause. Nothing here comes from kincal.
"""

import pathlib

import numpy as np
import pinocchio as pin

HERE = pathlib.Path(__file__).resolve().parent
OUT = HERE.parent / "reference" / "pinocchio"
URDF = HERE.parent.parent / "scenes" / "panda.urdf"
NOISE_M, NOISE_RAD = 20e-6, 30e-6


class Arm:
    def __init__(self, seed, gravity=(0.0, 0.0, -9.81)):
        draws = np.random.default_rng(seed)
        self.nominal = pin.buildModelFromUrdf(str(URDF))
        self.model = pin.buildModelFromUrdf(str(URDF))
        for model in (self.nominal, self.model):
            model.gravity.linear = np.array(gravity)
        for joint in range(1, self.model.njoints):
            error = pin.Motion(draws.uniform(-1e-3, 1e-3, 3), draws.uniform(-2e-3, 2e-3, 3))
            self.model.jointPlacements[joint] = self.model.jointPlacements[joint] * pin.exp6(error)
        self.data = self.model.createData()
        self.tool = self.model.getFrameId("tool") if self.model.existFrame("tool") else self.model.nframes - 1
        self.base = pin.exp6(pin.Motion(draws.uniform(-1, 1, 3), draws.uniform(-0.5, 0.5, 3)))
        self.target = pin.SE3(np.eye(3), draws.uniform(-0.05, 0.05, 3) + [0, 0, 0.1])
        self.joints = self.model.nq

    def pose(self, q, base=None, tool=None):
        pin.framesForwardKinematics(self.model, self.data, q)
        stands = self.base if base is None else self.base * base
        carries = self.target if tool is None else tool * self.target
        return stands * self.data.oMf[self.tool] * carries

    def torque(self, q):
        """Of gravity on the arm, about each joint's axis, N m."""
        return -pin.computeGeneralizedGravity(self.model, self.data, q)


def configurations(arm, count, draws):
    low, high = arm.model.lowerPositionLimit, arm.model.upperPositionLimit
    return draws.uniform(low + 0.1, high - 0.1, (count, arm.joints))


def write(name, arm, q, angles, draws, base=None, tool=None, time_s=None, more=None):
    """`angles`: where the joints truly stand; `base`, `tool`: of each row, how they have moved."""
    heads = [f"q{joint + 1}_rad" for joint in range(arm.joints)] + ["x_mm", "y_mm", "z_mm", "qx", "qy", "qz", "qw"]
    heads = (["time_s"] if time_s is not None else []) + heads + [head for head, _ in more or []]
    lines = [",".join(heads)]
    for row in range(len(q)):
        pose = arm.pose(angles[row], base and base(row), tool and tool(row))
        at = 1e3 * (pose.translation + draws.normal(0, NOISE_M, 3))
        turn = pin.Quaternion(pin.exp3(draws.normal(0, NOISE_RAD, 3)) @ pose.rotation)
        values = [f"{value:.7f}" for value in q[row]] + [f"{value:.4f}" for value in at]
        values += [f"{value:.7f}" for value in (turn.x, turn.y, turn.z, turn.w)]
        values = ([f"{time_s[row]:.1f}"] if time_s is not None else []) + values + [str(value) for _, value in more or []]
        lines.append(",".join(values))
    (OUT / f"{name}.csv").write_text("\n".join(lines) + "\n")


def alone(joint, error):
    """The errors `error` (of each row) of one joint."""
    def of(q):
        off = np.zeros_like(q)
        off[:, joint] = error
        return off
    return of


def moves(q):
    return np.vstack([np.zeros(q.shape[1]), np.diff(q, axis=0)])


def directions(q):
    """Of each joint's last move; nobody knows that of the first."""
    signs = np.sign(moves(q))
    signs[0] = 1
    return signs


def angle_error_map(arm, q, draws):
    # A graduation of 90 lines, each somewhere near its place; round between them.
    lines = draws.normal(0, 5e-4, 91)
    lines[-1] = lines[0]
    return alone(2, np.interp(np.mod(q[:, 2], 2 * np.pi), np.linspace(0, 2 * np.pi, 91), lines))(q)


def gear(joint, ratio, once, twice, four_times):
    def of(arm, q, draws):
        turn = ratio * q[:, joint]
        return alone(joint, once * np.sin(turn + 0.3) + twice * np.cos(2 * turn - 1) + four_times * np.cos(4 * turn))(q)
    return of


def wrist(arm, q, draws):
    return alone(6, 3e-4 * q[:, 4])(q)


def unsettled(arm, q, draws):
    return -6e-4 * moves(q)


def wound_up(arm, q, draws):
    torque = np.array([arm.torque(row)[1] for row in q])
    return alone(1, -0.5 * 2e-5 * directions(q)[:, 1] * np.abs(torque))(q)


def yields(joint, compliance):
    def of(arm, q, draws):
        return alone(joint, compliance * np.array([arm.torque(row)[joint] for row in q]))(q)
    return of


def simple(name, seed, count, error, gravity=(0.0, 0.0, -9.81), **more):
    arm, draws = Arm(seed, gravity), np.random.default_rng(1000 + seed)
    q = configurations(arm, count, draws)
    write(name, arm, q, q + error(arm, q, draws), draws, **more)


def creeping(name, seed, count, joint, share, fading_s):
    """The joint approaches each configuration by a first-order lag; readings come at uneven times, each some seconds after its move."""
    arm, draws = Arm(seed), np.random.default_rng(1000 + seed)
    q = configurations(arm, count, draws)
    pauses = draws.uniform(8, 40, count)
    times = np.cumsum(pauses)
    behind, errors = 0.0, []
    for row in range(count):
        way = 0.0 if row == 0 else q[row, joint] - q[row - 1, joint]
        behind = behind * np.exp(-pauses[row] / fading_s) + share * way
        errors.append(-behind)
    write(name, arm, q, q + alone(joint, np.array(errors))(q), draws, time_s=times)


def knocked(name, seed, count, where, begin, end, shift, turn):
    arm, draws = Arm(seed), np.random.default_rng(1000 + seed)
    q = configurations(arm, count, draws)
    away = pin.SE3(pin.exp3(np.array(turn)), np.array(shift))
    at = lambda row: away if begin <= row < end else pin.SE3.Identity()
    write(name, arm, q, q, draws, **{where: at})


def main():
    OUT.mkdir(parents=True, exist_ok=True)
    simple("map_joint_3", 1, 250, angle_error_map)
    simple("gear_joint_2_once_twice_four_times", 2, 100, gear(1, 50, 1.5e-4, 1e-4, 5e-5))
    simple("gear_joint_4_once", 3, 100, gear(3, 101, 1.5e-4, 0, 0))
    simple("coupling_joint_7_of_joint_5", 4, 80, wrist)
    simple("unsettled", 5, 80, unsettled)
    creeping("creep_joint_2", 6, 80, 1, 7e-4, 33.0)
    simple("wound_up_joint_2", 7, 80, wound_up)
    knocked("base_away_for_25_rows", 8, 90, "base", 40, 65, (3e-4, -2e-4, 1e-4), (1e-4, 2e-4, -3e-4))
    knocked("tool_knocked_at_row_6", 9, 80, "tool", 6, 10**9, (4e-4, 1e-4, -3e-4), (3e-4, 0, 2e-4))
    simple("yields_joint_4_without_masses", 11, 80, yields(3, 8e-5))
    down = (-9.81, 0.0, 0.0)
    columns = [("gravity_x", down[0]), ("gravity_y", down[1]), ("gravity_z", down[2])]
    simple("yields_joint_2_on_a_wall", 10, 80, yields(1, 4e-5), down, more=columns)


if __name__ == "__main__":
    main()
