//! `kincal export`: a robot or measurements in another format.

use anyhow::{Context, bail, ensure};
use serde_json::json;

use super::Outcome;
use super::arguments::{ExportOptions, Format, Global};
use super::input::{input_stem, is_recording};
use super::output;
use crate::arm::{Arm, JointKind, dh, urdf};
use crate::event::{self, Event};
use crate::measurement::{Measurement, Sensor, table};
use crate::{recording, scene, session};

pub(crate) fn command(global: &Global, options: &ExportOptions) -> anyhow::Result<Outcome> {
    let path = &options.input;
    let (extension, text) = if is_recording(path) { from_recording(global, options)? } else { from_scene(options)? };
    let written = global.out.join(format!("{}.{extension}", input_stem(path, "")));
    output::check_target(&written)?;
    if written.exists() && std::fs::canonicalize(&written)? == std::fs::canonicalize(path)? {
        bail!("{} would overwrite its own input; choose another folder with --out", written.display());
    }
    output::write(&written, &text)?;
    output::show(global, &written.display().to_string())?;
    output::show_json(global, &json!({ "written": written }))?;
    Ok(Outcome::Good)
}

fn from_scene(options: &ExportOptions) -> anyhow::Result<(&'static str, String)> {
    let path = &options.input;
    if path.extension().is_some_and(|extension| extension == "urdf" || extension == "csv") {
        if options.to == Format::Dh && path.extension().is_some_and(|extension| extension == "urdf") {
            let arm = urdf::read(path, options.base_link.as_deref(), options.tip_link.as_deref())?.arm;
            return Ok(("dh.csv", dh_table(&arm, &arm.chain.nominal())?));
        }
        bail!("{}: give a scene (.toml) or a recording (.mcap); a URDF for --to dh", path.display());
    }
    no_links(options)?;
    let file = scene::read(path)?;
    match options.to {
        Format::Urdf => Ok(("urdf", urdf::export(&file.scene.arm)?)),
        Format::Toml => Ok(("public.toml", file.public_toml()?)),
        Format::Dh => Ok(("dh.csv", dh_table(&file.scene.arm, &file.scene.arm.chain.nominal())?)),
        Format::UrKinematics | Format::RosTransforms => {
            bail!("{} is a scene: give the recording of `kincal identify`", path.display())
        }
        Format::Csv => bail!("{} is a scene and holds no measurements; give a recording", path.display()),
    }
}

fn no_links(options: &ExportOptions) -> anyhow::Result<()> {
    let given = options.base_link.is_some() || options.tip_link.is_some();
    ensure!(
        !given,
        "--base-link, --tip-link: they choose a part of a URDF, and {} is none; leave them out",
        options.input.display()
    );
    Ok(())
}

/// The Denavit-Hartenberg table of `arm` at the parameters `values`.
fn dh_table(arm: &Arm, values: &[f64]) -> anyhow::Result<String> {
    let joints = &arm.chain.joints;
    let kinds: Vec<JointKind> = joints.iter().map(|joint| joint.kind).collect();
    let names: Vec<&str> = joints.iter().map(|joint| joint.name.as_str()).collect();
    Ok(dh::table(&arm.chain.at(values), &kinds).csv(&names, &kinds)?)
}

fn from_recording(global: &Global, options: &ExportOptions) -> anyhow::Result<(&'static str, String)> {
    no_links(options)?;
    let path = &options.input;
    let recording = recording::read::read(path)?;
    if let Some(cut) = &recording.cut {
        if !options.partial {
            bail!("{cut}; --partial uses what is there");
        }
        output::note(global, &format!("note: {cut}"));
    }
    let start = &recording.start;
    let scene = || scene::parse(&start.scene, &format!("{} (scene)", path.display()));
    let measured = event::measurements(&recording.events);
    let arm = || -> anyhow::Result<Arm> {
        Ok(match &start.real {
            Some(real) => {
                let robot = session::real_robot(start, real).with_context(|| path.display().to_string())?;
                session::real_arm(real, robot, &measured).with_context(|| path.display().to_string())?.arm
            }
            None => scene()?.scene.arm,
        })
    };
    match options.to {
        Format::Toml if start.scene.is_empty() => {
            bail!("{} is a recording of a real arm and holds no scene; export its urdf or its csv", path.display())
        }
        Format::Toml => Ok(("public.toml", scene()?.public_toml()?)),
        Format::Csv => {
            let designed = recording.events.iter().rev().find_map(|event| match event {
                Event::Designed(outcome) => Some(outcome),
                _ => None,
            });
            match designed {
                Some(outcome) if measured.is_empty() => {
                    return Ok(("csv", output::to_visit(&arm()?, &outcome.configurations)?));
                }
                None if measured.is_empty() => bail!("{} holds no measurements, and no design", path.display()),
                _ => {}
            }
            if !start.scene.is_empty() {
                output::note(global, &noise_options(&scene()?.scene.sensor, &measured));
            }
            Ok(("csv", table::write(&measured, &arm()?.slides())?))
        }
        Format::Dh => {
            let identified = recording.events.iter().rev().find_map(|event| match event {
                Event::Identified(identification) => Some(identification),
                _ => None,
            });
            let arm = arm()?;
            let values = match identified {
                Some(of) => of.parameters.iter().map(|parameter| parameter.identified).collect(),
                None => {
                    output::note(global, "note: the recording holds no identification; this is the nominal arm");
                    arm.chain.nominal()
                }
            };
            Ok(("dh.csv", dh_table(&arm, &values)?))
        }
        Format::UrKinematics | Format::RosTransforms => {
            let identified = recording.events.iter().rev().find_map(|event| match event {
                Event::Identified(identification) => Some(identification),
                _ => None,
            });
            let Some(identification) = identified.filter(|_| start.real.is_some()) else {
                bail!("{} holds no identification of a real arm: give the recording of `kincal identify`", path.display());
            };
            let arm = arm()?;
            let values: Vec<f64> = identification.parameters.iter().map(|parameter| parameter.identified).collect();
            if options.to == Format::RosTransforms {
                return Ok(("transforms.sh", urdf::ros_transforms(&arm, &values)));
            }
            let text = urdf::ur_kinematics(&arm, &values).map_err(|wrong| anyhow::anyhow!("{}: {wrong}", path.display()))?;
            Ok(("kinematics.yaml", text))
        }
        Format::Urdf => {
            let identified = recording.events.iter().rev().find_map(|event| match event {
                Event::Identified(identification) => Some(identification),
                _ => None,
            });
            let arm = &arm()?;
            let text = match identified {
                Some(identification) => {
                    let own = start.real.as_ref().and_then(|real| real.urdf.as_deref());
                    // The nominal arm may lie beside the recording, under its name.
                    return Ok(("calibrated.urdf", output::calibrated(arm, own, false, identification)?));
                }
                None => {
                    output::note(global, "note: the recording holds no identification; this is the nominal arm");
                    urdf::export(arm)?
                }
            };
            Ok(("urdf", text))
        }
    }
}

/// A note that says how exact the readings are, for the table has no column for that.
fn noise_options(sensor: &Sensor, measured: &[Measurement]) -> String {
    let sigma = sensor.mean_position_sigma(measured);
    let orientation =
        sensor.orientation_sigma_rad.map(|sigma| format!(" --attitude-noise-deg {:.5}", sigma.to_degrees())).unwrap_or_default();
    format!(
        "note: a table does not say how exact its readings are; for identify and diagnose: --position-noise-um {:.2}{orientation}",
        sigma * 1e6
    )
}
