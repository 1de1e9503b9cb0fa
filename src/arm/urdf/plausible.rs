//! Numbers of a URDF that nobody means.

use crate::arm::{Arm, Geometry, JointKind, Link, Quantity};

/// Largest length (m), angle (rad), mass (kg) and moment of inertia (kg·m²) that are taken for meant, in a scene as in a URDF.
const LARGEST_LENGTH_M: f64 = 100.0;
const LARGEST_ANGLE_RAD: f64 = 200.0 * std::f64::consts::PI;
const LARGEST_MASS_KG: f64 = 1e5;
const LARGEST_INERTIA_KG_M2: f64 = 1e6;

/// What nobody means, and the largest amount that is taken for meant.
pub(super) fn too_large(arm: &Arm) -> Option<(String, String)> {
    let beyond = |what: String, values: &[f64], largest: f64, unit: &str| {
        let found = values.iter().find(|value| value.is_nan() || value.abs() > largest)?;
        Some((format!("{what} {found} {unit}"), format!("{largest:.0} {unit}")))
    };
    let length = |what: String, values: &[f64]| beyond(what, values, LARGEST_LENGTH_M, "m");
    let parameters = arm.chain.parameters.iter().find_map(|parameter| match parameter.quantity {
        Quantity::Length => length(parameter.name.clone(), &[parameter.nominal]),
        Quantity::Angle => beyond(parameter.name.clone(), &[parameter.nominal], LARGEST_ANGLE_RAD, "rad"),
    });
    let limits = || {
        arm.chain.joints.iter().find_map(|joint| {
            let what = format!("joint {:?}: limit", joint.name);
            match joint.kind {
                JointKind::Revolute => beyond(what, &[joint.lower, joint.upper], LARGEST_ANGLE_RAD, "rad"),
                JointKind::Prismatic => length(what, &[joint.lower, joint.upper]),
            }
        })
    };
    let of_link = |link: &Link| {
        let what = |what: &str| format!("link {:?}: {what}", link.name);
        let inertial = link.inertial.as_ref().and_then(|inertial| {
            beyond(what("mass"), &[inertial.mass_kg], LARGEST_MASS_KG, "kg")
                .or_else(|| length(what("centre of mass at"), inertial.centre_of_mass_in_link.coords.as_slice()))
                .or_else(|| beyond(what("inertia"), inertial.inertia_in_link.as_slice(), LARGEST_INERTIA_KG_M2, "kg·m²"))
        });
        inertial.or_else(|| {
            link.shapes.iter().find_map(|shape| {
                let [x, y, z]: [f64; 3] = shape.link_from_shape.translation.vector.into();
                let turn = shape.link_from_shape.rotation.coords;
                let turned =
                    turn.iter().any(|value| value.is_nan()).then(|| (what("a shape turned by NaN"), "numbers".to_owned()));
                turned.or_else(|| length(what("a shape at"), &[x, y, z])).or_else(|| match shape.geometry {
                    Geometry::Capsule { half_length, radius } | Geometry::Cylinder { half_length, radius } => {
                        length(what("a shape of"), &[half_length, radius])
                    }
                    Geometry::Box { half_extents } => length(what("a shape of"), &half_extents),
                    Geometry::Sphere { radius } => length(what("a shape of"), &[radius]),
                })
            })
        })
    };
    parameters.or_else(limits).or_else(|| arm.links.iter().find_map(of_link))
}
