//! The guide under `src/guide/` and the README: what is generated in them is true, what they point at is there, and the commands that
//! they show exist. `UPDATE_GUIDE=1 cargo test --release --test tests -- guide figures` writes what is generated.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use kincal::recording::topic::Topic;

use crate::figures::Figures;
use crate::harness::command;

/// A Markdown page.
pub(crate) struct Page {
    /// Its path in the project.
    pub(crate) name: String,
    /// What it says.
    pub(crate) text: String,
}

/// The project's folder.
pub(crate) fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The README and every page of the guide.
pub(crate) fn pages() -> Vec<Page> {
    let mut names: Vec<String> = crate::harness::names(&root().join("src/guide"));
    names.retain(|name| name.ends_with(".md") && name != "links.md");
    let names = names.into_iter().map(|name| format!("src/guide/{name}"));
    let names = std::iter::once("README.md".to_owned()).chain(names);
    names.map(|name| Page { text: fs::read_to_string(root().join(&name)).unwrap(), name }).collect()
}

/// What stands between `<!-- generated: NAME -->` and `<!-- end of generated -->` is made by this.
fn generated(name: &str) -> String {
    match name {
        "effects" => kincal::effects::catalogue_markdown(),
        "topics" => topics(),
        _ => panic!("nothing generates {name}"),
    }
}

fn table(heading: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut text = format!("| {} |\n|{}\n", heading.join(" | "), "---|".repeat(heading.len()));
    for row in rows {
        let cells: Vec<String> = row.iter().map(|cell| cell.replace('|', "\\|")).collect();
        writeln!(text, "| {} |", cells.join(" | ")).unwrap();
    }
    text
}

/// Every topic of a recording with its schema.
fn topics() -> String {
    let rows = Topic::ALL.into_iter().map(|topic| {
        vec![format!("`{}`", topic.name()), format!("`{}`", topic.schema_name()), topic.message_encoding().to_owned()]
    });
    table(&["topic", "schema", "encoding"], rows)
}

/// `page` with all that is generated and all figures as they should be.
fn filled(page: &Page, figures: &Figures) -> String {
    let mut text = String::new();
    let mut lines = page.text.lines();
    while let Some(line) = lines.next() {
        text += line;
        text.push('\n');
        if let Some(name) = line.strip_prefix("<!-- generated: ").and_then(|rest| rest.strip_suffix(" -->")) {
            write!(text, "\n{}\n<!-- end of generated -->\n", generated(name)).unwrap();
            let end = lines.by_ref().find(|line| *line == "<!-- end of generated -->");
            assert!(end.is_some(), "{}: {name} has no <!-- end of generated -->", page.name);
        }
    }
    figures.fill(&Page { name: page.name.clone(), text }, &mut BTreeSet::new()).unwrap_or_else(|error| panic!("{error}"))
}

/// Writes all that is generated, and `figures`, into the pages.
pub(crate) fn write_pages(figures: &Figures) {
    for page in pages() {
        fs::write(root().join(&page.name), filled(&page, figures)).unwrap();
    }
}

#[test]
fn what_is_generated_is_up_to_date() {
    let figures = Figures::read();
    if std::env::var_os("UPDATE_GUIDE").is_some() {
        return write_pages(&figures);
    }
    for page in pages() {
        let text = filled(&page, &figures);
        let differs = text.lines().zip(page.text.lines()).find(|(new, old)| new != old);
        assert!(
            text == page.text,
            "{} is not what would be generated: {differs:?}\n`UPDATE_GUIDE=1 cargo test --release --test tests -- guide figures` writes it",
            page.name
        );
    }
}

#[test]
fn the_readme_fits_a_screen_and_names_the_two_commands() {
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    assert!(readme.lines().count() <= 150, "README.md has {} lines", readme.lines().count());
    for wanted in ["cargo run --release -- run scenes/arm8.toml", "cargo test --release"] {
        assert!(readme.lines().any(|line| line.starts_with(wanted)), "README.md lacks `{wanted}`");
    }
    let ci = fs::read_to_string(root().join(".ci/run")).unwrap();
    assert!(ci.lines().any(|line| line == "cargo test --release"), ".ci/run does not call the README's test command");
    for (number, line) in readme.lines().enumerate() {
        assert!(
            line.chars().count() <= 140 || line.starts_with('|'),
            "README.md:{}: {} columns",
            number + 1,
            line.chars().count()
        );
    }
}

/// Every page is a module of the documentation, and references that work on GitHub work there as well.
#[test]
fn every_page_is_part_of_the_documentation() {
    let module = fs::read_to_string(root().join("src/guide/mod.rs")).unwrap();
    let links = fs::read_to_string(root().join("src/guide/links.md")).unwrap();
    let defined: BTreeMap<&str, &str> = links.lines().filter_map(|line| line.strip_prefix('[')?.split_once("]: ")).collect();
    for page in pages().iter().filter(|page| page.name != "README.md") {
        let file = page.name.rsplit('/').next().unwrap();
        assert!(module.contains(&format!("\"{file}\"")), "src/guide/mod.rs does not include {file}");
        for line in page.text.lines() {
            let Some((name, target)) = line.strip_prefix('[').and_then(|rest| rest.split_once("]: ")) else { continue };
            if target.starts_with("http") {
                continue;
            }
            assert!(defined.contains_key(name), "{}: [{name}] has no target in src/guide/links.md", page.name);
            assert!(
                root().join("src/guide").join(target).exists(),
                "{}: [{name}] leads to {target}, which is not there",
                page.name
            );
        }
        // Relative addresses in the text would be dead in the documentation.
        let dead = page.text.lines().filter(|line| line.contains("](") && !line.contains("](http") && !line.contains("](#"));
        assert_eq!(
            dead.collect::<Vec<_>>(),
            Vec::<&str>::new(),
            "{}: write [text][name] and define [name] at the end",
            page.name
        );
    }
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    for target in readme.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(target, _)| target) {
        let path = target.split('#').next().unwrap();
        assert!(target.starts_with("http") || root().join(path).exists(), "README.md: {target} is not there");
    }
}

/// Commands in the pages: the command, its options and its files exist.
#[test]
fn commands_that_are_shown_exist() {
    let mut helps: BTreeMap<String, String> = BTreeMap::new();
    let mut seen = 0;
    for page in pages() {
        let mut shell = false;
        for line in page.text.lines() {
            if line.starts_with("```") {
                shell = !shell && line == "```sh";
                continue;
            }
            let Some(rest) = line.strip_prefix("kincal ").filter(|_| shell) else { continue };
            let rest = rest.split(" #").next().unwrap().split(" > ").next().unwrap();
            let words: Vec<&str> = rest.split_whitespace().collect();
            let count = if words[0] == "challenge" { 2 } else { 1 };
            let name = words[..count].join(" ");
            let help = helps.entry(name.clone()).or_insert_with(|| {
                let output = command(&[&words[..count], &["--help"]].concat()).output().unwrap();
                assert!(output.status.success(), "{}: no command `kincal {name}`", page.name);
                String::from_utf8(output.stdout).unwrap()
            });
            for option in words.iter().filter(|word| word.starts_with("--")) {
                let option = option.split('=').next().unwrap();
                assert!(help.contains(option), "{}: `kincal {name}` has no option {option}", page.name);
            }
            for file in words.iter().filter(|word| word.starts_with("scenes/")) {
                assert!(root().join(file).exists(), "{}: {file} is not there", page.name);
            }
            seen += 1;
        }
    }
    assert!(seen > 20, "only {seen} commands: are the blocks still marked as sh?");
}
