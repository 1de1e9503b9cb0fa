"""Reads a recording with the libraries of others and checks that it is what it says it is.

    python3 -m venv venv && venv/bin/pip install -r tests/python/requirements.txt
    venv/bin/python tests/python/check_recording.py recordings/arm8.mcap

Prints topics, schemas and counts and one decoded message of every topic's kind; ends with 1 if something is wrong.
"""

import json
import sys
from collections import Counter

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def main(path):
    counts, schemas, firsts, problems = Counter(), {}, {}, []
    last_time = 0
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        if summary is None or summary.statistics is None:
            problems.append("there is no summary")
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            topic = channel.topic
            counts[topic] += 1
            schemas[topic] = (schema.name, schema.encoding, channel.message_encoding)
            if message.log_time < last_time:
                problems.append(f"{topic}: time goes backwards at {message.log_time} ns")
            last_time = message.log_time
            if channel.message_encoding == "json":
                decoded = json.loads(message.data)
                described = json.loads(schema.data)["properties"].keys()
                if not decoded.keys() <= described:
                    problems.append(f"{topic}: {decoded.keys() - described} are not in the schema")
            else:
                decoded = DecoderFactory().decoder_for(channel.message_encoding, schema)(message.data)
            firsts.setdefault(topic, decoded)
        if summary is not None and summary.statistics.message_count != sum(counts.values()):
            problems.append(f"the summary counts {summary.statistics.message_count} messages, not {sum(counts.values())}")

    print(f"{path}: {sum(counts.values())} messages on {len(counts)} topics, {last_time * 1e-9:.1f} s of simulated time")
    for topic, count in sorted(counts.items()):
        name, encoding, _ = schemas[topic]
        print(f"  {topic:36} {count:6}  {name} ({encoding})")
    if "/run" in firsts:
        print(f"kincal {firsts['/run']['version']}, command {firsts['/run']['command']}")
        if "injected" in firsts["/run"]["scene"]:
            problems.append("/run: the scene has its hidden part")
    for topic in ("/measurement/pose_measured", "/measurement/pose_nominal"):
        if topic in firsts:
            pose = firsts[topic].pose
            p, q = pose.position, pose.orientation
            print(f"first {topic} in {firsts[topic].frame_id}: ({p.x:.6f}, {p.y:.6f}, {p.z:.6f}) m, "
                  f"({q.x:.6f}, {q.y:.6f}, {q.z:.6f}, {q.w:.6f})")
            if abs(q.x**2 + q.y**2 + q.z**2 + q.w**2 - 1) > 1e-12:
                problems.append(f"{topic}: the quaternion is no rotation")
    for problem in problems:
        print("wrong:", problem)
    print("well-formed" if not problems else f"{len(problems)} problems")
    return 1 if problems else 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1]))
