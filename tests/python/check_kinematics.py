"""Compares kincal's forward kinematics with Pinocchio's.

    venv/bin/pip install -r tests/python/requirements.txt        (see check_recording.py)
    kincal run scenes/arm8.toml --set design.swarm.iterations=5 --set plan.held_out_count=1000 --out check
    venv/bin/python tests/python/check_kinematics.py check/arm8.mcap check/arm8.urdf

The recording holds joint readings (/measurement) and where the nominal arm puts the tool at these (/measurement/pose_nominal);
Pinocchio computes the same from the exported URDF. Ends with 1 if they differ by more than 1e-12 m or rad.
"""

import json
import sys

import numpy as np
import pinocchio as pin
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

TOLERANCE = 1e-12


def main(recording, urdf, tool="tool"):
    joints, poses = [], []
    with open(recording, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, message in reader.iter_messages(topics=["/measurement", "/measurement/pose_nominal"]):
            if channel.topic == "/measurement":
                joints.append(json.loads(message.data)["joints"])
            else:
                poses.append(DecoderFactory().decoder_for(channel.message_encoding, schema)(message.data).pose)
    assert len(joints) == len(poses) > 0, "no measurements"

    model = pin.buildModelFromUrdf(urdf)
    data = model.createData()
    frame = model.getFrameId(tool)
    assert frame < model.nframes, f"{urdf} has no frame {tool}"
    assert model.nq == len(joints[0]), f"{urdf} has {model.nq} joint coordinates, the recording {len(joints[0])}"
    worst_m = worst_rad = 0.0
    for q, pose in zip(joints, poses):
        pin.framesForwardKinematics(model, data, np.array(q))
        theirs = data.oMf[frame]
        position = np.array([pose.position.x, pose.position.y, pose.position.z])
        orientation = pose.orientation
        rotation = pin.Quaternion(orientation.w, orientation.x, orientation.y, orientation.z).toRotationMatrix()
        worst_m = max(worst_m, np.linalg.norm(position - theirs.translation))
        # The chord of the rotation matrices, which is the angle where it is small.
        worst_rad = max(worst_rad, np.linalg.norm(rotation - theirs.rotation) / np.sqrt(2))
    print(f"Pinocchio {pin.__version__}: {len(joints)} configurations, largest difference {worst_m:.3e} m, {worst_rad:.3e} rad")
    return 0 if max(worst_m, worst_rad) < TOLERANCE else 1


if __name__ == "__main__":
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
