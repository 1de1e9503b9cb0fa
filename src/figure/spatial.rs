//! A view of points in space: a parallel projection, in which lengths can be compared.

use super::axis::{Needs, Ruler, usable};
use super::panel::{DARK, GRID, LABEL, Pen, Rect, SMALL, Styled};
use super::shape::Anchor;
use super::{Axis, Kind, Panel, Scale};

/// Where the observer stands: from the x axis towards y, and above the floor.
const AZIMUTH_DEG: f64 = -60.0;
const ELEVATION_DEG: f64 = 22.0;

/// Room around the box for its labels.
const ROOM: [f64; 2] = [52.0, 40.0];

/// Right, up and towards the observer.
fn view() -> [[f64; 3]; 3] {
    let [azimuth, elevation] = [AZIMUTH_DEG, ELEVATION_DEG].map(f64::to_radians);
    let (sa, ca) = (libm::sin(azimuth), libm::cos(azimuth));
    let (se, ce) = (libm::sin(elevation), libm::cos(elevation));
    [[-sa, ca, 0.0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Draws the clouds of a panel; false if there is nothing to draw.
pub(super) fn draw(pen: &mut Pen, panel: &Panel, z: &Axis, styled: &[Styled<'_>], rect: Rect) -> bool {
    let clouds: Vec<(&Styled<'_>, Vec<[f64; 3]>)> = styled
        .iter()
        .filter_map(|entry| match &entry.series.kind {
            Kind::Cloud(points) => {
                let kept = points.iter().copied().filter(|point| point.iter().all(|value| usable(*value)));
                Some((entry, kept.collect()))
            }
            _ => None,
        })
        .collect();
    // Space has no logarithms and no names.
    let plain = [&panel.x, &panel.y, z].map(|axis| Axis { scale: Scale::Linear, categories: None, ..axis.clone() });
    let ruler = |i: usize| {
        let values = clouds.iter().flat_map(|(_, points)| points.iter().map(|point| point[i])).collect();
        Ruler::new(&plain[i], &Needs { values, ..Needs::default() })
    };
    let (Some(x), Some(y), Some(z)) = (ruler(0), ruler(1), ruler(2)) else { return false };
    if clouds.iter().all(|(_, points)| points.is_empty()) {
        return false;
    }
    let rulers = [x, y, z];
    let longest = rulers.iter().map(Ruler::length).fold(0.0, f64::max);
    let sides = [0, 1, 2].map(|i| if panel.equal_aspect { rulers[i].length() / longest } else { 1.0 });
    let [right, up, towards] = view();
    // Corners of the box in fractions of its sides; its middle is in the middle of the panel.
    let flat = |at: [f64; 3]| {
        let from_middle = [0, 1, 2].map(|i| (at[i] - 0.5) * sides[i]);
        [dot(from_middle, right), -dot(from_middle, up)]
    };
    let reach =
        |axis: usize| (0..8).map(|corner| flat([0, 1, 2].map(|i| f64::from((corner >> i) & 1)))[axis].abs()).fold(0.0, f64::max);
    let half = [0, 1].map(|axis| {
        let side = if axis == 0 { rect.x } else { rect.y };
        (0.5 * (side[1] - side[0]) - ROOM[axis]).max(10.0)
    });
    let scale = (half[0] / reach(0)).min(half[1] / reach(1));
    let middle = [0.5 * (rect.x[0] + rect.x[1]), 0.5 * (rect.y[0] + rect.y[1]) - 6.0];
    let place = |at: [f64; 3]| {
        let flat = flat(at);
        [middle[0] + scale * flat[0], middle[1] + scale * flat[1]]
    };
    let ticks = [0, 1, 2].map(|i| {
        let [from, to] = [place([0.0; 3]), place([0, 1, 2].map(|j| f64::from(i == j)))];
        let length = ((to[0] - from[0]) * (to[0] - from[0]) + (to[1] - from[1]) * (to[1] - from[1])).sqrt();
        rulers[i].ticks((length / 30.0) as usize)
    });
    // The floor and the two walls behind: the axis across it, and at which end of that it stands.
    for (across, end) in [(2, 0.0), (0, 0.0), (1, 1.0)] {
        let [a, b] = [(across + 1) % 3, (across + 2) % 3];
        let at = |u: f64, v: f64| {
            let mut point = [end; 3];
            point[a] = u;
            point[b] = v;
            place(point)
        };
        let wall = vec![at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
        pen.area(wall.clone(), [249, 249, 249], 1.0);
        for tick in &ticks[a] {
            let u = rulers[a].fraction_of(tick.at);
            pen.path(vec![at(u, 0.0), at(u, 1.0)], GRID, 0.6);
        }
        for tick in &ticks[b] {
            let v = rulers[b].fraction_of(tick.at);
            pen.path(vec![at(0.0, v), at(1.0, v)], GRID, 0.6);
        }
        let mut edge = wall;
        edge.push(edge[0]);
        pen.path(edge, [190, 190, 190], 0.8);
    }
    // Each axis at the edge of the box where nothing is behind its labels, and which way these are.
    for (i, from, outwards, anchor) in [
        (0, [0.0, 0.0, 0.0], [-0.35, 0.94], Anchor::End),
        (1, [1.0, 0.0, 0.0], [0.6, 0.8], Anchor::Start),
        (2, [0.0, 0.0, 0.0], [-1.0, 0.0], Anchor::End),
    ] {
        let at = |fraction: f64| {
            let mut point = from;
            point[i] = fraction;
            place(point)
        };
        pen.path(vec![at(0.0), at(1.0)], DARK, 0.9);
        for tick in &ticks[i] {
            let [x, y] = at(rulers[i].fraction_of(tick.at));
            pen.path(vec![[x, y], [x + 4.0 * outwards[0], y + 4.0 * outwards[1]]], DARK, 0.9);
            pen.text(&tick.label, [x + 7.0 * outwards[0], y + 11.0 * outwards[1]], SMALL, anchor);
        }
        let label = rulers[i].label();
        if i == 2 {
            let [x, y] = at(1.0);
            pen.text(&label, [x, y - 1.2 * LABEL], LABEL, Anchor::Middle);
        } else {
            let [x, y] = at(0.5);
            // Beside the labels of the ticks.
            let aside = if i == 0 { 24.0 } else { 62.0 };
            pen.text(&label, [x + aside * outwards[0], y + 32.0 * outwards[1]], LABEL, anchor);
        }
    }
    for (entry, points) in clouds {
        let fractions = |point: &[f64; 3]| [0, 1, 2].map(|i| rulers[i].fraction_of(point[i]));
        let mut inside: Vec<[f64; 3]> =
            points.iter().map(fractions).filter(|at| at.iter().all(|fraction| (-1e-9..=1.0 + 1e-9).contains(fraction))).collect();
        let depth = |at: &[f64; 3]| dot([0, 1, 2].map(|i| at[i] * sides[i]), towards);
        inside.sort_by(|a, b| depth(a).total_cmp(&depth(b)));
        for at in inside {
            pen.marker(entry.marker, place(at), entry.colour);
        }
    }
    true
}
