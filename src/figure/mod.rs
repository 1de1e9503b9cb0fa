//! Figures: one description, drawn as SVG and as PNG.
//!
//! A [`Figure`] is a grid of [`Panel`]s, a panel has axes and [`Series`]. What is drawn is first laid out as a list of shapes,
//! which does not depend on the format; `svg` writes the list, `tiny-skia` paints it. The font comes with the program, so that a
//! figure is the same on a machine without any. The same figure gives the same bytes.
//!
//! Nothing in the data is an error: values that are not finite, or not positive on a logarithmic axis, are left out, and a panel
//! in which nothing remains says so.

mod axis;
mod face;
mod panel;
mod shape;
mod spatial;
#[cfg(test)]
mod tests;

/// Why a figure could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// The font that comes with the program cannot be read.
    #[error("the font of the figures cannot be read")]
    Font,
    /// More panels or cells than a picture can hold.
    #[error("the figure is too large: {width} × {height}")]
    TooLarge {
        /// Width asked for, in points of the figure.
        width: f64,
        /// Height asked for, in points of the figure.
        height: f64,
    },
    /// The picture could not be compressed.
    #[error("the figure cannot be encoded: {0}")]
    Encoding(String),
}

/// A figure of a paper: a title over a grid of panels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    /// Above all panels; may be empty.
    pub title: String,
    /// Row by row.
    pub panels: Vec<Panel>,
    /// Panels side by side. The figure is wider with more of them: 800 points with two, and the PNG has two pixels per point.
    pub columns: usize,
}

/// Axes and what is drawn between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// Above the panel.
    pub title: Option<String>,
    /// To the right.
    pub x: Axis,
    /// Upwards; downwards if the panel has [`Kind::Cells`], whose first row is the topmost.
    pub y: Axis,
    /// Makes the panel a view in space, with z upwards. Only [`Kind::Cloud`] is drawn then.
    pub z: Option<Axis>,
    /// Drawn in this order; reference lines are always above grids and below data.
    pub series: Vec<Series>,
    /// Whether the labels of the series stand above the panel. Without it, reference lines are labelled where they are.
    pub legend: bool,
    /// One unit is as long on every axis. Ranges grow to fill the panel.
    pub equal_aspect: bool,
}

/// An axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// Quantity with its unit: `position error (mm)`.
    pub label: String,
    /// How values become lengths.
    pub scale: Scale,
    /// From and to; what lies outside is not drawn. Without it the range is that of the data.
    pub range: Option<[f64; 2]>,
    /// The range begins or ends at zero if the data do not reach it. Means nothing on a logarithmic axis.
    pub from_zero: bool,
    /// Names in place of the numbers 0, 1, 2 …
    pub categories: Option<Vec<String>>,
}

/// How values become lengths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences are equally long.
    #[default]
    Linear,
    /// Equal ratios are equally long. Values that are not positive are left out.
    Log,
}

/// Data drawn in one way.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Text in the legend; without it the series is not in the legend.
    pub label: String,
    /// What is drawn.
    pub kind: Kind,
    /// Of lines, points and areas.
    pub colour: Colour,
    /// Without it points have a marker that follows from their colour, and lines have none.
    pub marker: Option<Marker>,
}

/// What is drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// Points joined in their order. A point that is left out breaks the line.
    Line(Vec<[f64; 2]>),
    /// As `Line`, dashed.
    Dashed(Vec<[f64; 2]>),
    /// Points.
    Points(Vec<[f64; 2]>),
    /// A line in a band.
    Band(Vec<BandPoint>),
    /// Points with intervals.
    Estimates(Vec<Estimate>),
    /// A line across the panel at this y: a bound, the value of the paper.
    Horizontal(f64),
    /// A line across the panel at this x.
    Vertical(f64),
    /// The line y = x.
    Diagonal,
    /// One bar for each category of x. Several such series stand side by side.
    Bars(Vec<f64>),
    /// Bars between edges, of which there is one more than bars.
    Histogram {
        /// Rising.
        edges: Vec<f64>,
        /// Heights.
        counts: Vec<f64>,
    },
    /// For each category of x all values, beside each other where they would hide each other, and a line at their mean.
    Strip(Vec<Vec<f64>>),
    /// A table: rows are categories of y, columns are categories of x. A value that is missing is a dash.
    Cells {
        /// Row by row.
        values: Vec<Vec<f64>>,
        /// Significant digits printed.
        digits: usize,
        /// Among which cells a colour is chosen.
        shade: Shade,
    },
    /// Points in space. In a panel without z they are seen from above.
    Cloud(Vec<[f64; 3]>),
}

/// A point of a line with its interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandPoint {
    /// Where.
    pub x: f64,
    /// Of the line.
    pub y: f64,
    /// Lower end of the band.
    pub lower: f64,
    /// Upper end of the band.
    pub upper: f64,
}

/// A point with intervals.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Where.
    pub x: f64,
    /// Value.
    pub y: f64,
    /// Ends of the interval of x.
    pub x_interval: Option<[f64; 2]>,
    /// Ends of the interval of y.
    pub y_interval: Option<[f64; 2]>,
}

/// Among which cells of a table a colour is chosen: the largest of them is darkest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shade {
    /// All cells are comparable.
    #[default]
    Table,
    /// Those of a column are comparable: columns have different units.
    Columns,
    /// Those of a row are comparable.
    Rows,
}

/// Colour of a series. Those that are numbered can be told apart by the colour-blind (Okabe and Ito).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Colour {
    /// The next of the palette; dark for reference lines.
    #[default]
    Auto,
    /// One of the palette, which repeats after seven.
    Palette(usize),
    /// Almost black.
    Dark,
    /// Light grey, for what stands behind.
    Grey,
}

/// Shape of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// Filled.
    Circle,
    /// Filled.
    Square,
    /// Filled, a corner upwards.
    Triangle,
    /// Filled.
    Diamond,
    /// Two strokes, like an x.
    Cross,
    /// Two strokes, like a plus.
    Plus,
    /// A circle that is not filled.
    Ring,
    /// A small circle, for thousands of points.
    Dot,
}

impl Figure {
    /// A figure without panels.
    #[must_use]
    pub fn new(title: impl Into<String>, columns: usize) -> Self {
        Self { title: title.into(), panels: Vec::new(), columns }
    }

    /// With one more panel.
    #[must_use]
    pub fn with(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// The figure as SVG. Texts are texts, in DejaVu Sans or what resembles it.
    ///
    /// # Errors
    /// If the figure has too many panels or cells.
    pub fn svg(&self) -> Result<String, FigureError> {
        shape::svg(&panel::lay_out(self)?)
    }

    /// The figure as PNG, with two pixels per point.
    ///
    /// # Errors
    /// If the figure has too many panels or cells.
    pub fn png(&self) -> Result<Vec<u8>, FigureError> {
        shape::png(&panel::lay_out(self)?)
    }
}

impl Panel {
    /// A panel with a legend.
    #[must_use]
    pub fn new(x: Axis, y: Axis) -> Self {
        Self { x, y, legend: true, ..Self::default() }
    }

    /// A view in space; one unit is as long on every axis.
    #[must_use]
    pub fn spatial(x: Axis, y: Axis, z: Axis) -> Self {
        Self { x, y, z: Some(z), legend: true, equal_aspect: true, ..Self::default() }
    }

    /// With a title.
    #[must_use]
    pub fn titled(mut self, title: impl Into<String>) -> Self {
        self.title = Some(title.into());
        self
    }

    /// With one unit as long on every axis.
    #[must_use]
    pub fn equal(mut self) -> Self {
        self.equal_aspect = true;
        self
    }

    /// Without a legend.
    #[must_use]
    pub fn unlabelled(mut self) -> Self {
        self.legend = false;
        self
    }

    /// With one more series.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }
}

impl Axis {
    /// A linear axis.
    #[must_use]
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), ..Self::default() }
    }

    /// A logarithmic axis.
    #[must_use]
    pub fn log(label: impl Into<String>) -> Self {
        Self { label: label.into(), scale: Scale::Log, ..Self::default() }
    }

    /// An axis of names.
    #[must_use]
    pub fn categories<T: Into<String>>(label: impl Into<String>, names: impl IntoIterator<Item = T>) -> Self {
        Self { label: label.into(), categories: Some(names.into_iter().map(Into::into).collect()), ..Self::default() }
    }

    /// With a range.
    #[must_use]
    pub fn range(mut self, from: f64, to: f64) -> Self {
        self.range = Some([from, to]);
        self
    }

    /// With zero in its range.
    #[must_use]
    pub fn zero(mut self) -> Self {
        self.from_zero = true;
        self
    }
}

impl Series {
    /// Data drawn in the next colour.
    #[must_use]
    pub fn new(label: impl Into<String>, kind: Kind) -> Self {
        Self { label: label.into(), kind, colour: Colour::Auto, marker: None }
    }

    /// In this colour.
    #[must_use]
    pub fn colour(mut self, colour: Colour) -> Self {
        self.colour = colour;
        self
    }

    /// With this marker.
    #[must_use]
    pub fn marker(mut self, marker: Marker) -> Self {
        self.marker = Some(marker);
        self
    }
}

impl Kind {
    /// Counts of the values in as many equal bins between the smallest and the largest.
    #[must_use]
    pub fn histogram(values: &[f64], bins: usize) -> Self {
        let bins = bins.clamp(1, 1000);
        let kept: Vec<f64> = values.iter().copied().filter(|value| axis::usable(*value)).collect();
        let Some([from, to]) = axis::extent(kept.iter().copied()) else {
            return Self::Histogram { edges: Vec::new(), counts: Vec::new() };
        };
        let [from, to] = axis::widened([from, to]);
        let width = (to - from) / bins as f64;
        let mut counts = vec![0.0; bins];
        for value in kept {
            // The largest value belongs to the last bin.
            counts[(((value - from) / width) as usize).min(bins - 1)] += 1.0;
        }
        Self::Histogram { edges: (0..=bins).map(|edge| from + width * edge as f64).collect(), counts }
    }
}
