//! Where everything of a figure stands.

use super::axis::{Needs, Ruler, Tick, extent, significant, usable};
use super::face::Face;
use super::shape::{Anchor, Rgb, Shape, Sheet};
use super::{Colour, Figure, FigureError, Kind, Marker, Panel, Series, Shade, spatial};

/// Okabe and Ito's colours, but black and yellow: one is that of reference lines, the other is not seen on white.
const PALETTE: [Rgb; 7] =
    [[0, 114, 178], [213, 94, 0], [0, 158, 115], [204, 121, 167], [230, 159, 0], [86, 180, 233], [120, 120, 120]];
const MARKERS: [Marker; 7] =
    [Marker::Circle, Marker::Square, Marker::Triangle, Marker::Diamond, Marker::Ring, Marker::Plus, Marker::Cross];
pub(super) const DARK: Rgb = [40, 40, 40];
pub(super) const TEXT: Rgb = [30, 30, 30];
pub(super) const GREY: Rgb = [205, 205, 205];
pub(super) const GRID: Rgb = [228, 228, 228];
const WHITE: Rgb = [255, 255, 255];

const TITLE: f64 = 15.0;
const HEADING: f64 = 12.5;
pub(super) const LABEL: f64 = 11.5;
pub(super) const SMALL: f64 = 10.0;
/// Height of a line of text by its size.
const LEADING: f64 = 1.3;

const MARGIN: f64 = 12.0;
const GAP: f64 = 16.0;
const TICK: f64 = 4.0;
const RADIUS: f64 = 3.2;
const CELL: [f64; 2] = [58.0, 26.0];

/// A rectangle: left, top, right, bottom.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rect {
    pub(super) x: [f64; 2],
    pub(super) y: [f64; 2],
}

impl Rect {
    fn width(&self) -> f64 {
        self.x[1] - self.x[0]
    }

    fn height(&self) -> f64 {
        self.y[1] - self.y[0]
    }

    fn middle(&self) -> [f64; 2] {
        [0.5 * (self.x[0] + self.x[1]), 0.5 * (self.y[0] + self.y[1])]
    }

    pub(super) fn corners(&self) -> Vec<[f64; 2]> {
        vec![[self.x[0], self.y[0]], [self.x[1], self.y[0]], [self.x[1], self.y[1]], [self.x[0], self.y[1]]]
    }
}

/// What is drawn so far.
pub(super) struct Pen {
    face: Face,
    shapes: Vec<Shape>,
}

impl Pen {
    pub(super) fn path(&mut self, points: Vec<[f64; 2]>, colour: Rgb, width: f64) {
        self.shapes.push(Shape::Path { points, colour, width });
    }

    pub(super) fn area(&mut self, points: Vec<[f64; 2]>, colour: Rgb, opacity: f64) {
        self.shapes.push(Shape::Area { points, colour, opacity });
    }

    pub(super) fn text(&mut self, text: &str, at: [f64; 2], size: f64, anchor: Anchor) {
        self.coloured_text(text, at, size, anchor, TEXT);
    }

    fn coloured_text(&mut self, text: &str, at: [f64; 2], size: f64, anchor: Anchor, colour: Rgb) {
        self.shapes.push(Shape::Text { text: text.to_owned(), at, size, anchor, upwards: false, colour });
    }

    fn upwards(&mut self, text: &str, at: [f64; 2], size: f64, anchor: Anchor) {
        self.shapes.push(Shape::Text { text: text.to_owned(), at, size, anchor, upwards: true, colour: TEXT });
    }

    /// A text among data, on a background that lets it be read.
    fn noted(&mut self, text: &str, at: [f64; 2], anchor: Anchor) {
        let width = self.face.width(text, SMALL);
        let left = if anchor == Anchor::End { at[0] - width } else { at[0] };
        let rect = Rect { x: [left - 2.0, left + width + 2.0], y: [at[1] - 0.6 * SMALL, at[1] + 0.6 * SMALL] };
        self.area(rect.corners(), WHITE, 0.8);
        self.text(text, at, SMALL, anchor);
    }

    /// Lines below each other; `at` is the middle of the upper edge.
    fn lines(&mut self, lines: &[String], at: [f64; 2], size: f64, anchor: Anchor) {
        for (line, text) in lines.iter().enumerate() {
            self.text(text, [at[0], at[1] + (line as f64 + 0.5) * size * LEADING], size, anchor);
        }
    }

    /// Dashes of 5 points.
    fn dashed(&mut self, points: &[[f64; 2]], colour: Rgb, width: f64) {
        const DASH: f64 = 5.0;
        const SPACE: f64 = 3.0;
        let mut within = 0.0;
        let mut dash = Vec::new();
        for pair in points.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let length = ((to[0] - from[0]) * (to[0] - from[0]) + (to[1] - from[1]) * (to[1] - from[1])).sqrt();
            let point = |at: f64| [0, 1].map(|i| from[i] + (to[i] - from[i]) * at / length);
            let mut at = 0.0;
            while at < length {
                let (end, draws) = if within < DASH { (DASH, true) } else { (DASH + SPACE, false) };
                let step = (end - within).min(length - at);
                if draws {
                    if dash.is_empty() {
                        dash.push(point(at));
                    }
                    dash.push(point(at + step));
                }
                at += step;
                within += step;
                if within >= end - 1e-9 {
                    if draws {
                        self.path(std::mem::take(&mut dash), colour, width);
                    } else {
                        within = 0.0;
                    }
                }
            }
        }
        if dash.len() > 1 {
            self.path(dash, colour, width);
        }
    }

    pub(super) fn marker(&mut self, marker: Marker, [x, y]: [f64; 2], colour: Rgb) {
        let r = RADIUS;
        let mut disc = |radius, colour| self.shapes.push(Shape::Disc { centre: [x, y], radius, colour });
        match marker {
            Marker::Circle => disc(r, colour),
            Marker::Dot => disc(1.25, colour),
            Marker::Ring => {
                disc(r + 0.4, colour);
                disc(r - 1.1, WHITE);
            }
            Marker::Square => {
                let r = 0.9 * r;
                self.area(vec![[x - r, y - r], [x + r, y - r], [x + r, y + r], [x - r, y + r]], colour, 1.0);
            }
            Marker::Triangle => {
                let r = 1.25 * r;
                self.area(vec![[x, y - r], [x + 0.9 * r, y + 0.6 * r], [x - 0.9 * r, y + 0.6 * r]], colour, 1.0);
            }
            Marker::Diamond => {
                let r = 1.3 * r;
                self.area(vec![[x, y - r], [x + 0.8 * r, y], [x, y + r], [x - 0.8 * r, y]], colour, 1.0);
            }
            Marker::Cross => {
                self.path(vec![[x - r, y - r], [x + r, y + r]], colour, 1.5);
                self.path(vec![[x - r, y + r], [x + r, y - r]], colour, 1.5);
            }
            Marker::Plus => {
                let r = 1.2 * r;
                self.path(vec![[x - r, y], [x + r, y]], colour, 1.5);
                self.path(vec![[x, y - r], [x, y + r]], colour, 1.5);
            }
        }
    }

    /// Words in lines that are at most as wide, where words allow it.
    fn wrapped(&self, text: &str, width: f64, size: f64) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for word in text.split_whitespace() {
            let joined = lines.last().map(|line| format!("{line} {word}"));
            match (joined, lines.last_mut()) {
                (Some(joined), Some(line)) if self.face.width(&joined, size) <= width => *line = joined,
                _ => lines.push(word.to_owned()),
            }
        }
        lines
    }

    fn widest<'a>(&self, texts: impl Iterator<Item = &'a str>, size: f64) -> f64 {
        texts.map(|text| self.face.width(text, size)).fold(0.0, f64::max)
    }
}

/// A series with its colour and its marker.
pub(super) struct Styled<'a> {
    pub(super) series: &'a Series,
    pub(super) colour: Rgb,
    pub(super) marker: Marker,
}

impl Kind {
    fn is_reference(&self) -> bool {
        matches!(self, Self::Horizontal(_) | Self::Vertical(_) | Self::Diagonal)
    }
}

/// Width of the sample in the legend.
fn swatch(kind: &Kind) -> f64 {
    match kind {
        Kind::Points(_) | Kind::Strip(_) | Kind::Estimates(_) | Kind::Cloud(_) => 8.0,
        Kind::Bars(_) | Kind::Histogram { .. } => 14.0,
        _ => 22.0,
    }
}

fn styled(panel: &Panel) -> Vec<Styled<'_>> {
    let mut next = 0;
    panel
        .series
        .iter()
        .map(|series| {
            let number = match series.colour {
                Colour::Palette(number) => Some(number),
                Colour::Auto if !series.kind.is_reference() => {
                    next += 1;
                    Some(next - 1)
                }
                _ => None,
            };
            let colour = match (number, series.colour) {
                (Some(number), _) => PALETTE[number % PALETTE.len()],
                (None, Colour::Grey) => GREY,
                _ => DARK,
            };
            let ordinary = match series.kind {
                Kind::Cloud(_) => Marker::Dot,
                _ => number.map_or(Marker::Circle, |number| MARKERS[number % MARKERS.len()]),
            };
            Styled { series, colour, marker: series.marker.unwrap_or(ordinary) }
        })
        .collect()
}

/// What the axes of a panel must show.
fn needs(panel: &Panel) -> [Needs; 2] {
    let mut x = Needs::default();
    let mut y = Needs::default();
    // A point of which one coordinate cannot be drawn is not drawn, and does not widen the range of the other.
    let fits = |axis: &super::Axis, value: f64| usable(value) && (axis.scale == super::Scale::Linear || value > 0.0);
    let both = |at: [f64; 2]| (fits(&panel.x, at[0]) && fits(&panel.y, at[1])).then_some(at);
    let mut joined = Vec::new();
    for series in &panel.series {
        match &series.kind {
            Kind::Line(points) | Kind::Dashed(points) | Kind::Points(points) => {
                joined.extend(points.iter().filter_map(|at| both(*at)));
            }
            Kind::Cloud(points) => joined.extend(points.iter().filter_map(|at| both([at[0], at[1]]))),
            Kind::Band(points) => {
                for point in points.iter().filter(|point| both([point.x, point.y]).is_some()) {
                    joined.extend([point.y, point.lower, point.upper].into_iter().filter_map(|y| both([point.x, y])));
                }
            }
            Kind::Estimates(points) => {
                for point in points.iter().filter(|point| both([point.x, point.y]).is_some()) {
                    joined.push([point.x, point.y]);
                    x.values.extend(point.x_interval.into_iter().flatten().filter(|x| fits(&panel.x, *x)));
                    y.values.extend(point.y_interval.into_iter().flatten().filter(|y| fits(&panel.y, *y)));
                }
            }
            Kind::Horizontal(value) => y.values.push(*value),
            Kind::Vertical(value) => x.values.push(*value),
            Kind::Diagonal => {}
            Kind::Bars(values) => {
                y.zero = true;
                y.values.extend(values);
                x.categories = x.categories.max(Some(values.len()));
            }
            Kind::Histogram { edges, counts } => {
                y.zero = true;
                x.values.extend(edges);
                y.values.extend(counts);
            }
            Kind::Strip(groups) => {
                y.values.extend(groups.iter().flatten());
                x.categories = x.categories.max(Some(groups.len()));
            }
            Kind::Cells { values, .. } => {
                y.categories = y.categories.max(Some(values.len()));
                x.categories = x.categories.max(Some(values.iter().map(Vec::len).max().unwrap_or(0)));
            }
        }
    }
    x.values.extend(joined.iter().map(|at| at[0]));
    y.values.extend(joined.iter().map(|at| at[1]));
    [x, y]
}

/// A panel with its axes and what stands around the rectangle between them.
struct Prepared<'a> {
    panel: &'a Panel,
    styled: Vec<Styled<'a>>,
    axes: Option<[Ruler<'a>; 2]>,
    title: Vec<String>,
    /// Rows of the legend: series and the left edges of their entries.
    legend: Vec<(f64, Vec<(usize, f64)>)>,
    /// Room on the left, above, on the right, below.
    room: [f64; 4],
}

fn prepared<'a>(panel: &'a Panel, pen: &Pen, width: f64) -> Prepared<'a> {
    let [x, y] = needs(panel);
    let has_cells = panel.series.iter().any(|series| matches!(series.kind, Kind::Cells { .. }));
    let axes = match (Ruler::new(&panel.x, &x), Ruler::new(&panel.y, &y)) {
        (Some(x), Some(mut y)) => {
            y.reversed = has_cells;
            Some([x, y])
        }
        _ => None,
    };
    let title = pen.wrapped(panel.title.as_deref().unwrap_or_default(), width, HEADING);
    let styled = styled(panel);
    let mut legend: Vec<(f64, Vec<(usize, f64)>)> = Vec::new();
    if panel.legend {
        for (index, entry) in styled.iter().enumerate() {
            if entry.series.label.is_empty() || matches!(entry.series.kind, Kind::Cells { .. }) {
                continue;
            }
            let entry_width = swatch(&entry.series.kind) + 5.0 + pen.face.width(&entry.series.label, SMALL) + 12.0;
            match legend.last_mut() {
                Some((used, row)) if *used + entry_width <= width => {
                    row.push((index, *used));
                    *used += entry_width;
                }
                _ => legend.push((entry_width, vec![(index, 0.0)])),
            }
        }
    }
    Prepared { panel, styled, axes, title, legend, room: [0.0; 4] }
}

impl Prepared<'_> {
    fn x_ticks(&self, pen: &Pen, x: &Ruler<'_>, width: f64) -> Vec<Tick> {
        let mut about = (width / if self.panel.x.scale == super::Scale::Log { 40.0 } else { 55.0 }) as usize;
        loop {
            let ticks = x.ticks(about);
            let place = |tick: &Tick| x.fraction_of(tick.at) * width;
            let half = |tick: &Tick| 0.5 * pen.face.width(&tick.label, SMALL);
            let apart = |pair: &[Tick]| place(&pair[1]) - place(&pair[0]) >= half(&pair[0]) + half(&pair[1]) + 5.0;
            if x.is_named() || about <= 2 || ticks.windows(2).all(apart) {
                return ticks;
            }
            about -= 1;
        }
    }

    fn y_ticks(&self, y: &Ruler<'_>, height: f64) -> Vec<Tick> {
        y.ticks((height / 44.0) as usize)
    }

    /// Room around the rectangle between the axes, if that is about as large.
    fn measure(&mut self, pen: &Pen, size: [f64; 2]) {
        let lines = |count: usize, size: f64| count as f64 * size * LEADING;
        let mut above = lines(self.title.len(), HEADING) + self.legend.len() as f64 * SMALL * 1.5;
        above += if above > 0.0 { 6.0 } else { 8.0 };
        let Some([x, y]) = &self.axes else {
            self.room = [2.0 * LABEL, above, 8.0, 2.0 * LABEL];
            return;
        };
        let y_label = pen.wrapped(&y.label(), size[1], LABEL);
        let ticks = self.y_ticks(y, size[1]);
        let widest = if y.is_named() {
            ticks
                .iter()
                .map(|tick| pen.widest(pen.wrapped(&tick.label, 130.0, SMALL).iter().map(String::as_str), SMALL))
                .fold(0.0, f64::max)
        } else {
            pen.widest(ticks.iter().map(|tick| tick.label.as_str()), SMALL)
        };
        let left = lines(y_label.len(), LABEL) + 4.0 + widest.min(220.0) + TICK + 4.0;
        let ticks = self.x_ticks(pen, x, size[0]);
        let labels = if x.is_named() {
            match self.category_lines(pen, &ticks, size[0]) {
                Some(labels) => lines(labels.iter().map(Vec::len).max().unwrap_or(0), SMALL),
                None => pen.widest(ticks.iter().map(|tick| tick.label.as_str()), SMALL) + 4.0,
            }
        } else {
            lines(1, SMALL)
        };
        let below = TICK + 3.0 + labels + 2.0 + lines(pen.wrapped(&x.label(), size[0], LABEL).len(), LABEL);
        let right = match ticks.last() {
            Some(last) if !x.is_named() => 4.0 + 0.5 * pen.face.width(&last.label, SMALL),
            _ => 8.0,
        };
        self.room = [left, above, right.max(8.0), below];
    }

    /// Names of categories in lines that fit their places. None if they do not fit: they stand upwards then.
    fn category_lines(&self, pen: &Pen, ticks: &[Tick], width: f64) -> Option<Vec<Vec<String>>> {
        let place = width / ticks.len().max(1) as f64 - 4.0;
        let labels: Vec<_> = ticks.iter().map(|tick| pen.wrapped(&tick.label, place, SMALL)).collect();
        let fits = labels.iter().flatten().all(|line| pen.face.width(line, SMALL) <= place);
        fits.then_some(labels)
    }

    /// Width and height that the cells of a table need.
    fn cells(&self) -> [f64; 2] {
        let is_table = self.panel.series.iter().any(|series| matches!(series.kind, Kind::Cells { .. }));
        match &self.axes {
            Some([x, y]) if is_table => [x.length() * CELL[0], y.length() * CELL[1]],
            _ => [0.0, 0.0],
        }
    }

    fn only_cells(&self) -> bool {
        self.cells()[0] > 0.0
    }

    /// The axis with the longer units gets more of them.
    fn equalise(&mut self, size: [f64; 2]) {
        let Some([x, y]) = &mut self.axes else { return };
        let plain = |ruler: &Ruler<'_>, axis: &super::Axis| !ruler.is_named() && axis.scale == super::Scale::Linear;
        if self.panel.equal_aspect && plain(x, &self.panel.x) && plain(y, &self.panel.y) {
            let unit = (x.length() / size[0]).max(y.length() / size[1]);
            x.set_length(unit * size[0]);
            y.set_length(unit * size[1]);
        }
    }
}

/// Places everything of a figure.
pub(super) fn lay_out(figure: &Figure) -> Result<Sheet, FigureError> {
    let mut pen = Pen { face: Face::new()?, shapes: Vec::new() };
    let columns = figure.columns.clamp(1, figure.panels.len().max(1));
    let column_width = match columns {
        1 => 536.0,
        2 => 380.0,
        _ => 320.0,
    };
    let mut panels: Vec<_> = figure.panels.iter().map(|panel| prepared(panel, &pen, column_width)).collect();
    let columns_of = |index: usize| index % columns;
    let rows = panels.len().div_ceil(columns);
    let base_height = |panel: &Prepared<'_>| match (panel.only_cells(), panel.panel.equal_aspect, columns) {
        (true, _, _) => panel.cells()[1],
        (_, true, 1) => 420.0,
        (_, true, 2) => 310.0,
        (_, false, 1) => 320.0,
        _ => 250.0,
    };
    let heights: Vec<f64> =
        (0..rows).map(|row| panels.iter().skip(row * columns).take(columns).map(base_height).fold(0.0, f64::max)).collect();
    // Room for ticks depends on the ranges, these on the room where a unit is as long on both axes: the second time is enough.
    let mut widths = vec![column_width; columns];
    let (mut lefts, mut rights) = (vec![0.0_f64; columns], vec![0.0_f64; columns]);
    for _ in 0..2 {
        for (index, panel) in panels.iter_mut().enumerate() {
            let column = columns_of(index);
            let width = (widths[column] - lefts[column] - rights[column]).max(40.0);
            panel.equalise([width, heights[index / columns]]);
            panel.measure(&pen, [width, heights[index / columns]]);
        }
        for column in 0..columns {
            let own = || panels.iter().skip(column).step_by(columns);
            lefts[column] = own().map(|panel| panel.room[0]).fold(0.0, f64::max);
            rights[column] = own().map(|panel| panel.room[2]).fold(0.0, f64::max);
            let inner = own().map(|panel| panel.cells()[0]).fold(100.0, f64::max);
            widths[column] = column_width.max(lefts[column] + inner + rights[column]);
        }
    }
    let width = 2.0 * MARGIN + widths.iter().sum::<f64>() + GAP * (columns - 1) as f64;
    let title = pen.wrapped(&figure.title, width - 2.0 * MARGIN, TITLE);
    let mut top = MARGIN;
    pen.lines(&title, [0.5 * width, top], TITLE, Anchor::Middle);
    top += title.len() as f64 * TITLE * LEADING + if title.is_empty() { 0.0 } else { 6.0 };
    if panels.is_empty() {
        pen.text("no data", [0.5 * width, top + 60.0], LABEL, Anchor::Middle);
        top += 120.0;
    }
    for (row, inner_height) in heights.iter().copied().enumerate() {
        let members = || panels.iter().skip(row * columns).take(columns);
        let above = members().map(|panel| panel.room[1]).fold(0.0, f64::max);
        let below = members().map(|panel| panel.room[3]).fold(0.0, f64::max);
        let mut left = MARGIN;
        // Nothing of a figure that is too large need be drawn.
        if width * (top + above + inner_height + below) > 64e6 {
            return Err(FigureError::TooLarge { width, height: top + above + inner_height + below });
        }
        for (index, panel) in panels.iter_mut().enumerate().skip(row * columns).take(columns) {
            let column = columns_of(index);
            let outer = [left, left + widths[column]];
            let inner =
                Rect { x: [left + lefts[column], outer[1] - rights[column]], y: [top + above, top + above + inner_height] };
            panel.equalise([inner.width(), inner.height()]);
            panel.draw(&mut pen, inner, outer, below);
            left = outer[1] + GAP;
        }
        top += above + inner_height + below + if row + 1 < rows { GAP } else { 0.0 };
    }
    Ok(Sheet { width, height: top + MARGIN, shapes: pen.shapes })
}

impl Prepared<'_> {
    fn draw(&self, pen: &mut Pen, inner: Rect, outer: [f64; 2], below: f64) {
        let middle = inner.middle()[0];
        let heading = self.title.len() as f64 * HEADING * LEADING;
        let mut top = inner.y[0] - 5.0 - self.legend.len() as f64 * SMALL * 1.5;
        pen.lines(&self.title, [0.5 * (outer[0] + outer[1]), top - heading], HEADING, Anchor::Middle);
        for (width, row) in &self.legend {
            // In the middle of the axes, if it does not leave the panel there.
            let left = (middle - 0.5 * width).min(outer[1] - width).max(outer[0]);
            for (index, at) in row {
                self.legend_entry(pen, &self.styled[*index], [left + at, top + 0.75 * SMALL]);
            }
            top += SMALL * 1.5;
        }
        if let Some(z) = &self.panel.z {
            let whole = Rect { x: outer, y: [inner.y[0], inner.y[1] + below] };
            if !spatial::draw(pen, self.panel, z, &self.styled, whole) {
                self.empty(pen, inner);
            }
            return;
        }
        let Some([x, y]) = &self.axes else {
            self.empty(pen, inner);
            return;
        };
        let plot = Plot { x, y, rect: inner };
        let tables = self.only_cells();
        if !tables {
            self.grid(pen, &plot);
        }
        let mut drawn = false;
        for pass in [true, false] {
            for entry in self.styled.iter().filter(|entry| entry.series.kind.is_reference() == pass) {
                drawn |= self.series(pen, &plot, entry);
            }
        }
        if !drawn {
            pen.coloured_text("no data", inner.middle(), LABEL, Anchor::Middle, [130, 130, 130]);
        }
        let mut frame = inner.corners();
        frame.push(frame[0]);
        pen.path(frame, DARK, 0.9);
        self.labels(pen, &plot, !tables);
    }

    fn empty(&self, pen: &mut Pen, inner: Rect) {
        let mut frame = inner.corners();
        frame.push(frame[0]);
        pen.path(frame, DARK, 0.9);
        pen.coloured_text("no data", inner.middle(), LABEL, Anchor::Middle, [130, 130, 130]);
        pen.text(&self.panel.x.label, [inner.middle()[0], inner.y[1] + LABEL], LABEL, Anchor::Middle);
        pen.upwards(&self.panel.y.label, [inner.x[0] - LABEL, inner.middle()[1]], LABEL, Anchor::Middle);
    }

    fn legend_entry(&self, pen: &mut Pen, entry: &Styled<'_>, [left, y]: [f64; 2]) {
        let (colour, right) = (entry.colour, left + swatch(&entry.series.kind));
        let middle = 0.5 * (left + right);
        let across = vec![[left, y], [right, y]];
        let patch = |height: f64| Rect { x: [left, right], y: [y - height, y + height] }.corners();
        match &entry.series.kind {
            Kind::Line(_) => pen.path(across, colour, 1.6),
            Kind::Dashed(_) => pen.dashed(&across, colour, 1.6),
            Kind::Horizontal(_) | Kind::Vertical(_) | Kind::Diagonal => pen.dashed(&across, colour, 1.2),
            Kind::Band(_) => {
                pen.area(patch(4.0), colour, 0.2);
                pen.path(across, colour, 1.6);
            }
            Kind::Estimates(_) => pen.path(vec![[middle, y - 5.5], [middle, y + 5.5]], colour, 1.1),
            Kind::Bars(_) | Kind::Histogram { .. } => pen.area(patch(3.5), colour, 1.0),
            Kind::Points(_) | Kind::Strip(_) | Kind::Cloud(_) | Kind::Cells { .. } => {}
        }
        let marks = match entry.series.kind {
            Kind::Line(_) | Kind::Dashed(_) | Kind::Band(_) => entry.series.marker.is_some(),
            Kind::Points(_) | Kind::Strip(_) | Kind::Estimates(_) | Kind::Cloud(_) => true,
            _ => false,
        };
        if marks {
            // A dot alone is not seen.
            let marker = if entry.marker == Marker::Dot { Marker::Circle } else { entry.marker };
            pen.marker(marker, [middle, y], colour);
        }
        pen.text(&entry.series.label, [right + 5.0, y], SMALL, Anchor::Start);
    }

    fn grid(&self, pen: &mut Pen, plot: &Plot<'_>) {
        let Rect { x, y } = plot.rect;
        let light = [242, 242, 242];
        let columns = |at: f64| plot.column(plot.x.fraction_of(at));
        let rows = |at: f64| plot.row(plot.y.fraction_of(at));
        for at in plot.x.minor_ticks() {
            pen.path(vec![[columns(at), y[0]], [columns(at), y[1]]], light, 0.5);
        }
        for at in plot.y.minor_ticks() {
            pen.path(vec![[x[0], rows(at)], [x[1], rows(at)]], light, 0.5);
        }
        if !plot.x.is_named() {
            for tick in self.x_ticks(pen, plot.x, plot.rect.width()) {
                pen.path(vec![[columns(tick.at), y[0]], [columns(tick.at), y[1]]], GRID, 0.6);
            }
        }
        for tick in self.y_ticks(plot.y, plot.rect.height()) {
            pen.path(vec![[x[0], rows(tick.at)], [x[1], rows(tick.at)]], GRID, 0.6);
        }
    }

    fn labels(&self, pen: &mut Pen, plot: &Plot<'_>, marks: bool) {
        let Rect { x, y } = plot.rect;
        let ticks = self.x_ticks(pen, plot.x, plot.rect.width());
        let names = plot.x.is_named().then(|| self.category_lines(pen, &ticks, plot.rect.width()));
        let mut below = y[1] + TICK + 3.0;
        let mut lowest = below;
        for (index, tick) in ticks.iter().enumerate() {
            let column = plot.column(plot.x.fraction_of(tick.at));
            if marks {
                pen.path(vec![[column, y[1]], [column, y[1] + TICK]], DARK, 0.9);
            }
            let height = match &names {
                Some(Some(lines)) => {
                    pen.lines(&lines[index], [column, below], SMALL, Anchor::Middle);
                    lines[index].len() as f64 * SMALL * LEADING
                }
                Some(None) => {
                    pen.upwards(&tick.label, [column, below], SMALL, Anchor::End);
                    pen.face.width(&tick.label, SMALL) + 4.0
                }
                None => {
                    pen.text(&tick.label, [column, below + 0.5 * SMALL * LEADING], SMALL, Anchor::Middle);
                    SMALL * LEADING
                }
            };
            lowest = lowest.max(below + height);
        }
        for at in plot.x.minor_ticks() {
            let column = plot.column(plot.x.fraction_of(at));
            pen.path(vec![[column, y[1]], [column, y[1] + 0.5 * TICK]], DARK, 0.6);
        }
        below = lowest + 2.0;
        let label = pen.wrapped(&plot.x.label(), plot.rect.width(), LABEL);
        pen.lines(&label, [plot.rect.middle()[0], below], LABEL, Anchor::Middle);
        let mut widest = 0.0_f64;
        for tick in self.y_ticks(plot.y, plot.rect.height()) {
            let row = plot.row(plot.y.fraction_of(tick.at));
            if marks {
                pen.path(vec![[x[0] - TICK, row], [x[0], row]], DARK, 0.9);
            }
            let lines = if plot.y.is_named() { pen.wrapped(&tick.label, 130.0, SMALL) } else { vec![tick.label] };
            let top = row - 0.5 * lines.len() as f64 * SMALL * LEADING;
            widest = widest.max(pen.widest(lines.iter().map(String::as_str), SMALL));
            pen.lines(&lines, [x[0] - TICK - 3.0, top], SMALL, Anchor::End);
        }
        for at in plot.y.minor_ticks() {
            let row = plot.row(plot.y.fraction_of(at));
            pen.path(vec![[x[0] - 0.5 * TICK, row], [x[0], row]], DARK, 0.6);
        }
        let label = pen.wrapped(&plot.y.label(), plot.rect.height(), LABEL);
        for (line, text) in label.iter().rev().enumerate() {
            let column = x[0] - TICK - 3.0 - widest - 5.0 - (line as f64 + 0.5) * LABEL * LEADING;
            pen.upwards(text, [column, plot.rect.middle()[1]], LABEL, Anchor::Middle);
        }
    }

    /// Draws a series; false if nothing of it can be drawn.
    fn series(&self, pen: &mut Pen, plot: &Plot<'_>, entry: &Styled<'_>) -> bool {
        let colour = entry.colour;
        match &entry.series.kind {
            Kind::Line(points) | Kind::Dashed(points) => {
                let dashed = matches!(entry.series.kind, Kind::Dashed(_));
                let drawn = plot.line(pen, points.iter().copied(), colour, 1.6, dashed);
                let marks = entry.series.marker.is_some() && plot.points(pen, points.iter().copied(), entry);
                drawn || marks
            }
            Kind::Points(points) => plot.points(pen, points.iter().copied(), entry),
            Kind::Cloud(points) => plot.points(pen, points.iter().map(|at| [at[0], at[1]]), entry),
            Kind::Band(points) => {
                let drawn = plot.band(pen, points, colour);
                let line = || points.iter().map(|point| [point.x, point.y]);
                let lines = plot.line(pen, line(), colour, 1.6, false);
                let marks = entry.series.marker.is_some() && plot.points(pen, line(), entry);
                drawn || lines || marks
            }
            Kind::Estimates(points) => {
                for point in points {
                    plot.interval(pen, point, colour);
                }
                plot.points(pen, points.iter().map(|point| [point.x, point.y]), entry)
            }
            Kind::Horizontal(value) => self.reference(pen, plot, entry, plot.y.fraction(*value).map(|at| [[0.0, at], [1.0, at]])),
            Kind::Vertical(value) => self.reference(pen, plot, entry, plot.x.fraction(*value).map(|at| [[at, 0.0], [at, 1.0]])),
            Kind::Diagonal => {
                let from = plot.x.value(0.0).max(plot.y.value(0.0));
                let to = plot.x.value(1.0).min(plot.y.value(1.0));
                let at = |value: f64| Some([plot.x.fraction(value)?, plot.y.fraction(value)?]);
                let ends = if from < to { at(from).zip(at(to)).map(|(from, to)| [from, to]) } else { None };
                self.reference(pen, plot, entry, ends)
            }
            Kind::Bars(values) => {
                let bars: Vec<&Styled<'_>> =
                    self.styled.iter().filter(|other| matches!(other.series.kind, Kind::Bars(_))).collect();
                let own = bars.iter().position(|other| std::ptr::eq(*other, entry)).unwrap_or(0);
                let width = 0.8 / bars.len().max(1) as f64;
                let mut drawn = false;
                for (category, value) in values.iter().enumerate() {
                    let left = category as f64 - 0.4 + own as f64 * width;
                    drawn |= plot.bar(pen, [left + 0.03 * width, left + 0.97 * width], *value, colour);
                }
                drawn
            }
            Kind::Histogram { edges, counts } => {
                let mut drawn = false;
                for (edge, count) in edges.windows(2).zip(counts) {
                    drawn |= plot.bar(pen, [edge[0], edge[1]], *count, colour);
                }
                drawn
            }
            Kind::Strip(groups) => {
                let strips: Vec<&Styled<'_>> =
                    self.styled.iter().filter(|other| matches!(other.series.kind, Kind::Strip(_))).collect();
                let own = strips.iter().position(|other| std::ptr::eq(*other, entry)).unwrap_or(0);
                let width = 0.8 / strips.len().max(1) as f64;
                let mut drawn = false;
                for (category, values) in groups.iter().enumerate() {
                    let middle = category as f64 - 0.4 + (own as f64 + 0.5) * width;
                    drawn |= plot.strip(pen, middle, width, values, entry);
                }
                drawn
            }
            Kind::Cells { values, digits, shade } => plot.cells(pen, values, *digits, *shade),
        }
    }

    fn reference(&self, pen: &mut Pen, plot: &Plot<'_>, entry: &Styled<'_>, ends: Option<[[f64; 2]; 2]>) -> bool {
        let inside = |ends: &[[f64; 2]; 2]| ends.iter().flatten().all(|at| (-1e-9..=1.0 + 1e-9).contains(at));
        let Some(ends) = ends.filter(inside) else { return false };
        let points = ends.map(|[x, y]| [plot.column(x), plot.row(y)]);
        pen.dashed(&points, entry.colour, 1.2);
        if !self.panel.legend && !entry.series.label.is_empty() {
            let [from, to] = points;
            let label = &entry.series.label;
            if matches!(entry.series.kind, Kind::Vertical(_)) {
                let fits = from[0] + 4.0 + pen.face.width(label, SMALL) < plot.rect.x[1];
                let (at, anchor) = if fits { (from[0] + 4.0, Anchor::Start) } else { (from[0] - 4.0, Anchor::End) };
                pen.noted(label, [at, plot.rect.y[0] + SMALL], anchor);
            } else {
                let row = if to[1] - 1.4 * SMALL > plot.rect.y[0] { to[1] - 0.8 * SMALL } else { to[1] + 0.8 * SMALL };
                pen.noted(label, [to[0] - 4.0, row], Anchor::End);
            }
        }
        true
    }
}

/// The rectangle between two axes.
struct Plot<'a> {
    x: &'a Ruler<'a>,
    y: &'a Ruler<'a>,
    rect: Rect,
}

impl Plot<'_> {
    fn column(&self, fraction: f64) -> f64 {
        self.rect.x[0] + fraction * self.rect.width()
    }

    fn row(&self, fraction: f64) -> f64 {
        self.rect.y[1] - fraction * self.rect.height()
    }

    /// Place of a point. It may be outside.
    fn place(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        Some([self.column(self.x.fraction(x)?), self.row(self.y.fraction(y)?)])
    }

    fn is_inside(&self, [x, y]: [f64; 2]) -> bool {
        let within = |[from, to]: [f64; 2], at: f64| at >= from - 1e-6 && at <= to + 1e-6;
        within(self.rect.x, x) && within(self.rect.y, y)
    }

    fn points(&self, pen: &mut Pen, points: impl Iterator<Item = [f64; 2]>, entry: &Styled<'_>) -> bool {
        let mut drawn = false;
        for place in points.filter_map(|point| self.place(point)).filter(|place| self.is_inside(*place)) {
            pen.marker(entry.marker, place, entry.colour);
            drawn = true;
        }
        drawn
    }

    /// The part of a segment that is inside.
    fn clipped(&self, from: [f64; 2], to: [f64; 2]) -> Option<[[f64; 2]; 2]> {
        let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
        for (axis, range) in [self.rect.x, self.rect.y].into_iter().enumerate() {
            let step = to[axis] - from[axis];
            if step == 0.0 {
                if from[axis] < range[0] - 1e-6 || from[axis] > range[1] + 1e-6 {
                    return None;
                }
                continue;
            }
            let [first, last] = [(range[0] - from[axis]) / step, (range[1] - from[axis]) / step];
            enters = enters.max(first.min(last));
            leaves = leaves.min(first.max(last));
        }
        let at = |share: f64| [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]));
        (enters <= leaves).then(|| [at(enters), at(leaves)])
    }

    fn line(&self, pen: &mut Pen, points: impl Iterator<Item = [f64; 2]>, colour: Rgb, width: f64, dashed: bool) -> bool {
        let places: Vec<Option<[f64; 2]>> = points.map(|point| self.place(point)).collect();
        let mut paths: Vec<Vec<[f64; 2]>> = Vec::new();
        for pair in places.windows(2) {
            let (Some(from), Some(to)) = (pair[0], pair[1]) else { continue };
            let Some([start, end]) = self.clipped(from, to) else { continue };
            match paths.last_mut() {
                Some(path) if path.last() == Some(&start) => path.push(end),
                _ => paths.push(vec![start, end]),
            }
        }
        // A point without neighbours is no line, but it is not nothing.
        for (index, place) in places.iter().enumerate() {
            let alone = |other: Option<&Option<[f64; 2]>>| other.is_none_or(Option::is_none);
            let before = index.checked_sub(1).and_then(|before| places.get(before));
            if let Some(place) = place.filter(|place| self.is_inside(*place))
                && alone(before)
                && alone(places.get(index + 1))
            {
                paths.push(vec![place, [place[0] + 0.01, place[1]]]);
            }
        }
        let drawn = !paths.is_empty();
        for path in paths {
            if dashed { pen.dashed(&path, colour, width) } else { pen.path(path, colour, width) }
        }
        drawn
    }

    /// The area of a band; above and below it ends at the panel.
    fn band(&self, pen: &mut Pen, points: &[super::BandPoint], colour: Rgb) -> bool {
        let edge = |point: &super::BandPoint| {
            let lower = self.place([point.x, point.lower])?;
            let upper = self.place([point.x, point.upper])?;
            let inside = self.is_inside([lower[0], self.rect.y[0]]);
            let row = |y: f64| y.clamp(self.rect.y[0], self.rect.y[1]);
            inside.then(|| ([lower[0], row(lower[1])], [upper[0], row(upper[1])]))
        };
        let mut drawn = false;
        let mut run: Vec<([f64; 2], [f64; 2])> = Vec::new();
        for edge in points.iter().map(edge).chain([None]) {
            if let Some(edge) = edge {
                run.push(edge);
                continue;
            }
            if run.len() > 1 {
                let outline = run.iter().map(|(lower, _)| *lower).chain(run.iter().rev().map(|(_, upper)| *upper));
                pen.area(outline.collect(), colour, 0.2);
                drawn = true;
            }
            run.clear();
        }
        drawn
    }

    fn interval(&self, pen: &mut Pen, point: &super::Estimate, colour: Rgb) {
        let Some(middle) = self.place([point.x, point.y]).filter(|at| self.is_inside(*at)) else { return };
        let ends = [
            point.x_interval.and_then(|[from, to]| Some([self.place([from, point.y])?, self.place([to, point.y])?])),
            point.y_interval.and_then(|[from, to]| Some([self.place([point.x, from])?, self.place([point.x, to])?])),
        ];
        for (axis, ends) in ends.into_iter().enumerate() {
            let Some([from, to]) = ends else { continue };
            let Some(inside) = self.clipped(from, to) else { continue };
            pen.path(inside.to_vec(), colour, 1.1);
            for end in [from, to].into_iter().filter(|end| self.is_inside(*end)) {
                let cap = if axis == 0 { [0.0, 3.0] } else { [3.0, 0.0] };
                if (end[0] - middle[0]).abs() + (end[1] - middle[1]).abs() > 0.5 {
                    pen.path(vec![[end[0] - cap[0], end[1] - cap[1]], [end[0] + cap[0], end[1] + cap[1]]], colour, 1.1);
                }
            }
        }
    }

    fn bar(&self, pen: &mut Pen, [left, right]: [f64; 2], value: f64, colour: Rgb) -> bool {
        let (Some(left), Some(right), Some(top)) = (self.x.fraction(left), self.x.fraction(right), self.y.fraction(value)) else {
            return false;
        };
        let (left, right) = (left.clamp(0.0, 1.0), right.clamp(0.0, 1.0));
        if left >= right {
            return false;
        }
        let rect = Rect {
            x: [self.column(left) + 0.25, self.column(right) - 0.25],
            y: [self.row(self.y.base()), self.row(top.clamp(0.0, 1.0))],
        };
        pen.area(rect.corners(), colour, 1.0);
        true
    }

    /// Values as points around the middle of their place, each as near to it as those before allow.
    fn strip(&self, pen: &mut Pen, middle: f64, width: f64, values: &[f64], entry: &Styled<'_>) -> bool {
        let mut rows: Vec<f64> = values
            .iter()
            .filter_map(|value| self.place([middle, *value]))
            .filter(|place| self.is_inside(*place))
            .map(|place| place[1])
            .collect();
        if rows.is_empty() {
            return false;
        }
        rows.sort_by(f64::total_cmp);
        let column = self.column(self.x.fraction_of(middle));
        let half = 0.5 * width * self.rect.width() / self.x.length();
        let radius = if entry.marker == Marker::Dot { 1.25 } else { RADIUS };
        let mut placed: Vec<[f64; 2]> = Vec::new();
        for row in rows {
            let near: Vec<[f64; 2]> = placed.iter().rev().take_while(|other| row - other[1] < 1.8 * radius).copied().collect();
            let steps = ((half - radius) / (0.5 * radius)).max(0.0) as i32;
            let offsets = (0..=steps).flat_map(|step| [step, -step]).map(|step| f64::from(step) * 0.5 * radius);
            let is_free = |offset: &f64| {
                near.iter().all(|other| {
                    let (dx, dy) = (other[0] - offset, other[1] - row);
                    dx * dx + dy * dy >= 3.24 * radius * radius
                })
            };
            let offset = offsets.into_iter().find(is_free).unwrap_or(0.0);
            placed.push([offset, row]);
            pen.marker(entry.marker, [column + offset, row], entry.colour);
        }
        let shown: Vec<f64> = values.iter().copied().filter(|value| self.y.fraction(*value).is_some()).collect();
        let mean = shown.iter().map(|value| value / shown.len() as f64).sum();
        if let Some([_, row]) = self.place([middle, mean]).filter(|place| self.is_inside(*place)) {
            pen.path(vec![[column - 0.8 * half, row], [column + 0.8 * half, row]], DARK, 1.8);
        }
        true
    }

    fn cells(&self, pen: &mut Pen, values: &[Vec<f64>], digits: usize, shade: Shade) -> bool {
        let among = |row: usize, column: usize| match shade {
            Shade::Table => extent(values.iter().flatten().copied().filter(|value| usable(*value))),
            Shade::Rows => extent(values[row].iter().copied().filter(|value| usable(*value))),
            Shade::Columns => extent(values.iter().filter_map(|row| row.get(column)).copied().filter(|value| usable(*value))),
        };
        let mut drawn = false;
        let columns = values.iter().map(Vec::len).max().unwrap_or(0);
        // Once for each line, not for each cell.
        let of_column: Vec<_> = (0..columns).map(|column| if shade == Shade::Rows { None } else { among(0, column) }).collect();
        for (row, line) in values.iter().enumerate() {
            let of_row = if shade == Shade::Rows { among(row, 0) } else { None };
            for (column, of_column) in of_column.iter().enumerate() {
                let value = line.get(column).copied().unwrap_or(f64::NAN);
                let at = |x: f64, y: f64| Some([self.x.fraction(column as f64 + x)?, self.y.fraction(row as f64 + y)?]);
                let (Some(first), Some(last)) = (at(-0.5, -0.5), at(0.5, 0.5)) else { continue };
                let rect = Rect { x: [self.column(first[0]), self.column(last[0])], y: [self.row(first[1]), self.row(last[1])] };
                let (text, dark) = match of_row.or(*of_column) {
                    Some([from, to]) if usable(value) => {
                        let dark = if to > from { (value - from) / (to - from) } else { 0.0 };
                        (significant(value, digits), Some(dark))
                    }
                    _ => ("–".to_owned(), None),
                };
                let colour = dark.map_or([238, 238, 238], shaded);
                pen.area(rect.corners(), colour, 1.0);
                let mut edge = rect.corners();
                edge.push(edge[0]);
                pen.path(edge, WHITE, 1.0);
                let letters = if dark.is_some_and(|dark| dark > 0.55) { WHITE } else { TEXT };
                pen.coloured_text(&text, rect.middle(), SMALL, Anchor::Middle, letters);
                drawn = true;
            }
        }
        drawn
    }
}

/// From almost white over light blue to dark blue.
fn shaded(dark: f64) -> Rgb {
    const STOPS: [[f64; 3]; 3] = [[241.0, 246.0, 251.0], [107.0, 174.0, 214.0], [8.0, 64.0, 129.0]];
    let at = dark.clamp(0.0, 1.0) * 2.0;
    let index = (at as usize).min(1);
    let share = at - index as f64;
    [0, 1, 2].map(|i| (STOPS[index][i] + share * (STOPS[index + 1][i] - STOPS[index][i])).round() as u8)
}
