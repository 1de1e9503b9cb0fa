//! The font, and a picture that the plotting library draws on.
//!
//! The library's own picture sets letters at whole pixels without their bearings; this one sets texts as SVG does.

use std::convert::Infallible;

use ab_glyph::{Font, FontRef, PxScale, ScaleFont, point};
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind, FontTransform,
};

use super::FigureError;

/// Widths of texts, and their letters.
pub(super) struct Face {
    font: FontRef<'static>,
    /// Height of the font by the size of its letters.
    height: f32,
}

impl Face {
    pub(super) fn new() -> Result<Self, FigureError> {
        let font = FontRef::try_from_slice(dejavu::sans::regular()).map_err(|_| FigureError::Font)?;
        let height = font.height_unscaled() / font.units_per_em().ok_or(FigureError::Font)?;
        Ok(Self { font, height })
    }

    /// Whether the font has the letter.
    #[cfg(test)]
    pub(super) fn has(&self, letter: char) -> bool {
        self.font.glyph_id(letter).0 != 0
    }

    fn scale(&self, size: f64) -> PxScale {
        PxScale::from(size as f32 * self.height)
    }

    pub(super) fn width(&self, text: &str, size: f64) -> f64 {
        let mut width = 0.0;
        self.set(text, size, |_, end| width = end);
        f64::from(width)
    }

    /// Letters with their places, and the place after each.
    fn set(&self, text: &str, size: f64, mut each: impl FnMut(ab_glyph::Glyph, f32)) {
        let scaled = self.font.as_scaled(self.scale(size));
        let mut at = 0.0;
        let mut last = None;
        for letter in text.chars() {
            let id = scaled.glyph_id(letter);
            if let Some(last) = last {
                at += scaled.kern(last, id);
            }
            let glyph = id.with_scale_and_position(self.scale(size), point(at, 0.0));
            at += scaled.h_advance(id);
            each(glyph, at);
            last = Some(id);
        }
    }
}

/// A picture of red, green and blue bytes, row by row.
pub(super) struct Canvas<'a> {
    width: u32,
    height: u32,
    pixels: &'a mut [u8],
    face: Face,
}

impl<'a> Canvas<'a> {
    /// There are three bytes for each pixel.
    pub(super) fn new(pixels: &'a mut [u8], width: u32, height: u32) -> Result<Self, FigureError> {
        Ok(Self { width, height, pixels, face: Face::new()? })
    }

    fn mix(&mut self, x: i32, y: i32, rgb: (u8, u8, u8), share: f64) {
        if x < 0 || y < 0 || x as u32 >= self.width || y as u32 >= self.height || share <= 0.0 {
            return;
        }
        let at = (y as usize * self.width as usize + x as usize) * 3;
        // In 256ths, so that no rounding mode matters.
        let share = (share.min(1.0) * 256.0) as u32;
        for (pixel, new) in self.pixels[at..at + 3].iter_mut().zip([rgb.0, rgb.1, rgb.2]) {
            *pixel = ((u32::from(*pixel) * (256 - share) + u32::from(new) * share) >> 8) as u8;
        }
    }

    /// A stroke with round ends.
    fn stroke(&mut self, from: BackendCoord, to: BackendCoord, width: f64, color: BackendColor) {
        let radius = 0.5 * width;
        let [x0, y0, x1, y1] = [from.0, from.1, to.0, to.1].map(f64::from);
        let (along, across) = (x1 - x0, y1 - y0);
        let square = along * along + across * across;
        let reach = radius.ceil() as i32 + 1;
        let (top, bottom) = ((from.1.min(to.1) - reach).max(0), (from.1.max(to.1) + reach).min(self.height as i32 - 1));
        let (left, right) = ((from.0.min(to.0) - reach).max(0), (from.0.max(to.0) + reach).min(self.width as i32 - 1));
        for y in top..=bottom {
            for x in left..=right {
                let (px, py) = (f64::from(x) - x0, f64::from(y) - y0);
                let share = if square > 0.0 { ((px * along + py * across) / square).clamp(0.0, 1.0) } else { 0.0 };
                let (dx, dy) = (px - share * along, py - share * across);
                let distance = (dx * dx + dy * dy).sqrt();
                self.mix(x, y, color.rgb, color.alpha * (radius + 0.5 - distance).clamp(0.0, 1.0));
            }
        }
    }
}

impl DrawingBackend for Canvas<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    fn ensure_prepared(&mut self) -> Result<(), DrawingErrorKind<Infallible>> {
        Ok(())
    }

    fn present(&mut self) -> Result<(), DrawingErrorKind<Infallible>> {
        Ok(())
    }

    fn draw_pixel(&mut self, at: BackendCoord, color: BackendColor) -> Result<(), DrawingErrorKind<Infallible>> {
        self.mix(at.0, at.1, color.rgb, color.alpha);
        Ok(())
    }

    /// The library makes one polygon of a path, which crosses itself where the path turns sharply.
    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Result<(), DrawingErrorKind<Infallible>> {
        let points: Vec<BackendCoord> = path.into_iter().collect();
        for pair in points.windows(2) {
            self.stroke(pair[0], pair[1], f64::from(style.stroke_width()), style.color());
        }
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        centre: BackendCoord,
        radius: u32,
        style: &S,
        _: bool,
    ) -> Result<(), DrawingErrorKind<Infallible>> {
        self.stroke(centre, centre, 2.0 * f64::from(radius), style.color());
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(
        &mut self,
        text: &str,
        style: &S,
        at: BackendCoord,
    ) -> Result<(), DrawingErrorKind<Infallible>> {
        // As the library writes it into SVG.
        let size = style.size() / 1.24;
        let right = match style.anchor().h_pos {
            HPos::Left => 0.0,
            HPos::Center => -0.5 * self.face.width(text, size),
            HPos::Right => -self.face.width(text, size),
        };
        let down = match style.anchor().v_pos {
            VPos::Top => 0.76 * size,
            // Half of the height of an x, which is 0.547 of the size in this font.
            VPos::Center => 0.2735 * size,
            VPos::Bottom => -0.2735 * size,
        };
        let mut glyphs = Vec::new();
        self.face.set(text, size, |mut glyph, _| {
            glyph.position.x += right as f32;
            glyph.position.y += down as f32;
            glyphs.push(glyph);
        });
        let (transform, color) = (style.transform(), style.color());
        for glyph in glyphs {
            let Some(outline) = self.face.font.outline_glyph(glyph) else { continue };
            let corner = outline.px_bounds().min;
            let mut covered = Vec::new();
            outline.draw(|x, y, share| covered.push((corner.x as i32 + x as i32, corner.y as i32 + y as i32, share)));
            for (x, y, share) in covered {
                let (x, y) = match transform {
                    FontTransform::Rotate270 => (y, -x),
                    _ => (x, y),
                };
                self.mix(at.0 + x, at.1 + y, color.rgb, color.alpha * f64::from(share));
            }
        }
        Ok(())
    }
}

/// Width, height and pixels of a picture with the mean of every square of so many pixels.
pub(super) fn reduced(pixels: &[u8], width: u32, height: u32, side: usize) -> (u32, u32, Vec<u8>) {
    let row = width as usize * 3;
    let (width, height) = (width as usize / side, height as usize / side);
    let mut reduced = Vec::with_capacity(width * height * 3);
    for y in 0..height {
        for x in 0..width {
            for channel in 0..3 {
                let first = y * side * row + x * side * 3 + channel;
                let mut sum = 0;
                for down in 0..side {
                    for right in 0..side {
                        sum += usize::from(pixels[first + down * row + right * 3]);
                    }
                }
                reduced.push(((sum + side * side / 2) / (side * side)) as u8);
            }
        }
    }
    (width as u32, height as u32, reduced)
}
