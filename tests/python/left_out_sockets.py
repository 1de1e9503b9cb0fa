"""Ball in two sockets (`mukca_sockets`): scatter of the sockets of a block that was left out, before and after.

    python3 tests/python/left_out_sockets.py DATA_DIR [KINCAL]

Of each robot every session (a place of the block) is left out once; kincal identifies the arm from the others, and the readings of a
left-out socket are compared with their own mean. Standard library only.
"""
import csv
import json
import pathlib
import subprocess
import sys
import tempfile


def main():
    data = pathlib.Path(sys.argv[1]) / "mukca_sockets"
    kincal = sys.argv[2] if len(sys.argv) > 2 else "target/release/kincal"
    print("robot      left out         readings   nominal (mm RMS)   identified")
    for table, robot in [("panda_1", "panda"), ("panda_3", "panda"), ("kuka_14", "iiwa14")]:
        rows = list(csv.DictReader(open(data / f"{table}.csv")))
        sums = [0.0, 0.0, 0]
        for session in sorted({row["session"] for row in rows}):
            with tempfile.TemporaryDirectory() as folder:
                path = pathlib.Path(folder) / "m.csv"
                with open(path, "w", newline="") as file:
                    writer = csv.DictWriter(file, [*rows[0], "role"])
                    writer.writeheader()
                    for row in rows:
                        writer.writerow({**row, "role": "held_out" if row["session"] == session else "fit"})
                known = [line for line in open(data / f"{table}_distances.csv") if not line.startswith(session)]
                distances = pathlib.Path(folder) / "d.csv"
                distances.write_text("".join(known))
                command = [kincal, "--json", "-q", "--rerun", "off", "--out", folder, "identify", path, "--robot",
                           data / f"{robot}.urdf", "--tip-link", "ball_link", "--distances", distances]
                found = json.loads(subprocess.run(command, capture_output=True, text=True).stdout)
            before, after = found["held_out_nominal"]["position_m"]["rms"], found["held_out"]["position_m"]["rms"]
            count = found["held_out"]["count"]
            print(f"{table:10} {session:16} {count:8} {1e3 * before:18.3f} {1e3 * after:12.3f}")
            sums = [sums[0] + count * before**2, sums[1] + count * after**2, sums[2] + count]
        before, after = (1e3 * (total / sums[2]) ** 0.5 for total in sums[:2])
        print(f"{table:10} {'all':16} {sums[2]:8} {before:18.3f} {after:12.3f}   {100 * (1 - after / before):.1f} % gone")


main()
