//! The list of shapes of a figure, and its drawing by the plotting library.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::FigureError;
use super::canvas::{self, Canvas};

/// The library draws at whole units; a point of the figure has as many of them.
pub(super) const UNITS: f64 = 4.0;

/// A PNG has a pixel for two by two units.
const UNITS_PER_PIXEL: usize = 2;

/// Units in the largest picture, some hundred megabytes.
const LARGEST: f64 = 128e6;

/// What a viewer without the font may take has almost the same widths.
const FAMILY: &str = "DejaVu Sans, Verdana, Geneva, sans-serif";

/// The library takes the size of a text as its line height, and writes the size of its letters as this much less.
const LINE: f64 = 1.24;

/// Half of a digit is above half of an x by so much of the size of the letters; the library centres the latter.
const RAISED: f64 = 0.09;

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
    fn units(&self) -> Result<(u32, u32), FigureError> {
        let even = |length: f64| (length.ceil() * UNITS) as u32;
        if self.width * self.height * UNITS * UNITS <= LARGEST {
            Ok((even(self.width), even(self.height)))
        } else {
            Err(FigureError::TooLarge { width: self.width, height: self.height })
        }
    }
}

pub(super) fn svg(sheet: &Sheet) -> Result<String, FigureError> {
    let (width, height) = sheet.units()?;
    let mut text = String::new();
    draw(&sheet.shapes, SVGBackend::with_string(&mut text, (width, height)), true)?;
    // The library knows one size; the view box keeps its units.
    let header = format!("<svg width=\"{width}\" height=\"{height}\"");
    let points = format!("<svg width=\"{}\" height=\"{}\"", f64::from(width) / UNITS, f64::from(height) / UNITS);
    Ok(text.replacen(&header, &points, 1))
}

pub(super) fn png(sheet: &Sheet) -> Result<Vec<u8>, FigureError> {
    let (width, height) = sheet.units()?;
    let mut units = vec![255; width as usize * height as usize * 3];
    draw(&sheet.shapes, Canvas::new(&mut units, width, height)?, false)?;
    let (width, height, pixels) = canvas::reduced(&units, width, height, UNITS_PER_PIXEL);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    // Large areas of one colour need no better.
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels)?;
    writer.finish()?;
    Ok(bytes)
}

/// The background is white already, or has to be made so.
fn draw<B: IntoDrawingArea>(shapes: &[Shape], backend: B, fill: bool) -> Result<(), FigureError> {
    let area = backend.into_drawing_area();
    let failed = |error: DrawingAreaErrorKind<B::ErrorType>| FigureError::Drawing(error.to_string());
    if fill {
        area.fill(&WHITE).map_err(failed)?;
    }
    let unit = |[x, y]: [f64; 2]| ((x * UNITS).round() as i32, (y * UNITS).round() as i32);
    let rgb = |colour: &Rgb| RGBColor(colour[0], colour[1], colour[2]);
    for shape in shapes {
        match shape {
            Shape::Path { points, colour, width } => {
                let points: Vec<_> = points.iter().map(|point| unit(*point)).collect();
                let stroke = rgb(colour).stroke_width((width * UNITS).round().max(1.0) as u32);
                area.draw(&PathElement::new(points, stroke)).map_err(failed)?;
            }
            Shape::Area { points, colour, opacity } => {
                let points: Vec<_> = points.iter().map(|point| unit(*point)).collect();
                area.draw(&Polygon::new(points, rgb(colour).mix(*opacity))).map_err(failed)?;
            }
            Shape::Disc { centre, radius, colour } => {
                let radius = (radius * UNITS).round().max(1.0) as u32;
                area.draw(&Circle::new(unit(*centre), radius, rgb(colour).filled())).map_err(failed)?;
            }
            Shape::Text { text, at, size, anchor, upwards, colour } => {
                let horizontal = match anchor {
                    Anchor::Start => HPos::Left,
                    Anchor::Middle => HPos::Center,
                    Anchor::End => HPos::Right,
                };
                let (transform, shift) =
                    if *upwards { (FontTransform::Rotate270, [RAISED, 0.0]) } else { (FontTransform::None, [0.0, RAISED]) };
                let place = unit([at[0] + shift[0] * size, at[1] + shift[1] * size]);
                let colour = rgb(colour);
                let style = TextStyle::from((FAMILY, size * LINE * UNITS).into_font().transform(transform))
                    .color(&colour)
                    .pos(Pos::new(horizontal, VPos::Center));
                // XML has no control characters.
                let text: String = text.chars().filter(|c| !c.is_control()).collect();
                area.draw(&Text::new(text, place, style)).map_err(failed)?;
            }
        }
    }
    area.present().map_err(failed)
}
