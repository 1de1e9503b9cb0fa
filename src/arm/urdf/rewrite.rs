//! A URDF with new origins, and nothing else changed: comments, meshes, side branches, transmissions, limits and their order stay as the
//! user wrote them.

use std::ops::Range;

use super::UrdfError;
use super::export::escaped;
use super::locate::{Element, outline};
use crate::arm::Arm;

/// A joint whose origin was changed, with the old and the new one: x, y, z (m), roll, pitch, yaw (rad).
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Name of the joint.
    pub joint: String,
    /// As the file had it.
    pub before: [f64; 6],
    /// As it has it now.
    pub after: [f64; 6],
}

/// A fixed joint and a link to be added: the parent's name, the child's, and the pose of the child in the parent.
#[derive(Clone, Debug, PartialEq)]
pub struct Added {
    /// Link that is there or added before.
    pub parent: String,
    /// Link that is there or added with this joint.
    pub child: String,
    /// x, y, z (m), roll, pitch, yaw (rad).
    pub origin: [f64; 6],
    /// Which of both is new.
    pub new_link: String,
}

/// The URDF `text`, from which `arm` was imported, with the origins of its joints as the parameters `values` have them, and the frames `added`
/// before its end; and what was changed. `None` where the text is not laid out so that it can be.
///
/// Numbers that stay are left as they are written; new ones have as many digits as bring the same number back.
///
/// # Errors
/// If a value is not finite.
pub fn rewrite(text: &str, arm: &Arm, values: &[f64], added: &[Added]) -> Result<Option<(String, Vec<Change>)>, UrdfError> {
    let parameters = &arm.chain.parameters;
    if let Some((parameter, value)) = parameters.iter().zip(values).find(|(_, value)| !value.is_finite()) {
        return Err(UrdfError::NotFinite { name: parameter.name.clone(), value: *value });
    }
    let Ok(outline) = outline(text) else {
        return Ok(None);
    };
    let (mut edits, mut changes): (Vec<(Range<usize>, String)>, Vec<Change>) = (Vec::new(), Vec::new());
    for joint in &arm.chain.joints {
        let column = |end: &str| parameters.iter().position(|parameter| parameter.name == format!("{}_{end}", joint.name));
        let columns = ["x", "y", "z", "roll", "pitch", "yaw"].map(column);
        let [Some(x), Some(y), Some(z), Some(roll), Some(pitch), Some(yaw)] = columns else {
            return Ok(None);
        };
        let of = |all: &dyn Fn(usize) -> f64| [x, y, z, roll, pitch, yaw].map(all);
        let (before, after) = (of(&|column| parameters[column].nominal), of(&|column| values[column]));
        if before == after {
            continue;
        }
        let Some(element) = outline.elements.iter().find(|element| element.tag == "joint" && element.name == joint.name) else {
            return Ok(None);
        };
        let Some(edit) = origin(text, element, &before, &after) else {
            return Ok(None);
        };
        edits.extend(edit);
        changes.push(Change { joint: joint.name.clone(), before, after });
    }
    if !added.is_empty() {
        let Some(end) = text.rfind("</robot>") else {
            return Ok(None);
        };
        edits.push((end..end, added.iter().map(fixed_joint).collect()));
    }
    edits.sort_by_key(|(range, _)| range.start);
    let mut rewritten = String::with_capacity(text.len() + 1024);
    let mut at = 0;
    for (range, new) in edits {
        rewritten.push_str(&text[at..range.start]);
        rewritten.push_str(&new);
        at = range.end;
    }
    rewritten.push_str(&text[at..]);
    Ok(Some((rewritten, changes)))
}

fn fixed_joint(added: &Added) -> String {
    let [x, y, z, roll, pitch, yaw] = added.origin;
    let (parent, child) = (escaped(&added.parent), escaped(&added.child));
    format!(
        "  <link name=\"{}\"/>\n  <joint name=\"{parent}_to_{child}\" type=\"fixed\">\n    <origin xyz=\"{x} {y} {z}\" rpy=\"{roll} {pitch} {yaw}\"/>\n    \
         <parent link=\"{parent}\"/>\n    <child link=\"{child}\"/>\n  </joint>\n",
        escaped(&added.new_link)
    )
}

/// The edits that give the joint `element` the origin `after`.
fn origin(text: &str, element: &Element, before: &[f64; 6], after: &[f64; 6]) -> Option<Vec<(Range<usize>, String)>> {
    let whole = &text[element.range.clone()];
    let opening_end = whole.find('>')? + 1;
    let Some(tag) = tag(whole, "origin") else {
        // A joint without an origin stands where its parent's frame does.
        let indent: String = whole[opening_end..].chars().take_while(|c| c.is_whitespace()).collect();
        let at = element.range.start + opening_end;
        let [x, y, z, roll, pitch, yaw] = after;
        return Some(vec![(at..at, format!("{indent}<origin xyz=\"{x} {y} {z}\" rpy=\"{roll} {pitch} {yaw}\"/>"))]);
    };
    let mut edits = Vec::new();
    let mut missing = String::new();
    for (name, first) in [("xyz", 0), ("rpy", 3)] {
        let (before, after) = (&before[first..first + 3], &after[first..first + 3]);
        if before == after {
            continue;
        }
        let Some(value) = attribute(&whole[tag.clone()], name) else {
            missing.push_str(&format!(" {name}=\"{} {} {}\"", after[0], after[1], after[2]));
            continue;
        };
        let (start, written) = (element.range.start + tag.start, &whole[tag.clone()][value.clone()]);
        let mut numbers = 0;
        let mut at = 0;
        for token in written.split_whitespace() {
            let begin = at + written[at..].find(token)?;
            at = begin + token.len();
            let number = numbers;
            numbers += 1;
            if number < 3 && before[number] != after[number] {
                let range = start + value.start + begin..start + value.start + at;
                edits.push((range, after[number].to_string()));
            }
        }
        if numbers != 3 {
            return None;
        }
    }
    if !missing.is_empty() {
        let at = element.range.start + tag.start + "<origin".len();
        edits.push((at..at, missing));
    }
    Some(edits)
}

/// Where the tag `<name …>` stands in `text`, outside comments.
fn tag(text: &str, name: &str) -> Option<Range<usize>> {
    let mut at = 0;
    while let Some(start) = text[at..].find('<').map(|found| at + found) {
        let rest = &text[start..];
        if rest.starts_with("<!--") {
            at = start + rest.find("-->")? + 3;
            continue;
        }
        let end = start + rest.find('>')? + 1;
        let is_it = rest[1..]
            .strip_prefix(name)
            .is_some_and(|after| after.starts_with(|c: char| c.is_whitespace() || c == '/' || c == '>'));
        if is_it {
            return Some(start..end);
        }
        at = end;
    }
    None
}

/// Where the value of attribute `name` stands in `tag`, without its quotes.
fn attribute(tag: &str, name: &str) -> Option<Range<usize>> {
    tag.match_indices(name).find_map(|(start, word)| {
        tag[..start].chars().next_back().filter(|c| c.is_whitespace())?;
        let after = start + word.len();
        let equals = after + tag[after..].find(|c: char| !c.is_whitespace())?;
        if !tag[equals..].starts_with('=') {
            return None;
        }
        let quote_at = equals + 1 + tag[equals + 1..].find(|c: char| !c.is_whitespace())?;
        let quote = tag[quote_at..].chars().next().filter(|c| matches!(c, '"' | '\''))?;
        let length = tag[quote_at + 1..].find(quote)?;
        Some(quote_at + 1..quote_at + 1 + length)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::frames::pose_error;
    use crate::arm::urdf::import;
    use crate::seed::stream;

    const FILE: &str = r#"<?xml version='1.0'?>
<!-- mine -->
<robot name="two" xmlns:x="y">
  <link name="base"/> <link name="upper"><visual><origin xyz="1 2 3"/><geometry><mesh filename="a.stl"/></geometry></visual></link>
  <link name="lower"/> <link name="side"/>
  <joint name="shoulder" type="revolute">
    <!-- <origin xyz="9 9 9"/> -->
    <origin rpy="0 0 0.10" xyz = '0.0  0 0.50'/>
    <parent link="base"/><child link="upper"/><axis xyz="0 0 1"/><dynamics damping="0.7"/>
    <limit lower="-1" upper="1" effort="10" velocity="2.5"/>
  </joint>
  <joint name="elbow" type="revolute">
    <origin xyz="0.30 0 0"/>
    <parent link="upper"/><child link="lower"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="7" velocity="1"/>
  </joint>
  <joint name="jaw" type="fixed"><parent link="upper"/><child link="side"/></joint>
  <joint name="wrist" type="revolute">
    <parent link="lower"/><child link="hand"/><axis xyz="1 0 0"/><limit lower="-2" upper="2" effort="7" velocity="1"/>
  </joint>
  <link name="hand"/>
  <transmission name="t"><type>simple</type></transmission>
</robot>
"#;

    #[test]
    fn only_the_numbers_that_changed_change() {
        let arm = import(FILE, "test", None, Some("hand")).unwrap().arm;
        let mut values = arm.chain.nominal();
        let column = |name: &str| arm.chain.parameters.iter().position(|parameter| parameter.name == name).unwrap();
        values[column("shoulder_z")] = 0.501;
        values[column("elbow_x")] = 0.29;
        values[column("elbow_roll")] = 0.01;
        values[column("wrist_x")] = 0.2;
        let (text, changes) = rewrite(FILE, &arm, &values, &[]).unwrap().unwrap();
        assert_eq!(changes.iter().map(|change| change.joint.as_str()).collect::<Vec<_>>(), ["shoulder", "elbow", "wrist"]);
        let expected = FILE
            .replace("xyz = '0.0  0 0.50'", "xyz = '0.0  0 0.501'")
            .replace("<origin xyz=\"0.30 0 0\"/>", "<origin rpy=\"0.01 0 0\" xyz=\"0.29 0 0\"/>")
            .replace(
                "<joint name=\"wrist\" type=\"revolute\">\n",
                "<joint name=\"wrist\" type=\"revolute\">\n    <origin xyz=\"0.2 0 0\" rpy=\"0 0 0\"/>\n",
            );
        assert_eq!(text, expected);
        let again = import(&text, "test", None, Some("hand")).unwrap().arm;
        let mut draws = stream(1, "test/rewrite");
        for _ in 0..10 {
            let joints: Vec<f64> = (0..3).map(|_| draws.uniform(-1.0, 1.0)).collect();
            let difference = pose_error(&again.chain.at_nominal().forward(&joints), &arm.chain.at(&values).forward(&joints));
            assert!(difference.amax() < 1e-15);
        }
        // Frames that are added stand at the end, and the file is still one.
        let added = Added {
            parent: "hand".to_owned(),
            child: "ball".to_owned(),
            origin: [0.1, 0.0, 0.0, 0.0, 0.0, 0.0],
            new_link: "ball".to_owned(),
        };
        let (text, _) = rewrite(FILE, &arm, &values, &[added]).unwrap().unwrap();
        assert!(import(&text, "test", None, Some("ball")).is_ok());
    }
}
