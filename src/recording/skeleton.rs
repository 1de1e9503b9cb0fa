//! The arm, its frames and the measured pose as one cloud of coloured points: the only way in which a viewer that draws neither
//! shapes nor axes (Rerun opens the clouds of a recording, but not its `SceneUpdate`, and poses only on request) shows them.

use std::f64::consts::{PI, TAU};

use nalgebra::{Point3, Vector3};

use crate::arm::frames::Pose;
use crate::arm::{Arm, Geometry, Shape};

/// A point and its colour, red, green, blue, opaque.
pub(super) type Dot = ([f32; 3], [u8; 4]);

/// Distance of neighbouring points on a surface, m.
const SPACING_M: f64 = 0.03;
/// Length of the axes of a link's frame and of the tool's and the measured pose, m.
const LINK_AXIS_M: f64 = 0.06;
const POSE_AXIS_M: f64 = 0.15;
const AXIS_DOTS: usize = 10;

/// Points on the surfaces of every link, in link frames.
pub(super) struct Skeleton {
    /// Number of the chain's frame that carries the points, and the points.
    links: Vec<(usize, Vec<Point3<f64>>)>,
}

impl Skeleton {
    pub(super) fn new(arm: &Arm) -> Self {
        let names = arm.chain.frame_names();
        let links = arm.links.iter().filter_map(|link| {
            let frame = names.iter().position(|name| *name == link.name)?;
            Some((frame, link.shapes.iter().flat_map(surface).collect()))
        });
        Skeleton { links: links.collect() }
    }

    /// Everything at `frames` (`root_from_frame` of every frame of the chain, the tool last) and, where there is one, the measured
    /// pose, brighter and larger than the frames.
    pub(super) fn dots(&self, frames: &[Pose], measured: Option<&Pose>) -> Vec<Dot> {
        let mut dots = Vec::new();
        for (number, (frame, points)) in self.links.iter().enumerate() {
            let Some(root_from_frame) = frames.get(*frame) else { continue };
            let shade = if number % 2 == 0 { 200 } else { 130 };
            dots.extend(points.iter().map(|point| dot(root_from_frame * point, [shade, shade, shade, 255])));
            axes(root_from_frame, LINK_AXIS_M, 170, &mut dots);
        }
        if let Some(tool) = frames.last() {
            axes(tool, POSE_AXIS_M, 170, &mut dots);
        }
        if let Some(measured) = measured {
            axes(measured, POSE_AXIS_M * 1.3, 255, &mut dots);
        }
        dots
    }
}

fn dot(point: Point3<f64>, colour: [u8; 4]) -> Dot {
    (point.coords.map(|coordinate| coordinate as f32).into(), colour)
}

/// Rows of points along x (red), y (green) and z (blue).
fn axes(pose: &Pose, length: f64, bright: u8, dots: &mut Vec<Dot>) {
    for axis in 0..3 {
        let mut colour = [0, 0, 0, 255];
        colour[axis] = bright;
        for step in 0..=AXIS_DOTS {
            let mut along = Vector3::zeros();
            along[axis] = length * step as f64 / AXIS_DOTS as f64;
            dots.push(dot(pose * Point3::from(along), colour));
        }
    }
}

fn surface(shape: &Shape) -> Vec<Point3<f64>> {
    let mut points = match shape.geometry {
        Geometry::Cylinder { half_length, radius } => tube(half_length, radius),
        Geometry::Capsule { half_length, radius } => {
            let mut points = tube(half_length, radius);
            for end in [-1.0, 1.0] {
                points.extend(ball(radius).into_iter().filter(|point| point.z * end > 0.0).map(|mut point| {
                    point.z += end * half_length;
                    point
                }));
            }
            points
        }
        Geometry::Sphere { radius } => ball(radius),
        Geometry::Box { half_extents } => cuboid(half_extents),
    };
    points.iter_mut().for_each(|point| *point = shape.link_from_shape * *point);
    points
}

/// Number of steps of about the spacing on a length, at least one, and no more than a drawing needs.
fn steps(length: f64) -> usize {
    ((length / SPACING_M).ceil() as usize).clamp(1, 60)
}

fn ring(radius: f64, z: f64) -> impl Iterator<Item = Point3<f64>> {
    let count = steps(TAU * radius).max(6);
    (0..count).map(move |step| {
        let (sine, cosine) = libm::sincos(TAU * step as f64 / count as f64);
        Point3::new(radius * cosine, radius * sine, z)
    })
}

fn tube(half_length: f64, radius: f64) -> Vec<Point3<f64>> {
    let count = steps(2.0 * half_length);
    (0..=count).flat_map(|step| ring(radius, half_length * (2.0 * step as f64 / count as f64 - 1.0))).collect()
}

fn ball(radius: f64) -> Vec<Point3<f64>> {
    let count = steps(PI * radius).max(3);
    (0..=count)
        .flat_map(|step| {
            let (sine, cosine) = libm::sincos(PI * step as f64 / count as f64);
            ring(radius * sine, radius * cosine)
        })
        .collect()
}

/// Points along the edges.
fn cuboid(half: [f64; 3]) -> Vec<Point3<f64>> {
    let mut points = Vec::new();
    for axis in 0..3 {
        let (first, second) = ((axis + 1) % 3, (axis + 2) % 3);
        let count = steps(2.0 * half[axis]);
        for (u, v) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            for step in 0..=count {
                let mut point = Point3::origin();
                point[axis] = half[axis] * (2.0 * step as f64 / count as f64 - 1.0);
                point[first] = half[first] * u;
                point[second] = half[second] * v;
                points.push(point);
            }
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_on_the_surface_they_draw() {
        let at = |geometry| surface(&Shape { link_from_shape: Pose::translation(1.0, 0.0, 0.0), geometry });
        for point in at(Geometry::Capsule { half_length: 0.1, radius: 0.05 }) {
            let local = point - Vector3::x();
            let from_segment = local.coords - Vector3::z() * local.z.clamp(-0.1, 0.1);
            assert!((from_segment.norm() - 0.05).abs() < 1e-12, "{point}");
        }
        for point in at(Geometry::Box { half_extents: [0.1, 0.2, 0.3] }) {
            let local = point - Vector3::x();
            let on_faces =
                [(local.x, 0.1), (local.y, 0.2), (local.z, 0.3)].iter().filter(|(x, h)| (x.abs() - h).abs() < 1e-12).count();
            assert!(on_faces >= 2, "{point} is on no edge");
        }
    }
}
