//! Arms that come from a URDF: the file's text into the scene, and the arm out of the text.

use std::path::Path;

use super::error::Invalid;
use super::file::{ArmToml, Convention};
use crate::arm::urdf::{self, Imported, UrdfError};

const EITHER: &str = "urdf_file = \"…\" or urdf = '''<robot …>''', one of the two";

/// Puts the text of `urdf_file`, looked for in `folder`, into `urdf`: a scene is then complete without the file. The name of the
/// file, where there is one, for messages.
pub(super) fn inline(arm: &mut ArmToml, folder: Option<&Path>) -> Result<Option<String>, Invalid> {
    let Some(name) = arm.urdf_file.as_ref().filter(|_| arm.convention == Convention::Urdf) else {
        return Ok(None);
    };
    if arm.urdf.is_some() {
        return Err(Invalid::new("arm.urdf_file", "`urdf_file` and `urdf`", EITHER, "remove one of them"));
    }
    let Some(folder) = folder else {
        let remedy = "write the text itself: urdf = '''<robot …>'''";
        return Err(Invalid::new("arm.urdf_file", format!("{name:?}, but no folder to look for it in"), EITHER, remedy));
    };
    let path = folder.join(name);
    let text = crate::files::text(&path, crate::files::LARGEST_TEXT).map_err(|error| {
        let found = format!("{}: {error}", path.display());
        Invalid::new("arm.urdf_file", found, "a URDF; its path is relative to the scene's folder", "check the path")
    })?;
    arm.urdf = Some(text);
    arm.urdf_file = None;
    Ok(Some(path.display().to_string()))
}

/// Refuses what only an arm from a URDF has.
pub(super) fn without(arm: &ArmToml) -> Result<(), Invalid> {
    let given = [
        ("urdf_file", arm.urdf_file.is_some()),
        ("urdf", arm.urdf.is_some()),
        ("urdf_base_link", arm.urdf_base_link.is_some()),
        ("urdf_tip_link", arm.urdf_tip_link.is_some()),
    ];
    match given.iter().find(|(_, given)| *given) {
        None => Ok(()),
        Some((key, _)) => Err(Invalid::new(
            format!("arm.{key}"),
            format!("`{key}` with convention = \"mdh5\""),
            "with convention = \"mdh5\": base_link, [[arm.frame]], base, tool",
            "set convention = \"urdf\", or remove the key",
        )),
    }
}

/// The arm of a scene whose convention is `urdf`; its name, gravity and fixtures are the scene's.
pub(super) fn arm(file: &ArmToml) -> Result<Imported, Invalid> {
    let given = [
        ("frame", !file.frame.is_empty()),
        ("base", file.base.is_some()),
        ("tool", file.tool.is_some()),
        ("base_link", file.base_link.is_some()),
    ];
    if let Some((key, _)) = given.iter().find(|(_, given)| *given) {
        let remedy = match *key {
            "base_link" => "remove the key: shapes of links stand in the URDF, and where it begins is urdf_base_link",
            _ => "remove the key: frames, base and tool are the URDF's; or set convention = \"mdh5\"",
        };
        return Err(Invalid::new(
            format!("arm.{key}"),
            format!("`{key}` with convention = \"urdf\""),
            "with convention = \"urdf\": urdf_file or urdf, urdf_base_link, urdf_tip_link",
            remedy,
        ));
    }
    let Some(text) = &file.urdf else {
        let remedy = "add `urdf_file = \"robot.urdf\"`";
        return Err(Invalid::new("arm.convention", "neither `urdf_file` nor `urdf`", EITHER, remedy));
    };
    let imported = urdf::import(text, "", file.urdf_base_link.as_deref(), file.urdf_tip_link.as_deref()).map_err(invalid)?;
    if let Some(joint) = imported.arm.chain.joints.iter().find(|joint| joint.mimic.is_some()) {
        return Err(Invalid::new(
            "arm.urdf",
            format!("joint {:?} mimics another one", joint.name),
            "joints that move independently: a scene moves each on its own",
            "remove <mimic> if it is driven on its own, or end the chain before it with urdf_tip_link",
        ));
    }
    Ok(imported)
}

/// The importer's error at the key of the scene that it is about. Options of the command line are keys here.
fn invalid(error: UrdfError) -> Invalid {
    let in_keys = |text: &str| text.replace("--base-link", "urdf_base_link").replace("--tip-link", "urdf_tip_link");
    match error {
        UrdfError::Invalid(problem) => {
            let key = match problem.element.split(' ').next() {
                Some("--base-link") => "arm.urdf_base_link",
                Some("--tip-link") => "arm.urdf_tip_link",
                _ => "arm.urdf",
            };
            let line = problem.line.map(|line| format!("line {line}: ")).unwrap_or_default();
            let element =
                if problem.element.is_empty() || key != "arm.urdf" { String::new() } else { format!("{}: ", problem.element) };
            Invalid::new(key, format!("{line}{element}{}", in_keys(&problem.found)), problem.allowed, in_keys(&problem.remedy))
        }
        other => Invalid::new("arm.urdf", other.to_string(), "the URDF of a serial arm", "correct the URDF"),
    }
}
