//! The measured figures of the README and the guide: each stands once, in `src/guide/figures.toml`, with the command and the version
//! that made it. Pages repeat them between marks, and [`fill`] writes what stands between the marks.
//!
//! In a page:
//! - `<!-- group.key -->12.3 mm<!-- -->` is one figure, value and unit;
//! - `<!-- table: group.key -->` before a table: its rows (not its heading) are the group's;
//! - `<!-- output: group.key -->` before a fenced block: what a command printed.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;

use serde::Deserialize;

use crate::guide::{Page, pages, root};

/// Where all figures stand.
pub(crate) const FILE: &str = "src/guide/figures.toml";

/// What one measurement gave.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Group {
    /// How to measure it again.
    pub(crate) command: String,
    /// Commit that was measured.
    pub(crate) version: String,
    /// Day on which it was measured.
    pub(crate) date: String,
    /// Why it has to be measured again, where that is known.
    #[serde(default)]
    pub(crate) stale: Option<String>,
    #[serde(default)]
    pub(crate) figures: BTreeMap<String, Figure>,
    #[serde(default)]
    pub(crate) tables: BTreeMap<String, Table>,
    #[serde(default)]
    pub(crate) outputs: BTreeMap<String, String>,
}

/// A number as it is printed, and its unit.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Figure {
    pub(crate) value: String,
    pub(crate) unit: String,
}

/// The rows of a table, cell by cell as Markdown.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Table {
    pub(crate) rows: Vec<Vec<String>>,
}

/// The file: groups of figures, and the numbers of each page that are chosen, not measured.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Figures {
    pub(crate) measured: BTreeMap<String, Group>,
    /// By page: numbers with a unit that nobody measured, such as settings, thresholds and what others have published.
    pub(crate) given: BTreeMap<String, Vec<String>>,
}

impl Figure {
    fn text(&self) -> String {
        format!("{} {}", self.value, self.unit).trim().to_owned()
    }
}

impl Figures {
    /// Reads [`FILE`].
    pub(crate) fn read() -> Figures {
        toml::from_str(&fs::read_to_string(root().join(FILE)).unwrap()).unwrap_or_else(|error| panic!("{FILE}: {error}"))
    }

    /// The file's text.
    pub(crate) fn to_toml(&self) -> String {
        let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
        let mut text = "# Every measured figure of the README and the guide, by the measurement that made it. `tests/measure_figures.sh`\n\
                        # measures again what is affordable and writes this file and the pages; the commands of the rest stand here.\n"
            .to_owned();
        for (name, group) in &self.measured {
            write!(text, "\n[measured.{name}]\ncommand = {}\n", quoted(&group.command)).unwrap();
            write!(text, "version = {}\ndate = {}\n", quoted(&group.version), quoted(&group.date)).unwrap();
            if let Some(stale) = &group.stale {
                writeln!(text, "stale = {}", quoted(stale)).unwrap();
            }
            if !group.figures.is_empty() {
                writeln!(text, "[measured.{name}.figures]").unwrap();
            }
            for (key, figure) in &group.figures {
                writeln!(text, "{key} = {{ value = {}, unit = {} }}", quoted(&figure.value), quoted(&figure.unit)).unwrap();
            }
            for (key, table) in &group.tables {
                writeln!(text, "[measured.{name}.tables.{key}]\nrows = [").unwrap();
                for row in &table.rows {
                    let cells: Vec<String> = row.iter().map(|cell| quoted(cell)).collect();
                    writeln!(text, "    [{}],", cells.join(", ")).unwrap();
                }
                text += "]\n";
            }
            if !group.outputs.is_empty() {
                writeln!(text, "[measured.{name}.outputs]").unwrap();
            }
            for (key, output) in &group.outputs {
                assert!(!output.contains("'''"), "{output}");
                writeln!(text, "{key} = '''\n{output}'''").unwrap();
            }
        }
        text += "\n# Numbers with a unit that are chosen or quoted, not measured: settings, thresholds, what others have published.\n[given]\n";
        for (page, numbers) in &self.given {
            writeln!(text, "{} = [", quoted(page)).unwrap();
            let mut line = String::new();
            for number in numbers {
                let cell = format!("{}, ", quoted(number));
                if line.len() + cell.len() > 120 {
                    writeln!(text, "    {}", line.trim_end()).unwrap();
                    line.clear();
                }
                line += &cell;
            }
            write!(text, "    {}\n]\n", line.trim_end()).unwrap();
        }
        text
    }

    fn group<'a>(&'a self, key: &'a str) -> Option<(&'a Group, &'a str)> {
        let (group, key) = key.split_once('.')?;
        Some((self.measured.get(group)?, key))
    }

    /// `page` with every figure as the file has it.
    ///
    /// # Errors
    /// What is wrong with the page's marks.
    pub(crate) fn fill(&self, page: &Page, used: &mut BTreeSet<String>) -> Result<String, String> {
        let mut filled = String::new();
        let mut lines = page.text.lines().peekable();
        let mut fenced = false;
        while let Some(line) = lines.next() {
            fenced ^= line.trim_start().starts_with("```");
            if fenced {
                filled += line;
                filled.push('\n');
            } else if let Some(key) = block(line, "table") {
                used.insert(key.to_owned());
                let (group, name) = self.group(key).ok_or(format!("{}: no figures {key}", page.name))?;
                let table = group.tables.get(name).ok_or(format!("{}: no table {key}", page.name))?;
                filled += line;
                filled.push('\n');
                let (mut heading, mut width) = (0, 0);
                while heading < 2 {
                    let next = lines.next().ok_or(format!("{}: no table follows {key}", page.name))?;
                    heading += usize::from(next.starts_with('|'));
                    width = next.matches('|').count().saturating_sub(1);
                    filled += next;
                    filled.push('\n');
                }
                while lines.peek().is_some_and(|line| line.starts_with('|')) {
                    lines.next();
                }
                if let Some(row) = table.rows.iter().find(|row| row.len() != width) {
                    return Err(format!("{}: the table has {width} columns, {key} has {} in {row:?}", page.name, row.len()));
                }
                for row in &table.rows {
                    writeln!(filled, "| {} |", row.join(" | ")).unwrap();
                }
            } else if let Some(key) = block(line, "output") {
                used.insert(key.to_owned());
                let (group, name) = self.group(key).ok_or(format!("{}: no figures {key}", page.name))?;
                let output = group.outputs.get(name).ok_or(format!("{}: no output {key}", page.name))?;
                filled += line;
                filled.push('\n');
                for next in lines.by_ref() {
                    filled += next;
                    filled.push('\n');
                    if next.starts_with("```") {
                        break;
                    }
                }
                lines.by_ref().find(|line| line.starts_with("```")).ok_or(format!("{}: {key} is not closed", page.name))?;
                filled += output;
                filled += "```\n";
            } else {
                let mut rest = line;
                while let Some((before, key, after)) = mark(rest) {
                    // Else what follows would be HTML, not Markdown.
                    if filled.is_empty() || (filled.ends_with('\n') && before.trim().is_empty()) {
                        return Err(format!("{}: a line must not begin with the mark {key}", page.name));
                    }
                    used.insert(key.to_owned());
                    let (group, name) = self.group(key).ok_or(format!("{}: no figures {key}", page.name))?;
                    let figure = group.figures.get(name).ok_or(format!("{}: no figure {key}", page.name))?;
                    let (_, after) =
                        after.split_once(END).ok_or(format!("{}: the figure {key} is not closed in its line", page.name))?;
                    write!(filled, "{before}<!-- {key} -->{}{END}", figure.text()).unwrap();
                    rest = after;
                }
                filled += rest;
                filled.push('\n');
            }
        }
        Ok(filled)
    }
}

/// Ends a figure in a line.
const END: &str = "<!-- -->";

/// The key of a mark that stands in a line of its own.
fn block<'a>(line: &'a str, kind: &str) -> Option<&'a str> {
    line.trim().strip_prefix("<!-- ")?.strip_prefix(kind)?.strip_prefix(": ")?.strip_suffix(" -->")
}

/// The first mark of a figure in `line`: what stands before it, its key, what stands behind it.
fn mark(line: &str) -> Option<(&str, &str, &str)> {
    let mut from = 0;
    loop {
        let at = from + line[from..].find("<!-- ")?;
        let (key, after) = line[at + 5..].split_once(" -->")?;
        let part =
            |part: &str| !part.is_empty() && part.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
        if key.split_once('.').is_some_and(|(group, name)| part(group) && part(name)) {
            return Some((&line[..at], key, after));
        }
        from = at + 5;
    }
}

/// Units that a measured number may have.
const UNITS: [&str; 31] = [
    "µm",
    "mm",
    "cm",
    "m",
    "nm",
    "µrad",
    "mrad",
    "rad",
    "arcsec",
    "″",
    "°",
    "%",
    "s",
    "ms",
    "µs",
    "min",
    "h",
    "MB",
    "kB",
    "GB",
    "σ",
    "K",
    "kg",
    "kN·m/rad",
    "N·m/rad",
    "ppm",
    "m²",
    "µrad/(N·m)",
    "points",
    "poses/s",
    "CPU-minutes",
];

/// Numbers with a unit that stand in the text of a page outside marks, code and addresses.
fn unmarked(page: &Page) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut skip_table = false;
    let mut fenced = false;
    let mut generated = false;
    for line in page.text.lines() {
        let is_fence = line.trim_start().starts_with("```");
        fenced ^= is_fence;
        generated = (generated || line.starts_with("<!-- generated: ")) && !line.starts_with("<!-- end of generated -->");
        skip_table = block(line, "table").is_some() || (skip_table && (line.is_empty() || line.starts_with('|')));
        if fenced || is_fence || generated || (skip_table && line.starts_with('|')) {
            continue;
        }
        numbers(&plain(line), &mut found);
    }
    found
}

/// A line without figures in marks, code and addresses.
fn plain(line: &str) -> String {
    let mut text = String::new();
    let mut rest = line;
    while let Some((before, _, after)) = mark(rest) {
        text += before;
        rest = after.split_once(END).map_or("", |(_, after)| after);
    }
    text += rest;
    let without_code: String = text.split('`').step_by(2).collect::<Vec<_>>().join(" ");
    // `](address)`
    let mut plain = String::new();
    let mut rest = without_code.as_str();
    while let Some((before, after)) = rest.split_once("](") {
        plain += before;
        rest = after.split_once(')').map_or("", |(_, after)| after);
    }
    plain + rest
}

fn numbers(text: &str, found: &mut BTreeSet<String>) {
    let characters: Vec<char> = text.chars().collect();
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut at = 0;
    while at < characters.len() {
        if !characters[at].is_ascii_digit() || (at > 0 && (is_word(characters[at - 1]) || "^_{".contains(characters[at - 1]))) {
            at += 1;
            continue;
        }
        let start = at;
        while at < characters.len()
            && (characters[at].is_ascii_digit()
                || (".,".contains(characters[at]) && characters.get(at + 1).is_some_and(char::is_ascii_digit)))
        {
            at += 1;
        }
        // 1e-9
        if characters.get(at) == Some(&'e')
            && characters[at + 1..].first().is_some_and(|c| "-−".contains(*c) || c.is_ascii_digit())
        {
            at += 2;
            while characters.get(at).is_some_and(char::is_ascii_digit) {
                at += 1;
            }
        }
        let rest: String = characters[at..].iter().collect();
        let rest = rest.strip_prefix([' ', '\u{a0}', '\u{202f}']).unwrap_or(&rest);
        let ends = |unit: &str| rest.strip_prefix(unit).is_some_and(|after| !after.starts_with(is_word));
        if let Some(unit) = UNITS.iter().filter(|unit| ends(unit)).max_by_key(|unit| unit.len()) {
            let number: String = characters[start..at].iter().collect();
            found.insert(format!("{number} {unit}"));
        }
    }
}

#[test]
fn pages_repeat_the_measured_figures_and_nothing_else() {
    let figures = Figures::read();
    let mut used = BTreeSet::new();
    let mut wrong = Vec::new();
    for page in pages() {
        match figures.fill(&page, &mut used) {
            Ok(filled) if filled == page.text => {}
            Ok(filled) => {
                let differ = filled.lines().zip(page.text.lines()).filter(|(a, b)| a != b).take(3);
                wrong.extend(differ.map(|(file, page_line)| format!("{}: {page_line}\n  {FILE} says: {file}", page.name)));
            }
            Err(error) => wrong.push(error),
        }
        let given: BTreeSet<String> = figures.given.get(&page.name).into_iter().flatten().cloned().collect();
        let found = unmarked(&page);
        for number in found.difference(&given) {
            wrong.push(format!(
                "{}: {number} has no key. Measured: put it into {FILE} and between marks. Chosen or quoted: list it there under [given].",
                page.name
            ));
        }
        for number in given.difference(&found) {
            wrong.push(format!("{FILE}: [given] lists {number} for {}, where it no longer stands", page.name));
        }
    }
    let names: BTreeSet<String> = pages().into_iter().map(|page| page.name).collect();
    wrong.extend(figures.given.keys().filter(|page| !names.contains(*page)).map(|page| format!("{FILE}: no page {page}")));
    for (name, group) in &figures.measured {
        assert!(!group.command.is_empty() && !group.version.is_empty() && group.date.len() == 10, "{name}: {group:?}");
        let keys = group.figures.keys().chain(group.tables.keys()).chain(group.outputs.keys());
        let unused = keys.map(|key| format!("{name}.{key}")).filter(|key| !used.contains(key));
        wrong.extend(unused.map(|key| format!("{FILE}: {key} stands on no page")));
    }
    assert!(wrong.is_empty(), "{}\n(UPDATE_GUIDE=1 writes the figures of {FILE} into the pages)", wrong.join("\n"));
}

#[test]
fn the_file_is_as_it_would_be_written() {
    let text = fs::read_to_string(root().join(FILE)).unwrap();
    let written = Figures::read().to_toml();
    let differs = written.lines().zip(text.lines()).find(|(written, text)| written != text);
    if std::env::var_os("UPDATE_GUIDE").is_some() {
        fs::write(root().join(FILE), written).unwrap();
        return;
    }
    assert!(written == text, "written again, {FILE} would differ: {differs:?}; UPDATE_GUIDE=1 writes it");
}

#[test]
fn numbers_are_found_with_their_units() {
    let found = |text: &str| {
        let mut found = BTreeSet::new();
        numbers(&plain(text), &mut found);
        found.into_iter().collect::<Vec<_>>()
    };
    assert_eq!(found("±1 mm and 0.2°, 20–30 µm, 1,000 s; O1 is 5 m"), ["0.2 °", "1 mm", "1,000 s", "30 µm", "5 m"]);
    assert!(found("`5 mm` and [x](y/5 mm) in 3 minutes, <!-- a.b -->7 mm<!-- -->").is_empty());
}
