//! Measures the figures of the README and the guide again: `tests/measure_figures.sh`. What is affordable (some minutes) is measured and
//! written to [`FILE`](crate::figures::FILE) and into the pages; the commands of the rest stand in that file.
//!
//! `KINCAL_BENCH_OUTPUT` names what `cargo bench` printed, `KINCAL_DATA_DIR` the folder with measurements of real robots; without them
//! their figures stay as they are.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use serde_json::Value;
use tempfile::TempDir;

use crate::figures::{FILE, Figure, Figures, Group};
use crate::guide::{pages, root, write_pages};
use crate::harness::{command, number};

/// Four significant digits.
fn digits(value: f64) -> String {
    let before = if value == 0.0 { 1 } else { value.abs().log10().floor() as i32 + 1 };
    let text = format!("{value:.*}", (4 - before.max(0)).clamp(0, 6) as usize);
    text.replace('-', "−")
}

/// A rounded rate: two significant digits are all that a busy machine tells.
fn rate(value: f64) -> String {
    let step = 10f64.powi(value.log10().floor() as i32 - 1);
    let text = format!("{:.0}", (value / step).round() * step);
    if text.len() > 3 { format!("{} {}", &text[..text.len() - 3], &text[text.len() - 3..]) } else { text }
}

/// Runs `kincal`; its standard output.
fn output(out: &Path, arguments: &[&str]) -> String {
    let output = command(&[arguments, &["--quiet", "--out", out.to_str().unwrap()]].concat()).output().unwrap();
    // 1 is an answer, too.
    assert!(matches!(output.status.code(), Some(0 | 1)), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn json(out: &Path, arguments: &[&str]) -> Value {
    serde_json::from_str(&output(out, &[arguments, &["--json"]].concat())).unwrap()
}

/// Wall time of the best of `count` runs; where GNU time is there, its CPU time and peak memory, too.
fn time(out: &Path, arguments: &[&str], count: usize) -> String {
    let gnu = Path::new("/usr/bin/time");
    let mut best: Option<(f64, String)> = None;
    for _ in 0..count {
        let mut command = if gnu.exists() { Command::new(gnu) } else { Command::new(env!("CARGO_BIN_EXE_kincal")) };
        if gnu.exists() {
            command.args(["--quiet", "--format", "%U %S %M", env!("CARGO_BIN_EXE_kincal")]);
        }
        command.args(arguments).args(["--quiet", "--rerun", "off", "--out"]).arg(out);
        let start = Instant::now();
        let output = command.current_dir(root()).stdin(Stdio::null()).output().unwrap();
        let seconds = start.elapsed().as_secs_f64();
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(matches!(output.status.code(), Some(0 | 1)), "{arguments:?}: {stderr}");
        let used: Vec<f64> = stderr.lines().last().unwrap_or_default().split(' ').filter_map(|word| word.parse().ok()).collect();
        let used = match used[..] {
            [user, system, kb] => format!(" (CPU {}); {:.0} MB", in_seconds(user + system), kb / 1024.0),
            _ => String::new(),
        };
        if best.as_ref().is_none_or(|(least, _)| seconds < *least) {
            best = Some((seconds, used));
        }
    }
    let (seconds, used) = best.unwrap();
    in_seconds(seconds) + &used
}

fn in_seconds(seconds: f64) -> String {
    if seconds < 1.0 { format!("{seconds:.2} s") } else { format!("{seconds:.1} s") }
}

/// Lines of `text` that contain one of `wanted`, without spaces at their ends.
fn lines(text: &str, wanted: &[&str]) -> String {
    let chosen = text.lines().filter(|line| wanted.iter().any(|wanted| line.contains(wanted)));
    chosen.map(|line| format!("{}\n", line.trim_end())).collect()
}

/// In lines that fit the README.
fn wrapped(text: &str) -> String {
    let mut width = 0;
    let word = |word: &str| {
        let long = word.chars().count();
        let breaks = width > 0 && width + 1 + long > 120;
        let before = if breaks {
            "\n"
        } else if width > 0 {
            " "
        } else {
            ""
        };
        width = if breaks { long } else { width + before.len() + long };
        format!("{before}{word}")
    };
    text.split(' ').map(word).collect()
}

/// From the first line that contains `from` to the line before one that contains `to`, or to the end.
fn part(text: &str, from: &str, to: &str) -> String {
    let lines = text.lines().skip_while(|line| !line.contains(from)).take_while(|line| to.is_empty() || !line.contains(to));
    let text: String = lines.map(|line| format!("{}\n", line.trim_end())).collect();
    text.trim_end().to_owned() + "\n"
}

/// What is measured of a group: every figure, table and output that it has.
fn renew(figures: &mut Figures, name: &str, measure: impl FnOnce(&mut Group)) {
    println!("{name} …");
    let group = figures.measured.get_mut(name).unwrap_or_else(|| panic!("{FILE} has no group {name}"));
    measure(group);
    let git = Command::new("git").args(["rev-parse", "--short", "HEAD"]).current_dir(root()).output().unwrap();
    group.version = String::from_utf8(git.stdout).unwrap().trim().to_owned();
    let date = Command::new("date").arg("+%F").output().unwrap();
    group.date = String::from_utf8(date.stdout).unwrap().trim().to_owned();
    group.stale = None;
}

fn set(group: &mut Group, key: &str, value: String, unit: &str) {
    group.figures.insert(key.to_owned(), Figure { value, unit: unit.to_owned() });
}

fn mm(json: &Value, pointer: &str) -> String {
    digits(number(json, pointer) * 1e3)
}

const TUTORIAL: [&str; 7] =
    ["scenes/tutorial.csv", "--robot", "scenes/tutorial.urdf", "--position-noise-um", "29", "--attitude-noise-deg", "0.003"];

#[test]
#[ignore = "measures for minutes and writes the guide: tests/measure_figures.sh"]
fn figures() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let mut figures = Figures::read();
    renew(&mut figures, "main_job", |group| {
        let arguments = ["run", "scenes/arm8.toml"];
        let found = json(out, &arguments);
        set(group, "held_out_nominal", mm(&found, "/identification/held_out_nominal/position_m/rms"), "mm");
        set(group, "held_out_identified", mm(&found, "/identification/held_out/position_m/rms"), "mm");
        set(group, "noise", mm(&found, "/identification/declared_noise/position_m"), "mm");
        let text = output(out, &arguments);
        let sentence = wrapped(found["diagnosis"]["sentence"].as_str().unwrap());
        let errors = lines(&text, &["position mean (mm)", "held out (50)"]);
        let waterfall = lines(&text, &["held out, 5 folds", " geometry   ", "all that each fold uses", "noise floor"]);
        group.outputs.insert("summary".to_owned(), format!("{errors}\n{sentence}\n\n{waterfall}"));
    });
    renew(&mut figures, "tutorial", |group| {
        let identify = [&["identify"], &TUTORIAL[..]].concat();
        let found = json(out, &identify);
        set(group, "held_out_nominal", mm(&found, "/held_out_nominal/position_m/rms"), "mm");
        set(group, "held_out_identified", mm(&found, "/held_out/position_m/rms"), "mm");
        group.outputs.insert("identify".to_owned(), part(&output(out, &identify), "", "Recording  "));
        let diagnose = [&["diagnose"], &TUTORIAL[..]].concat();
        let report = output(out, &diagnose);
        group.outputs.insert("diagnose".to_owned(), part(&report, "", ""));
        let table = report.lines().filter(|line| [" cause ", " backlash "].iter().any(|begin| line.starts_with(begin)));
        let table: String = table.map(|line| format!("{}\n", line.trim_end())).collect();
        group.outputs.insert("cause".to_owned(), format!("{}\n{table}", part(&report, "", "Whole payloads")));
        let confirm = [&diagnose[..], &["--confirm"]].concat();
        group.outputs.insert("confirm".to_owned(), part(&output(out, &confirm), "The physics does", ""));
        let confirmation = &json(out, &confirm)["confirmation"];
        let um = |pointer| digits(number(confirmation, pointer) * 1e6);
        set(group, "confirm_geometry", um("/geometry_rms_m"), "µm");
        set(group, "confirm_physics", um("/steps/0/physics_rms_m"), "µm");
    });
    renew(&mut figures, "design", |group| {
        let chosen = ["--set", "design.criterion=i_optimality", "--set", "design.method=perturbation"];
        let report = output(out, &[&["design", "scenes/arm8.toml"], &chosen[..]].concat());
        group.outputs.insert("prediction".to_owned(), part(&report, "error that noise will leave  ", "The bound is"));
    });
    renew(&mut figures, "gap_sweep", |group| gap_sweep(group, out));
    renew(&mut figures, "coverage", |group| {
        let arguments = ["--effect", "radial_clearance", "--at", "3", "--magnitudes", "0um"];
        let design = ["--poses", "40", "--method", "random", "--trials", "600"];
        json(out, &[&["sweep", "scenes/arm8.toml"], &arguments[..], &design[..]].concat());
        let cell = &csv(&out.join("arm8-sweep.csv"))[0];
        let percent = |name: &str| format!("{:.1}", cell[name].parse::<f64>().unwrap() * 100.0);
        set(group, "share", percent("coverage"), "%");
        set(group, "interval", format!("{}–{}", percent("coverage_low95"), percent("coverage_high95")), "%");
    });
    renew(&mut figures, "effects", |group| {
        let listed = json(out, &["effects"]);
        let known = listed["effects"].as_array().unwrap().iter().filter(|kind| kind["known_to_the_diagnosis"] == true);
        set(group, "known", known.count().to_string(), "");
    });
    let mut slowest = f64::INFINITY;
    renew(&mut figures, "effect_validation", |group| slowest = effect_validation(group, out));
    renew(&mut figures, "commands", |group| commands(group, out, slowest));
    if let Some(data) = std::env::var_os("KINCAL_DATA_DIR").map(PathBuf::from) {
        renew(&mut figures, "real", |group| real(group, &data, &folder));
    }
    if let Some(benches) = std::env::var_os("KINCAL_BENCH_OUTPUT") {
        let printed = fs::read_to_string(benches).unwrap();
        renew(&mut figures, "benches", |group| benchmarks(group, &printed));
    }
    fs::write(root().join(FILE), figures.to_toml()).unwrap();
    write_pages(&figures);
    assert!(!pages().is_empty());
}

/// Rows of a CSV file by column name.
fn csv(path: &Path) -> Vec<std::collections::BTreeMap<String, String>> {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| names.iter().map(|name| (*name).to_owned()).zip(line.split(',').map(str::to_owned)).collect();
    lines.map(row).collect()
}

fn gap_sweep(group: &mut Group, out: &Path) {
    let arguments = ["--effect", "radial_clearance", "--at", "joint3", "--magnitudes", "0,10,30,60um"];
    let found = json(out, &[&["sweep", "scenes/gap.toml"], &arguments[..]].concat());
    let cells = csv(&out.join("gap-sweep.csv"));
    let mut rows = Vec::new();
    for (cell, of) in cells.iter().zip(found["cells"].as_array().unwrap()) {
        let value = |name: &str| cell[name].parse::<f64>().ok();
        let um = |name: &str| value(name).map_or("–".to_owned(), |metres| format!("{:.1}", metres * 1e6));
        let combinations = of["combinations"].as_array().unwrap();
        let size = |combination: &&Value| combination["bias_in_standard_errors"].as_f64().unwrap().abs();
        let largest = combinations.iter().max_by(|a, b| size(a).total_cmp(&size(b))).unwrap();
        let unit = if largest["unit"] == "m" { "µm" } else { "µrad" };
        let bias = digits_short(number(largest, "/bias/mean") * 1e6);
        let sigmas = digits_short(number(largest, "/bias_in_standard_errors"));
        let magnitude = value("magnitude").unwrap() * 1e6;
        let held_out = um("held_out_rms_m");
        match magnitude.round() as i64 {
            0 => set(group, "held_out_none", held_out.clone(), "µm"),
            30 => {
                set(group, "held_out_30", held_out.clone(), "µm");
                set(group, "bias_30", bias.clone(), "µm");
            }
            _ => {}
        }
        rows.push(vec![
            if magnitude == 0.0 { "none".to_owned() } else { format!("{magnitude:.0} µm") },
            format!("{held_out} ({}–{})", um("held_out_rms_m_low95"), um("held_out_rms_m_high95")),
            um("effect_rms_m"),
            value("swallowed").map_or("–".to_owned(), |share| format!("{:.0} %", share * 100.0)),
            format!("{} {bias} {unit} ({sigmas} σ)", largest["name"].as_str().unwrap()),
            format!("{:.1} %", value("coverage").unwrap() * 100.0),
            format!("{:.2}", value("residuals_over_noise").unwrap()),
        ]);
    }
    group.tables.get_mut("cells").unwrap().rows = rows;
}

/// Three significant digits or so, as they stand in a table.
fn digits_short(value: f64) -> String {
    format!("{value:.*}", if value.abs() < 1.0 { 2 } else { 1 }).replace('-', "−")
}

/// Fills the table; the slowest rate of any single effect.
fn effect_validation(group: &mut Group, out: &Path) -> f64 {
    let found = json(out, &["effects", "scenes/arm8.toml"]);
    let mut slowest = f64::INFINITY;
    let mut rows = Vec::new();
    for line in found["effects"].as_array().unwrap() {
        let um = |key: &str| match line[key].as_f64() {
            None => "–".to_owned(),
            Some(metres) if metres < 1e-10 => "< 0.0001".to_owned(),
            Some(metres) => digits(metres * 1e6),
        };
        let relative = line["largest_relative"].as_f64().unwrap_or_default();
        let relative = if relative >= 1e-4 { format!(" ({:.2} %)", relative * 100.0) } else { String::new() };
        let speed = number(line, "/poses_per_s");
        let magnitude = line["magnitude"].as_str().unwrap();
        let name = line["name"].as_str().unwrap();
        if !name.contains(',') && !magnitude.contains("in all joints") {
            slowest = slowest.min(speed);
        }
        rows.push(vec![
            name.to_owned(),
            magnitude.to_owned(),
            um("displacement_rms_m"),
            um("largest_m") + &relative,
            um("settling_error_m"),
            um("first_order_misses_m"),
            rate(speed),
        ]);
    }
    group.tables.get_mut("kinds").unwrap().rows = rows;
    slowest
}

/// Sets the last cell of the row that begins with `first`.
fn cell(group: &mut Group, table: &str, first: &str, value: String) {
    let rows = &mut group.tables.get_mut(table).unwrap().rows;
    let row = rows.iter_mut().find(|row| row[0].starts_with(first)).unwrap_or_else(|| panic!("no row {first}"));
    *row.last_mut().unwrap() = value;
}

fn commands(group: &mut Group, out: &Path, slowest: f64) {
    cell(group, "time", "`kincal run scenes/arm8.toml`", time(out, &["run", "scenes/arm8.toml"], 3));
    let blind = out.join("blind");
    let new = ["challenge", "new", "--cases", "500", "--seed", "7391284650193847"];
    cell(group, "time", "500 blind cases", time(&blind, &new, 1));
    let case = blind.join("case-0001.mcap");
    cell(group, "time", "`kincal diagnose`", time(out, &["diagnose", case.to_str().unwrap()], 3));
    cell(group, "time", "`kincal effects scenes/arm8.toml`", format!("{} poses/s and more", rate(slowest)));
    let sweep = ["sweep", "scenes/arm8.toml", "--effect", "radial_clearance", "--at", "joint3", "--magnitudes", "30um"];
    let design = ["--poses", "40", "--method", "random", "--trials", "10000"];
    // Not where another sweep has begun.
    let sweeps = out.join("sweeps");
    cell(group, "time", "`kincal sweep`", time(&sweeps, &[&sweep[..], &design[..]].concat(), 1));
}

fn real(group: &mut Group, data: &Path, folder: &TempDir) {
    let path = |name: &str| data.join(name).to_str().unwrap().to_owned();
    let (robot, grid, random) = (path("ur5_tracker/ur5.urdf"), path("ur5_tracker/grid.csv"), path("ur5_tracker/random.csv"));
    let identify = ["identify", &grid, "--robot", &robot, "--evaluate", &random, "--position-noise-um", "25"];
    let found = json(folder.path(), &identify);
    set(group, "ur5_identify_nominal", mm(&found, "/held_out_nominal/position_m/rms"), "mm");
    set(group, "ur5_identify", mm(&found, "/held_out/position_m/rms"), "mm");
    for (row, table, robot) in [
        ("UR5, 1000", "ur5_tracker/grid.csv", "ur5_tracker/ur5.urdf"),
        ("UR10, series B", "ur10_tracker/series_b.csv", "ur10_tracker/ur10.urdf"),
        ("UR10, series D", "ur10_tracker/series_d.csv", "ur10_tracker/ur10.urdf"),
        ("FR3", "fr3_camera/poses.csv", "fr3_camera/fr3.urdf"),
    ] {
        let found = json(folder.path(), &["diagnose", &path(table), "--robot", &path(robot)]);
        let um = |pointer: &str| format!("{:.0}", number(&found, pointer) * 1e6);
        let rows = &mut group.tables.get_mut("gaps").unwrap().rows;
        let cells = rows.iter_mut().find(|cells| cells[0].starts_with(row)).unwrap();
        cells[1] = format!("{} → {}", um("/gap/geometry_rms_m"), um("/gap/explained_rms_m"));
        let source = match found["noise_floor"]["source"].as_str().unwrap() {
            "repeats" => "repeats",
            "declared" => "declared",
            _ => "assumed",
        };
        cells[2] = format!("{} ({source})", um("/gap/noise_rms_m"));
        cells[3] = found["sentence"].as_str().unwrap().to_owned();
    }
}

/// Medians from what `cargo bench` printed (divan's tree).
fn benchmarks(group: &mut Group, printed: &str) {
    let mut parent = String::new();
    let mut medians = std::collections::BTreeMap::new();
    for line in printed.lines().filter(|line| line.contains('─')) {
        let depth = line.find(['├', '╰']).unwrap_or(0);
        let columns: Vec<&str> = line.split('│').map(str::trim).collect();
        let label = columns
            .iter()
            .find(|column| column.contains('─'))
            .map_or("", |column| column.trim_start_matches(['├', '╰', '─', ' ']));
        let label = label.split_whitespace().next().unwrap_or_default().to_owned();
        let name = if depth == 0 { label.clone() } else { format!("{parent}/{label}") };
        if depth == 0 {
            parent.clone_from(&label);
        }
        // fastest │ slowest │ median │ mean │ …
        let at = columns.iter().position(|column| column.contains('─')).unwrap();
        if let Some(median) = columns.get(at + 2).filter(|median| median.starts_with(|c: char| c.is_ascii_digit())) {
            medians.insert(name, (*median).to_owned());
        }
    }
    for row in &mut group.tables.get_mut("medians").unwrap().rows {
        // The benchmark's name stands in the first cell, as code.
        let name = row[0].split('`').nth(1).unwrap_or_default().to_owned();
        let of: Vec<String> = medians
            .iter()
            .filter(|(key, _)| **key == name || key.starts_with(&format!("{name}/")))
            .map(|(key, median)| match key.split_once('/') {
                Some((_, argument)) => format!("{median} (`{}`)", argument.trim_end_matches(".toml")),
                None => median.clone(),
            })
            .collect();
        assert!(!of.is_empty(), "no benchmark {name} in {medians:#?}");
        row[2] = of.join(", ");
    }
}
