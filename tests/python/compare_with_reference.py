#!/usr/bin/env python3
"""Compares kincal's diagnosis with the plain reference analyser, side by side on the same exported tables.

    python3 -m venv venv && venv/bin/pip install numpy scipy
    seed=$(od -An -N8 -tu8 /dev/urandom | tr -d ' ')
    kincal challenge new --seed $seed --cases 40 --effects 1..3 --outside 1 --out cases/mixed
    kincal challenge new --seed $seed --cases 20 --effects 5..15 --out cases/many
    kincal challenge new --seed $seed --cases 40 --effects 1..3 --soft --out cases/soft
    venv/bin/python tests/python/compare_with_reference.py cases/mixed cases/many cases/soft \\
        --kincal target/release/kincal --reference ../shared/tools/reference_diagnose.py --work compared

Every case's recording is written as a table and a URDF by `kincal export`; from then on both programs see nothing else, but for the noise
that the sensor declares, which both are told. Only when all cases of a folder are diagnosed, copies of the folder are scored by
`kincal challenge score --verdicts`, once with each program's answers, which opens the seal. The folder itself is not touched.

What is counted, as `kincal challenge score` counts it:
  recall      of the true effects that are in the library and have this λ at least: named with 50 % or more, right kind, right place
  precision   of all that is named with 50 % or more: right kind, right place, whatever its λ
  flagged     of the cases with something outside the library of λ >= 60: the verdict says that something unknown remains
  unknown     of the cases with nothing outside the library: the verdict says so all the same, which is wrong
  wall, CPU   seconds per case of the whole process, with the start of Python (about 0.4 s) for the reference

The reference is treated fairly: what it does not read in a table (`role`, `dwell_s`) is taken out, as it refuses the table otherwise;
its effects may be 20 (--max-effects); recall is also given of the kinds that it knows, as it is older than some of kincal's; where several
variants of a kind are told for one place, each counts as right; where both give the same kind another name, --rename maps it. Its search
may go in circles for ever; it is stopped there and answers with what it has, and how often is said. (A copy with that one guard is run, if
the line that it guards is found. Where the search ends by itself the copy does the same.) Where a program fails on a case, or takes more than
--limit-cpu seconds, it has named nothing there, and the case is listed.

--work keeps everything: tables, answers, times. Answers are used again where table, program and options are the same, so that a newer
kincal costs only its own time; --again runs everything anew. Times of answers that are used again are those of their first run.
Ends with 1 if the counts differ from those of `kincal challenge score`.
"""

import argparse
import hashlib
import json
import os
import re
import resource
import shutil
import statistics
import subprocess
import sys
import time
from pathlib import Path

NAMED = 0.5  # From this probability on an effect counts as named, as in src/lab/challenge/score.rs.
FLAGGED_FROM = 60.0  # λ from which what is outside the library must be flagged; the same source.
UNREAD = {"role", "dwell_s"}  # Columns of kincal's tables that the reference refuses.
# Kinds of kincal's library that the reference has no hypothesis for.
NOT_KNOWN_TO_REFERENCE = {"base_tilt"}
# The reference's search, and the same one that ends where it comes to a set that it has been at. It is deterministic: it would go on for ever.
ENDLESS = "        while len(S) < most:\n"
CIRCLES = "the search goes in circles"
ENDING = f"""        seen = set()
        while len(S) < most:
            if tuple(S) in seen:
                print({CIRCLES!r}, file=sys.stderr)
                break
            seen.add(tuple(S))
"""
# The reference's name of a kind, where kincal's is another one. The reference was written to the same list: they are alike.
SAME_KIND = {}
PROGRAMS = ("kincal", "reference")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER", help="cases made by `kincal challenge new`")
    parser.add_argument("--kincal", type=Path, required=True, help="the program")
    parser.add_argument("--reference", type=Path, required=True, help="reference_diagnose.py")
    parser.add_argument("--work", type=Path, required=True, help="folder for tables and answers; made if it is not there")
    parser.add_argument("--max-effects", type=int, default=20, help="how many effects the reference may tell [default: 20]")
    parser.add_argument("--limit-cpu", type=int, default=300, help="seconds of CPU that an answer may take [default: 300]")
    parser.add_argument("--threads", type=int, help="threads of kincal [default: its own]")
    parser.add_argument("--rename", action="append", default=[], metavar="KIND=KIND", help="the reference's name = kincal's name")
    parser.add_argument("--limit", type=int, help="only so many cases of a folder are diagnosed, for a quick look; the score is not checked")
    parser.add_argument("--again", action="store_true", help="use no earlier answers")
    parser.add_argument("--json", action="store_true", help="print one JSON object, with what each case missed, in place of the table")
    return parser.parse_args()


def digest(*parts):
    """SHA-256 of files and words."""
    sum_ = hashlib.sha256()
    for part in parts:
        data = part.read_bytes() if isinstance(part, Path) else str(part).encode()
        sum_.update(len(data).to_bytes(8, "little"))
        sum_.update(data)
    return sum_.hexdigest()


def measured(command, folder, most):
    """Runs a command; gives exit code, stdout, stderr, wall and CPU seconds of it and its threads."""
    with open(folder / "stdout", "w+b") as out, open(folder / "stderr", "w+b") as err:
        start = time.perf_counter()
        process = subprocess.Popen([str(word) for word in command], stdout=out, stderr=err, stdin=subprocess.DEVNULL,
                                   preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (most, most)))
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        err.seek(0)
        texts = out.read().decode("utf-8", "replace"), err.read().decode("utf-8", "replace")
    return process.returncode, *texts, wall, usage.ru_utime + usage.ru_stime


def export(args, recording, folder):
    """Writes a recording as table and URDF; gives both, and the declared noise as kincal says it."""
    folder.mkdir(parents=True, exist_ok=True)
    said = folder / "noise.json"
    table, robot = folder / f"{recording.stem}.csv", folder / f"{recording.stem}.urdf"
    key = digest(recording, args.kincal)
    if said.exists() and json.loads(said.read_text())["key"] == key and table.exists() and robot.exists():
        return table, robot, json.loads(said.read_text())
    notes = ""
    for format_ in ("csv", "urdf"):
        command = [args.kincal, "export", recording, "--to", format_, "--out", folder, "--rerun", "off"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"kincal export {recording}: {done.stderr}")
        notes += done.stderr
    noise = re.search(r"--position-noise-um (\S+) --attitude-noise-deg (\S+)", notes)
    if not noise:
        sys.exit(f"kincal export {recording} does not say the declared noise:\n{notes}")
    found = {"key": key, "position_um": float(noise[1]), "attitude_deg": float(noise[2])}
    said.write_text(json.dumps(found))
    return table, robot, found


def without_unread(table):
    """The table without what the reference does not read."""
    lines = [line.split(",") for line in table.read_text().splitlines()]
    keep = [index for index, name in enumerate(lines[0]) if name not in UNREAD]
    reduced = table.with_name("for-reference.csv")
    reduced.write_text("".join(",".join(line[index] for index in keep) + "\n" for line in lines))
    return reduced


def ask(args, program, recording, folder):
    """What a program says of a case: verdict (or none), why not, seconds."""
    table, robot, noise = export(args, recording, folder)
    if program == "kincal":
        command = [args.kincal, "diagnose", table, "--robot", robot, "--position-noise-um", noise["position_um"],
                   "--attitude-noise-deg", noise["attitude_deg"], "--json", "--rerun", "off", "--out", folder]
        command += ["--threads", args.threads] if args.threads else []
        source = args.kincal
    else:
        table = without_unread(table)
        command = [sys.executable, args.ending_reference, table, "--robot", robot, "--declared-noise-um", noise["position_um"], "--json",
                   "--max-effects", args.max_effects]
        source = args.reference
    answers = folder / program
    answers.mkdir(exist_ok=True)
    kept = answers / "answer.json"
    key = digest(source, table, robot, *map(str, command[2:]))
    if kept.exists() and not args.again:
        answer = json.loads(kept.read_text())
        if answer["key"] == key:
            return {**answer, "used_again": True}
    code, out, err, wall, cpu = measured(command, answers, args.limit_cpu)
    answer = {"key": key, "exit_code": code, "wall_s": wall, "cpu_s": cpu, "verdict": None, "failure": None, "circles": CIRCLES in err}
    try:
        answer["verdict"] = json.loads(out)
    except json.JSONDecodeError:
        answer["failure"] = (err.strip().splitlines() or [f"exit code {code}, nothing printed"])[-1][:200]
    kept.write_text(json.dumps(answer))
    return {**answer, "used_again": False}


def renamed(verdict, names):
    """The verdict with kincal's names; one who failed has said nothing."""
    if verdict is None:
        return {"verdict": "no_gap", "effects": [], "confusion_sets": [], "unknown": {"present": False}}
    for effect in verdict.get("effects", []) + [one for some in verdict.get("confusion_sets", []) for one in some]:
        effect["kind"] = names.get(effect["kind"], effect["kind"])
    return verdict


def scored(args, folder, work, program, verdicts):
    """Scores verdicts by `kincal challenge score` in a copy of the folder; gives the truths, and the score."""
    mine, copy = work / f"verdicts-{program}", work / f"scored-{program}"
    for path in (mine, copy):
        shutil.rmtree(path, ignore_errors=True)
    mine.mkdir(parents=True)
    copy.mkdir(parents=True)
    for name in [path for path in folder.iterdir() if path.suffix == ".mcap"] + [folder / "manifest.json", folder / "sealed.truth",
                                                                                folder / "commitment.txt"]:
        shutil.copy(name, copy)
    for name, verdict in verdicts.items():
        (mine / f"{name}.json").write_text(json.dumps(verdict))
    command = [args.kincal, "challenge", "score", copy, "--verdicts", mine, "--json", "--rerun", "off"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"kincal challenge score {copy}: {done.stderr}")
    return json.loads((copy / "truth.json").read_text()), json.loads(done.stdout)["score"]


def place(location):
    return location["level"], location.get("index")


def text(kind, where):
    return kind + (f" {where[1]}" if where[1] else "")


def share(part, whole):
    return {"of": whole, "are": part, "share": part / whole if whole else None}


def counted(truths, verdicts, answers, withheld):
    """Counts of one program on one folder."""
    outside = lambda effect: not effect["known"] or effect["kind"] in withheld
    strength = lambda effect: effect["lambda"] or 0.0
    recall = {40: [0, 0], 60: [0, 0]}
    its_own = {40: [0, 0], 60: [0, 0]}
    right = named = flagged = to_flag = unknown = quiet = 0
    cases = []
    for truth in truths:
        name = Path(truth["file"]).stem
        verdict, answer = verdicts[name], answers[name]
        claims = [(effect["kind"], place(effect["location"])) for effect in verdict["effects"] if effect.get("probability", 1.0) >= NAMED]
        library = [effect for effect in truth["effects"] if not outside(effect)]
        there = {(effect["kind"], place(effect["location"])) for effect in library}
        for effect in library:
            found = (effect["kind"], place(effect["location"])) in claims
            for least in (least for least in recall if strength(effect) >= least):
                for counts in [recall] + ([] if effect["kind"] in NOT_KNOWN_TO_REFERENCE else [its_own]):
                    counts[least][0] += found
                    counts[least][1] += 1
        named += len(claims)
        right += sum(claim in there for claim in claims)
        says_unknown = verdict["verdict"] == "unknown_remains" or bool(verdict.get("unknown", {}).get("present"))
        strange = [effect for effect in truth["effects"] if outside(effect)]
        if any(strength(effect) >= FLAGGED_FROM for effect in strange):
            to_flag += 1
            flagged += says_unknown
        if not strange:
            quiet += 1
            unknown += says_unknown
        missed = [effect for effect in library if strength(effect) >= 40 and (effect["kind"], place(effect["location"])) not in claims]
        cases.append({
            "case": name,
            "missed": [f"{text(effect['kind'], place(effect['location']))} (λ {strength(effect):.0f})" for effect in missed],
            "wrong": [text(*claim) for claim in claims if claim not in there],
            "outside": [f"{text(effect['kind'], place(effect['location']))} (λ {strength(effect):.0f})" for effect in strange],
            "says_unknown": says_unknown,
            "failure": answer["failure"],
            "wall_s": answer["wall_s"],
            "cpu_s": answer["cpu_s"],
        })
    seconds = lambda key: [answers[Path(truth["file"]).stem][key] for truth in truths]
    times = {key: {"median": statistics.median(seconds(key)), "total": sum(seconds(key))} for key in ("wall_s", "cpu_s")}
    return {
        "cases": len(truths),
        "recall_40": share(*recall[40]),
        "recall_60": share(*recall[60]),
        "recall_40_of_kinds_known_to_both": share(*its_own[40]),
        "recall_60_of_kinds_known_to_both": share(*its_own[60]),
        "precision": share(right, named),
        "flagged_60": share(flagged, to_flag),
        "unknown_without_outsider": share(unknown, quiet),
        "failed": sum(case["failure"] is not None for case in cases),
        "went_in_circles": sum(answers[Path(truth["file"]).stem]["circles"] for truth in truths),
        "times_used_again": sum(answers[Path(truth["file"]).stem]["used_again"] for truth in truths),
        **times,
        "by_case": cases,
    }


def differences(found, score, truths, withheld):
    """Where the counts are not those of `kincal challenge score`."""
    outside = lambda effect: not effect["known"] or effect["kind"] in withheld
    pairs = []
    if all(truth["effects"] and any(map(outside, truth["effects"])) and not all(map(outside, truth["effects"])) for truth in truths):
        mixed = score["mixed"]
        pairs = [("recall_60", mixed["visible_found"], mixed["visible_effects"]), ("precision", mixed["named_right"], mixed["named"]),
                 ("flagged_60", mixed["flagged"], mixed["visible_outside"])]
    elif all(len(truth["effects"]) > 1 and not any(map(outside, truth["effects"])) for truth in truths):
        several = score["several"]
        pairs = [("recall_40", several["visible_found"], several["visible_effects"]),
                 ("precision", several["named_right"], several["named"])]
    return [f"{key}: {found[key]['are']} of {found[key]['of']} here, {are} of {of} in the score"
            for key, are, of in pairs if (found[key]["are"], found[key]["of"]) != (are, of)]


def table_of(results):
    head = ["cases", "program", "recall λ≥40", "λ≥60", "λ≥60, kinds of both", "precision", "flagged λ≥60", "unknown, none there",
            "wall s: median", "total", "CPU s: median", "total", "failed"]
    of = lambda one: "–" if one["share"] is None else f"{one['are']}/{one['of']} {100 * one['share']:.0f} %"
    rows = [head]
    for folder, programs in results.items():
        for program, found in programs.items():
            rows.append([f"{found['cases']} {folder}", program, of(found["recall_40"]), of(found["recall_60"]),
                         of(found["recall_60_of_kinds_known_to_both"]), of(found["precision"]), of(found["flagged_60"]),
                         of(found["unknown_without_outsider"]), *(f"{found[key][what]:.2f}" for key in ("wall_s", "cpu_s")
                                                                  for what in ("median", "total")), str(found["failed"])])
    widths = [max(len(row[column]) for row in rows) for column in range(len(head))]
    line = lambda row: "  ".join(cell.ljust(width) if column < 2 else cell.rjust(width)
                                 for column, (cell, width) in enumerate(zip(row, widths))).rstrip()
    return "\n".join([line(head), "─" * len(line(head))] + [line(row) for row in rows[1:]])


def main():
    args = arguments()
    names = {**SAME_KIND, **dict(pair.split("=", 1) for pair in args.rename)}
    for path in (args.kincal, args.reference):
        if not path.is_file():
            sys.exit(f"{path} is no file")
    args.kincal = args.kincal.resolve()
    args.work.mkdir(parents=True, exist_ok=True)
    args.ending_reference = args.work / "reference-that-ends.py"
    args.ending_reference.write_text(args.reference.read_text().replace(ENDLESS, ENDING))
    results, wrong = {}, []
    for folder in args.folders:
        work = args.work / folder.name
        recordings = sorted(folder.glob("case-*.mcap"))[:args.limit]
        if not recordings:
            sys.exit(f"{folder} holds no cases; make some with `kincal challenge new`")
        if folder.name in results:
            sys.exit(f"two folders are called {folder.name}")
        withheld = json.loads((folder / "manifest.json").read_text())["withheld"]
        answers = {program: {} for program in PROGRAMS}
        for number, recording in enumerate(recordings, 1):
            for program in PROGRAMS:
                answers[program][recording.stem] = ask(args, program, recording, work / recording.stem)
            print(f"\r{folder.name}: {number} of {len(recordings)}", end="", file=sys.stderr, flush=True)
        print("", file=sys.stderr)
        results[folder.name] = {}
        for program in PROGRAMS:
            verdicts = {name: renamed(answer["verdict"], names if program == "reference" else {})
                        for name, answer in answers[program].items()}
            everything = {path.stem: verdicts.get(path.stem, renamed(None, {})) for path in folder.glob("case-*.mcap")}
            truths, score = scored(args, folder, work, program, everything)
            truths = [truth for truth in truths if Path(truth["file"]).stem in verdicts]
            found = counted(truths, verdicts, answers[program], withheld)
            results[folder.name][program] = found
            if args.limit is None:
                wrong += [f"{folder.name}, {program}, {one}" for one in differences(found, score, truths, withheld)]
    version = subprocess.run([args.kincal, "--version"], capture_output=True, text=True, check=False).stdout.strip()
    if args.json:
        print(json.dumps({"version": version, "max_effects": args.max_effects, "folders": results, "differs_from_score": wrong}, indent=1))
    else:
        print(f"{version} ({digest(args.kincal)[:12]}) and {args.reference.name} ({digest(args.reference)[:12]}), the same tables\n")
        print(table_of(results))
        for folder, programs in results.items():
            for program, found in programs.items():
                if found["times_used_again"]:
                    print(f"times of {program} on {folder}: {found['times_used_again']} of {found['cases']} are of an earlier run")
                if found["went_in_circles"]:
                    print(f"the search of {program} on {folder} went in circles in {found['went_in_circles']} of {found['cases']} cases, "
                          "and was stopped there")
                for case in (case for case in found["by_case"] if case["failure"]):
                    print(f"{program} failed on {folder} {case['case']}: {case['failure']}")
    for one in wrong:
        print(f"differs from `kincal challenge score`: {one}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
