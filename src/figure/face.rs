//! The font that comes with the program: widths of texts, which the layout needs, and their outlines.

use tiny_skia::{Path, PathBuilder, Transform};
use ttf_parser::GlyphId;

use super::FigureError;

/// A font.
pub(super) struct Face(ttf_parser::Face<'static>);

impl Face {
    pub(super) fn new() -> Result<Self, FigureError> {
        ttf_parser::Face::parse(dejavu::sans::regular(), 0).map(Self).map_err(|_| FigureError::Font)
    }

    /// Whether the font has the letter.
    #[cfg(test)]
    pub(super) fn has(&self, letter: char) -> bool {
        self.0.glyph_index(letter).is_some()
    }

    /// Width of a text whose letters have this size.
    pub(super) fn width(&self, text: &str, size: f64) -> f64 {
        self.set(text).last().map_or(0.0, |(_, _, end)| end) * self.scale(size)
    }

    /// The letters as areas: the first begins at zero, all stand on y = 0, y points down. `None` where there is nothing to be seen.
    pub(super) fn outline(&self, text: &str, size: f64) -> Option<Path> {
        let mut outline = Outline { path: PathBuilder::new(), right: 0.0 };
        for (glyph, start, _) in self.set(text) {
            outline.right = start as f32;
            self.0.outline_glyph(glyph, &mut outline);
        }
        let scale = self.scale(size) as f32;
        outline.path.finish()?.transform(Transform::from_scale(scale, -scale))
    }

    fn scale(&self, size: f64) -> f64 {
        size / f64::from(self.0.units_per_em())
    }

    /// Letters with where they begin and end, in units of the font.
    fn set(&self, text: &str) -> impl Iterator<Item = (GlyphId, f64, f64)> {
        let (mut at, mut last) = (0.0, None);
        text.chars().filter(|letter| !letter.is_control()).map(move |letter| {
            let glyph = self.0.glyph_index(letter).unwrap_or_default();
            let start = at + last.map_or(0.0, |last| self.kerning(last, glyph));
            at = start + f64::from(self.0.glyph_hor_advance(glyph).unwrap_or(0));
            last = Some(glyph);
            (glyph, start, at)
        })
    }

    /// By how much two letters come nearer (negative) than their widths say.
    fn kerning(&self, left: GlyphId, right: GlyphId) -> f64 {
        let tables = self.0.tables().kern.into_iter().flat_map(|table| table.subtables);
        let mut horizontal = tables.filter(|table| table.horizontal && !table.variable);
        f64::from(horizontal.find_map(|table| table.glyphs_kerning(left, right)).unwrap_or(0))
    }
}

/// Collects outlines of letters.
struct Outline {
    path: PathBuilder,
    right: f32,
}

impl ttf_parser::OutlineBuilder for Outline {
    fn move_to(&mut self, x: f32, y: f32) {
        self.path.move_to(x + self.right, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.path.line_to(x + self.right, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.path.quad_to(x1 + self.right, y1, x + self.right, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.path.cubic_to(x1 + self.right, y1, x2 + self.right, y2, x + self.right, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}
