//! The list of shapes of a figure, written as SVG (`svg`) and painted as PNG (`tiny-skia`).

use svg::Document;
use svg::node::element::{Circle, Polygon, Polyline, Rectangle, Text};
use tiny_skia::{Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, Transform};

use super::FigureError;
use super::face::Face;

/// Pixels of a PNG for a point of the figure, along each side.
const PIXELS: f32 = 2.0;

/// Square points in the largest picture, some hundred megabytes.
const LARGEST: f64 = 8e6;

/// What a viewer without the font may take has almost the same widths.
const FAMILY: &str = "DejaVu Sans, Verdana, Geneva, sans-serif";

/// From the middle of a digit down to the line that letters stand on, by the size of the letters.
const BASELINE: f64 = 0.3635;

/// Red, green, blue.
pub(super) type Rgb = [u8; 3];

/// Which part of a text is at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// Lengths are points of the figure, y points down.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shape {
    Path {
        points: Vec<[f64; 2]>,
        colour: Rgb,
        width: f64,
    },
    Area {
        points: Vec<[f64; 2]>,
        colour: Rgb,
        opacity: f64,
    },
    Disc {
        centre: [f64; 2],
        radius: f64,
        colour: Rgb,
    },
    /// Digits are centred at the height of the place.
    Text {
        text: String,
        at: [f64; 2],
        size: f64,
        anchor: Anchor,
        upwards: bool,
        colour: Rgb,
    },
}

/// A figure that is laid out.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sheet {
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) shapes: Vec<Shape>,
}

impl Sheet {
    /// Whole points that hold the figure.
    fn size(&self) -> Result<[f64; 2], FigureError> {
        if self.width * self.height <= LARGEST {
            Ok([self.width.ceil(), self.height.ceil()])
        } else {
            Err(FigureError::TooLarge { width: self.width, height: self.height })
        }
    }
}

/// Hundredths of a point are enough.
fn rounded(value: f64) -> f64 {
    // Adding zero makes −0 a plain 0.
    (value * 100.0).round() / 100.0 + 0.0
}

fn hexadecimal([r, g, b]: Rgb) -> String {
    format!("#{r:02X}{g:02X}{b:02X}")
}

fn listed(points: &[[f64; 2]]) -> String {
    points.iter().map(|[x, y]| format!("{},{}", rounded(*x), rounded(*y))).collect::<Vec<_>>().join(" ")
}

pub(super) fn svg(sheet: &Sheet) -> Result<String, FigureError> {
    let [width, height] = sheet.size()?;
    let page = Rectangle::new().set("width", width).set("height", height).set("fill", "#FFFFFF");
    let mut document = Document::new()
        .set("width", width)
        .set("height", height)
        .set("viewBox", (0.0, 0.0, width, height))
        .set("font-family", FAMILY)
        .add(page);
    for shape in &sheet.shapes {
        document = match shape {
            Shape::Path { points, colour, width } => document.add(
                Polyline::new()
                    .set("points", listed(points))
                    .set("fill", "none")
                    .set("stroke", hexadecimal(*colour))
                    .set("stroke-width", rounded(*width))
                    .set("stroke-linejoin", "round"),
            ),
            Shape::Area { points, colour, opacity } => {
                let area = Polygon::new().set("points", listed(points)).set("fill", hexadecimal(*colour));
                document.add(if *opacity < 1.0 { area.set("fill-opacity", *opacity) } else { area })
            }
            Shape::Disc { centre: [x, y], radius, colour } => document.add(
                Circle::new()
                    .set("cx", rounded(*x))
                    .set("cy", rounded(*y))
                    .set("r", rounded(*radius))
                    .set("fill", hexadecimal(*colour)),
            ),
            Shape::Text { text, at: [x, y], size, anchor, upwards, colour } => {
                let anchor = match anchor {
                    Anchor::Start => "start",
                    Anchor::Middle => "middle",
                    Anchor::End => "end",
                };
                // XML has no control characters.
                let text = Text::new(text.chars().filter(|c| !c.is_control()).collect::<String>())
                    .set("font-size", *size)
                    .set("text-anchor", anchor)
                    .set("fill", hexadecimal(*colour));
                let down = BASELINE * size;
                document.add(if *upwards {
                    let (x, y) = (rounded(x + down), rounded(*y));
                    text.set("x", x).set("y", y).set("transform", format!("rotate(-90, {x}, {y})"))
                } else {
                    text.set("x", rounded(*x)).set("y", rounded(y + down))
                })
            }
        };
    }
    Ok(format!("{document}\n"))
}

pub(super) fn png(sheet: &Sheet) -> Result<Vec<u8>, FigureError> {
    let [width, height] = sheet.size()?;
    let pixels = |points: f64| (points as f32 * PIXELS) as u32;
    let too_large = || FigureError::TooLarge { width, height };
    let mut picture = Pixmap::new(pixels(width), pixels(height)).ok_or_else(too_large)?;
    picture.fill(Color::WHITE);
    let (face, scale) = (Face::new()?, Transform::from_scale(PIXELS, PIXELS));
    for shape in &sheet.shapes {
        match shape {
            Shape::Path { points, colour, width } => {
                let stroke =
                    Stroke { width: *width as f32, line_cap: LineCap::Round, line_join: LineJoin::Round, ..Stroke::default() };
                if let Some(path) = joined(points, false) {
                    picture.stroke_path(&path, &paint(*colour, 1.0), &stroke, scale, None);
                }
            }
            Shape::Area { points, colour, opacity } => {
                if let Some(path) = joined(points, true) {
                    picture.fill_path(&path, &paint(*colour, *opacity), FillRule::Winding, scale, None);
                }
            }
            Shape::Disc { centre: [x, y], radius, colour } => {
                if let Some(path) = PathBuilder::from_circle(*x as f32, *y as f32, *radius as f32) {
                    picture.fill_path(&path, &paint(*colour, 1.0), FillRule::Winding, scale, None);
                }
            }
            Shape::Text { text, at: [x, y], size, anchor, upwards, colour } => {
                let left = match anchor {
                    Anchor::Start => 0.0,
                    Anchor::Middle => -0.5 * face.width(text, *size),
                    Anchor::End => -face.width(text, *size),
                };
                let turned = if *upwards { Transform::from_rotate(-90.0) } else { Transform::identity() };
                let placed = turned
                    .pre_translate(left as f32, (BASELINE * size) as f32)
                    .post_concat(Transform::from_translate(*x as f32, *y as f32))
                    .post_concat(scale);
                if let Some(path) = face.outline(text, *size) {
                    picture.fill_path(&path, &paint(*colour, 1.0), FillRule::Winding, placed, None);
                }
            }
        }
    }
    picture.encode_png().map_err(|error| FigureError::Encoding(error.to_string()))
}

fn joined(points: &[[f64; 2]], closed: bool) -> Option<Path> {
    let mut path = PathBuilder::new();
    for (index, [x, y]) in points.iter().enumerate() {
        let (x, y) = (*x as f32, *y as f32);
        if index == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
    }
    if closed {
        path.close();
    }
    path.finish()
}

fn paint([r, g, b]: Rgb, opacity: f64) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color_rgba8(r, g, b, (opacity * 255.0).round() as u8);
    paint
}
