//! A scene whose arm comes from a URDF, through every command.

use std::fs;
use std::path::Path;

use kincal::arm::urdf;

use crate::harness::{Ran, kincal, names, number};

const QUICK: [&str; 2] = ["--set", "design.swarm.iterations=3"];

/// A folder with the Panda's scene and URDF in it, each as `change` makes it.
fn folder(change: impl Fn(&str, String) -> String) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in ["panda.toml", "panda.urdf"] {
        let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)).unwrap();
        fs::write(folder.path().join(name), change(name, text)).unwrap();
    }
    folder
}

fn with(out: &Path, arguments: &[&str], more: &[&str]) -> Ran {
    kincal(out, &[arguments, more].concat())
}

#[test]
fn a_scene_with_a_urdf_runs_and_replays_without_the_file() {
    let folder = folder(|_, text| text);
    let out = folder.path().join("out");
    let path = |name: &str| out.join(name).to_str().unwrap().to_owned();
    let scene = folder.path().join("panda.toml").to_str().unwrap().to_owned();
    // Play and warming, too: the masses are the URDF's.
    let effects = [
        "--set",
        "injected.effect=[{kind=\"clearance\",joint=\"panda_joint2\",radial_um=30,tilt_urad=100},\
         {kind=\"tilt_clearance\",joint=\"panda_joint4\",tilt_urad=100},{kind=\"link_thermal_growth\",expansion_um_per_m_per_k=23}]",
        "--set",
        "plan.temperature={rise_k=10,profile=\"warm-up\"}",
        "--json",
    ];
    let ran = with(&out, &["run", &scene], &[&QUICK[..], &effects].concat()).ends(0);
    assert!(
        ran.stderr.starts_with("note: every configuration is read once") && ran.stderr.lines().count() == 1,
        "{}",
        ran.stderr
    );
    let json = ran.json();
    assert_eq!((&json["identification"]["rank"], &json["identification"]["converged"]), (&34.into(), &true.into()));
    assert_eq!(json["identification"]["parameters"].as_array().unwrap().len(), 48);
    let [before, after] =
        ["held_out_nominal", "held_out"].map(|what| number(&json, &format!("/identification/{what}/position_m/mean")));
    assert!(after * 20.0 < before, "{before} before, {after} after");
    let truth: toml::Table = toml::from_str(&fs::read_to_string(out.join("panda.truth.toml")).unwrap()).unwrap();
    let seats = truth["poses"][0]["seats"].as_array().unwrap();
    assert_eq!(seats.len(), 2);
    assert!(truth["poses"].as_array().unwrap().iter().all(|pose| pose["settled"].as_bool() == Some(true)));

    // Elsewhere, without the URDF.
    fs::remove_file(folder.path().join("panda.urdf")).unwrap();
    let recording = path("panda.mcap");
    for more in [&[][..], &["--truth", &path("panda.truth.toml"), "--threads", "1"]] {
        let json = with(&out, &["replay", &recording, "--json"], more).ends(0).json();
        assert_eq!(json["identical"], true);
    }
    with(&out, &["identify", &recording], &[]).ends(0);
    assert_eq!(fs::read(out.join("panda-identified.urdf")).unwrap(), fs::read(out.join("panda.calibrated.urdf")).unwrap());
    with(&out, &["export", &recording, "--to", "toml"], &[]).ends(0);
    with(&out, &["export", &recording, "--to", "csv"], &[]).ends(0);

    // The public scene alone is a scene, and a robot for a table. It is the same design that it makes.
    let public = path("panda.public.toml");
    let design = with(&out, &["design", &public, "--json"], &[]).ends(0).json();
    assert_eq!(design["design"]["configurations"], json["design"]["configurations"]);
    let identified = with(&out, &["identify", &path("panda.csv"), "--robot", &public, "--json"], &[]).ends(0).json();
    assert!(number(&identified, "/held_out/position_m/mean") * 20.0 < before);

    // Without its URDF the scene itself is refused.
    let left = names(&out);
    let ran = with(&out, &["run", &scene], &[]).ends(2);
    for expected in ["panda.toml:12:1: arm.urdf_file", "panda.urdf: No such file", "relative to the scene's folder"] {
        assert!(ran.stderr.contains(expected), "{expected}: {}", ran.stderr);
    }
    assert_eq!(names(&out), left);
}

#[test]
fn its_steps_are_the_run() {
    let out = tempfile::tempdir().unwrap();
    let out = out.path();
    let path = |name: &str| out.join(name).to_str().unwrap().to_owned();
    with(out, &["design", "scenes/panda.toml"], &QUICK).ends(0);
    with(out, &["measure", "scenes/panda.toml", "--design", &path("panda-design.mcap")], &QUICK).ends(0);
    let steps = with(out, &["identify", &path("panda-measure.mcap"), "--json"], &[]).ends(0).json();
    let whole = with(out, &["run", "scenes/panda.toml", "--json"], &QUICK).ends(0).json();
    assert_eq!(steps["parameters"], whole["identification"]["parameters"]);
}

#[test]
fn the_exported_urdf_has_the_kinematics_of_the_one_given() {
    let out = tempfile::tempdir().unwrap();
    with(out.path(), &["export", "scenes/panda.toml", "--to", "urdf"], &[]).ends(0);
    let given = urdf::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/panda.urdf"), None, None).unwrap();
    let back = urdf::read(&out.path().join("panda.urdf"), None, None).unwrap();
    assert_eq!((given.notes.len(), back.notes.len()), (0, 0));
    let [given, back] = [given.arm, back.arm];
    assert_eq!(back.chain.joints, given.chain.joints);
    assert_eq!(back.chain.frame_names(), given.chain.frame_names());
    // What is fixed between the last joint and the tool becomes part of the tool.
    let (joints, tool) = given.chain.parameters.split_at(42);
    assert_eq!(&back.chain.parameters[..42], joints);
    assert_eq!((tool[2].nominal, back.chain.parameters[44].nominal), (0.02, 0.127));
    let [at_given, at_back] = [&given, &back].map(|arm| arm.chain.at_nominal());
    let mut stream = kincal::seed::stream(3, "test/integration/urdf");
    for _ in 0..100 {
        let joints: Vec<f64> = given.chain.joints.iter().map(|joint| stream.uniform(joint.lower, joint.upper)).collect();
        for (given, back) in at_given.frames(&joints).iter().zip(at_back.frames(&joints)) {
            assert!((given.to_homogeneous() - back.to_homogeneous()).abs().max() < 1e-14);
        }
    }
    for (back, given) in back.links.iter().zip(&given.links) {
        let [back, given] = [back, given].map(|link| link.inertial.as_ref().unwrap());
        assert_eq!(back.mass_kg, given.mass_kg);
        assert!((back.centre_of_mass_in_link - given.centre_of_mass_in_link).norm() < 1e-15);
        assert!((back.inertia_in_link - given.inertia_in_link).norm() < 1e-15);
    }
}

#[test]
fn what_a_urdf_lacks_is_said() {
    let folder = folder(|name, text| match name {
        "panda.urdf" => text
            .replacen(
                "<link name=\"nest\"/>",
                "<link name=\"nest\"><visual><geometry><mesh filename=\"n.stl\"/></geometry></visual></link>",
                1,
            )
            .replacen("<mass value=\"4.970684\"/>", "<mass value=\"0\"/>", 1),
        _ => text,
    });
    let scene = folder.path().join("panda.toml").to_str().unwrap().to_owned();
    let out = folder.path().join("out");
    // Choosing needs no masses; measuring does.
    let ran = with(&out, &["design", &scene], &QUICK).ends(0);
    for expected in ["collisions of these links are not seen: nest", "no mass is known of panda_link1"] {
        assert!(ran.stderr.contains(expected), "{expected}: {}", ran.stderr);
    }
    let ran = with(&out, &["run", &scene], &QUICK).ends(2);
    assert!(ran.stderr.contains("panda.toml: link `panda_link1` has no inertial"), "{}", ran.stderr);
    assert_eq!(names(&out), ["panda-design.csv", "panda-design.mcap"]);
    // Only the mesh: the run says so in its report, and a replay of it does not differ.
    let set = ["--set", "arm.uncollidable=[]"];
    fs::write(
        folder.path().join("panda.urdf"),
        fs::read_to_string(folder.path().join("panda.urdf"))
            .unwrap()
            .replace("<mass value=\"0\"/>", "<mass value=\"4.970684\"/>"),
    )
    .unwrap();
    let json = with(&out, &["run", &scene, "--json"], &[&QUICK[..], &set].concat()).ends(0).json();
    let notes = json["identification"]["notes"].as_array().unwrap();
    assert!(notes.iter().any(|note| note.as_str().unwrap().ends_with("links are not seen: nest")), "{notes:?}");
    with(&out, &["replay", out.join("panda.mcap").to_str().unwrap()], &[]).ends(0);
}

#[test]
fn the_arm_with_parallel_axes_runs() {
    let out = tempfile::tempdir().unwrap();
    let json = with(out.path(), &["run", "scenes/parallel8.toml", "--json"], &QUICK).ends(0).json();
    assert_eq!(json["identification"]["rank"], 36);
    let parameters = json["identification"]["parameters"].as_array().unwrap();
    let dropped: Vec<&str> = parameters
        .iter()
        .filter(|parameter| parameter["dropped"] == true)
        .map(|parameter| parameter["name"].as_str().unwrap())
        .collect();
    assert_eq!(dropped, ["beta1", "d3", "d4", "beta4", "beta5", "d7", "beta7", "beta8", "beta9"]);
    with(out.path(), &["replay", out.path().join("parallel8.mcap").to_str().unwrap()], &[]).ends(0);
}
