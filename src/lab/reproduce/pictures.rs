//! Pictures that several experiments draw.

use nalgebra::Vector3;

use crate::arm::Arm;
use crate::design::candidates::{NothingMeasurable, Rules, Sampler};
use crate::figure::{Axis, BandPoint, Colour, Figure, Kind, Marker, Panel, Series};
use crate::seed::stream;
use crate::statistics::Mean;

/// Points that show where the arm reaches.
const CLOUD: usize = 2500;

/// End points of `configurations` (one after the other, rad or m) of the nominal arm, in base, m.
pub(super) fn end_points(arm: &Arm, configurations: &[f64]) -> Vec<Vector3<f64>> {
    let chain = arm.chain.at_nominal();
    configurations.chunks_exact(arm.joint_count()).map(|joints| chain.end_point(joints)).collect()
}

/// End points of random configurations: where the arm reaches.
pub(super) fn reach(arm: &Arm) -> Result<Vec<Vector3<f64>>, NothingMeasurable> {
    let rules = Rules::reachable(arm);
    Ok(end_points(arm, &Sampler::new(&rules).draw(&mut stream(0, "reproduce/reach"), CLOUD)?))
}

/// End points of a set in the workspace, as in Figs. 5, 6 and 12: in space and on the three planes.
pub(super) fn in_workspace(title: String, reach: &[Vector3<f64>], name: &str, points: &[Vector3<f64>]) -> Figure {
    let names = ["x (m)", "y (m)", "z (m)"];
    let space = |points: &[Vector3<f64>]| Kind::Cloud(points.iter().map(|p| [p.x, p.y, p.z]).collect());
    let plane = |i: usize, j: usize, title: &str| {
        let flat = |points: &[Vector3<f64>]| Kind::Points(points.iter().map(|p| [p[i], p[j]]).collect());
        Panel::new(Axis::linear(names[i]), Axis::linear(names[j]))
            .titled(title)
            .equal()
            .with(Series::new("reach of the arm", flat(reach)).colour(Colour::Grey).marker(Marker::Dot))
            .with(Series::new(name, flat(points)).marker(Marker::Circle))
    };
    Figure::new(title, 2)
        .with(
            Panel::spatial(Axis::linear(names[0]), Axis::linear(names[1]), Axis::linear(names[2]))
                .titled("(a) in space")
                .with(Series::new("reach of the arm", space(reach)).colour(Colour::Grey).marker(Marker::Dot))
                .with(Series::new(name, space(points)).marker(Marker::Circle)),
        )
        .with(plane(0, 1, "(b) on XOY"))
        .with(plane(0, 2, "(c) on XOZ"))
        .with(plane(1, 2, "(d) on YOZ"))
}

/// Means over the trials with their intervals.
pub(super) fn band(points: impl IntoIterator<Item = (f64, Option<Mean>)>) -> Kind {
    let points = points.into_iter().filter_map(|(x, mean)| {
        let mean = mean?;
        let [lower, upper] = mean.interval95.unwrap_or([mean.mean; 2]);
        Some(BandPoint { x, y: mean.mean, lower, upper })
    });
    Kind::Band(points.collect())
}
