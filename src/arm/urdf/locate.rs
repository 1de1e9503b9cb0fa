//! Where the elements of an XML text are: the URDF parser keeps no positions, and messages need them.

use std::ops::Range;

/// An element directly below the root.
pub(super) struct Element {
    /// Its tag: `link`, `joint`, …
    pub(super) tag: String,
    /// Its attribute `name`; empty without one.
    pub(super) name: String,
    /// Where it stands in the text.
    pub(super) range: Range<usize>,
}

/// The root's opening tag and the elements directly below it.
pub(super) struct Outline {
    pub(super) root: Range<usize>,
    pub(super) elements: Vec<Element>,
}

/// What makes the text no XML, and the offset where.
pub(super) struct Malformed {
    pub(super) offset: usize,
    pub(super) found: String,
    /// Whether it is XML, but nested deeper than any robot's.
    pub(super) deep: bool,
}

/// Elements that may stand within one another.
pub(super) const DEEPEST: usize = 64;

/// Outlines `text`.
pub(super) fn outline(text: &str) -> Result<Outline, Malformed> {
    let malformed = |offset: usize, found: String| Malformed { offset, found, deep: false };
    let mut open: Vec<(&str, Range<usize>)> = Vec::new();
    let mut root = None;
    let mut elements = Vec::new();
    let mut offset = 0;
    while let Some(start) = text[offset..].find('<').map(|found| offset + found) {
        let rest = &text[start..];
        let skipped = [("<!--", "-->"), ("<?", "?>"), ("<![CDATA[", "]]>"), ("<!", ">")];
        if let Some((opening, closing)) = skipped.iter().find(|(opening, _)| rest.starts_with(opening)) {
            let length = rest.find(closing).ok_or_else(|| malformed(start, format!("`{opening}` without `{closing}`")))?;
            offset = start + length + closing.len();
            continue;
        }
        let end = start + tag_length(rest).ok_or_else(|| malformed(start, "`<` without `>`".to_owned()))?;
        offset = end;
        let inside = &text[start + 1..end - 1];
        if let Some(closed) = inside.strip_prefix('/') {
            let closed = closed.trim();
            match open.pop() {
                Some((tag, opening)) if tag == closed => {
                    if open.len() == 1 {
                        elements.push(element(text, tag, &opening, end));
                    }
                }
                Some((tag, opening)) => {
                    let line = line_of(text, opening.start);
                    return Err(malformed(start, format!("`</{closed}>` where `<{tag}>` of line {line} is open")));
                }
                None => return Err(malformed(start, format!("`</{closed}>` without `<{closed}>`"))),
            }
            continue;
        }
        let tag = inside.split(|c: char| c.is_whitespace() || c == '/').next().unwrap_or_default();
        if inside.ends_with('/') {
            if open.len() == 1 {
                elements.push(element(text, tag, &(start..end), end));
            }
        } else {
            if open.is_empty() && root.is_none() {
                root = Some(start..end);
            }
            if open.len() == DEEPEST {
                return Err(Malformed {
                    offset: start,
                    found: format!("more than {DEEPEST} elements within one another"),
                    deep: true,
                });
            }
            open.push((tag, start..end));
        }
    }
    if let Some((tag, opening)) = open.pop() {
        return Err(malformed(opening.start, format!("`<{tag}>` without `</{tag}>`")));
    }
    Ok(Outline { root: root.unwrap_or(0..0), elements })
}

/// Length of the tag that `text` starts with; a `>` in quotes does not end it.
fn tag_length(text: &str) -> Option<usize> {
    let mut quote = None;
    for (index, c) in text.char_indices() {
        match (quote, c) {
            (None, '>') => return Some(index + 1),
            (None, '<') if index > 0 => return None,
            (None, '"' | '\'') => quote = Some(c),
            (Some(open), c) if c == open => quote = None,
            _ => {}
        }
    }
    None
}

fn element(text: &str, tag: &str, opening: &Range<usize>, end: usize) -> Element {
    let attributes = &text[opening.clone()];
    let name = attributes
        .match_indices("name")
        .find_map(|(start, word)| {
            attributes[..start].chars().next_back().filter(|c| c.is_whitespace())?;
            let value = attributes[start + word.len()..].trim_start().strip_prefix('=')?.trim_start();
            let quote = value.chars().next().filter(|c| matches!(c, '"' | '\''))?;
            value[1..].split(quote).next()
        })
        .unwrap_or_default();
    Element { tag: tag.to_owned(), name: name.to_owned(), range: opening.start..end }
}

/// Line of a byte offset, from 1.
pub(super) fn line_of(text: &str, offset: usize) -> usize {
    text[..offset].matches('\n').count() + 1
}
