//! Samples of every kind of figure, and what must not go wrong with any data. `KINCAL_FIGURES=folder` keeps the samples.

use super::axis::{Needs, Ruler, significant};
use super::face::Face;
use super::*;

/// A sequence that looks random and is the same everywhere.
fn noise(count: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(2).wrapping_add(1);
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    // Almost normal.
    (0..count).map(|_| (0..6).map(|_| next()).sum::<f64>() - 3.0).collect()
}

fn end_points() -> Figure {
    let [a, b, c] = [noise(3000, 1), noise(3000, 2), noise(3000, 3)];
    let cloud: Vec<[f64; 3]> = (0..3000)
        .filter_map(|i| {
            let length = (a[i] * a[i] + b[i] * b[i] + c[i] * c[i]).sqrt();
            let radius = 0.55 + 0.35 * c[(i * 7) % 3000].abs().min(1.0);
            (c[i] > -0.4).then(|| [a[i] / length * radius, b[i] / length * radius, c[i] / length * radius + 0.33])
        })
        .collect();
    let chosen: Vec<[f64; 3]> = cloud.iter().skip(5).step_by(80).map(|p| p.map(|v| v * 0.97)).collect();
    let plane = |i: usize, j: usize, title: &str| {
        let names = ["x (m)", "y (m)", "z (m)"];
        let flat = |points: &[[f64; 3]]| Kind::Points(points.iter().map(|p| [p[i], p[j]]).collect());
        Panel::new(Axis::linear(names[i]), Axis::linear(names[j]))
            .titled(title)
            .equal()
            .with(Series::new("reachable", flat(&cloud)).colour(Colour::Grey).marker(Marker::Dot))
            .with(Series::new("chosen", flat(&chosen)))
    };
    Figure::new("End points of the 30 chosen configurations", 2)
        .with(plane(0, 1, "(a) XOY"))
        .with(plane(0, 2, "(b) XOZ"))
        .with(plane(1, 2, "(c) YOZ"))
        .with(
            Panel::spatial(Axis::linear("x (m)"), Axis::linear("y (m)"), Axis::linear("z (m)"))
                .titled("(d) in space")
                .with(Series::new("reachable", Kind::Cloud(cloud.clone())).colour(Colour::Grey))
                .with(Series::new("chosen", Kind::Cloud(chosen.clone())).marker(Marker::Circle)),
        )
}

fn errors_by_count() -> Figure {
    let counts = [6.0, 8.0, 10.0, 15.0, 20.0, 30.0, 40.0, 60.0, 80.0, 100.0];
    let band = |scale: f64| {
        let of = |n: &f64| scale / n.sqrt();
        Kind::Band(counts.iter().map(|n| BandPoint { x: *n, y: of(n), lower: of(n) * 0.8, upper: of(n) * 1.3 }).collect())
    };
    let paper = Kind::Points(vec![[10.0, 0.21], [20.0, 0.13], [30.0, 0.12], [50.0, 0.1]]);
    let panel = |x: Axis, y: Axis| {
        Panel::new(x, y)
            .with(Series::new("optimal set, 95 %", band(0.6)))
            .with(Series::new("random sets, 95 %", band(1.1)))
            .with(Series::new("paper", paper.clone()).colour(Colour::Dark).marker(Marker::Diamond))
            .with(Series::new("bound σ/√n", Kind::Horizontal(0.05)))
    };
    Figure::new("Error after calibration", 2)
        .with(panel(Axis::log("number of configurations"), Axis::log("position error (mm)")).titled("(a) logarithmic"))
        .with(
            panel(Axis::linear("number of configurations").zero(), Axis::linear("position error (mm)").zero())
                .titled("(b) linear"),
        )
}

fn trials() -> Figure {
    let panel = |title: &str, unit: &str, scale: f64| {
        let mut panel = Panel::new(Axis::linear("trial"), Axis::linear(unit)).titled(title);
        for (number, (name, mean)) in [("design A", 1.0), ("design B", 1.35)].into_iter().enumerate() {
            let values = noise(20, number as u64 + 5).into_iter().map(|v| scale * (mean + 0.12 * v));
            let points: Vec<[f64; 2]> = values.enumerate().map(|(i, v)| [i as f64 + 1.0, v]).collect();
            let mean = points.iter().map(|p| p[1]).sum::<f64>() / 20.0;
            panel = panel
                .with(Series::new(name, Kind::Points(points)))
                .with(Series::new(format!("mean of {}", &name[7..]), Kind::Horizontal(mean)).colour(Colour::Palette(number)));
        }
        panel
    };
    Figure::new("", 2).with(panel("Position", "position error (mm)", 0.32)).with(panel(
        "Orientation",
        "orientation error (°)",
        0.0021,
    ))
}

fn random_sets() -> Figure {
    let values: Vec<f64> = noise(500, 9).into_iter().map(|v| 1.46 + 0.05 * v).collect();
    let points = values.iter().enumerate().map(|(i, v)| [i as f64 + 1.0, *v]).collect();
    Figure::new("Comprehensive index O_C of 500 random sets", 2)
        .with(
            Panel::new(Axis::linear("set"), Axis::linear("O_C"))
                .with(Series::new("random sets", Kind::Points(points)).marker(Marker::Dot))
                .with(Series::new("optimum", Kind::Horizontal(1.71)).colour(Colour::Palette(1))),
        )
        .with(
            Panel::new(Axis::linear("O_C"), Axis::linear("sets"))
                .unlabelled()
                .with(Series::new("random sets", Kind::histogram(&values, 25)))
                .with(Series::new("optimum 1.71", Kind::Vertical(1.71)).colour(Colour::Palette(1)))
                .with(Series::new("paper", Kind::Horizontal(30.0))),
        )
}

fn methods() -> Figure {
    let values = vec![
        vec![1.71, 0.034, 12.5, 0.112, 0.0031],
        vec![1.52, 0.021, 10.1, 0.145, 0.0042],
        vec![1.49, 0.012, 9.99, f64::NAN, 0.0051],
        vec![1.3, 0.000_02, 8.2, 0.31, 123_456_789.0],
    ];
    let names = ["PSO, comprehensive index", "PSO, O1 only", "DETMAX", "random"];
    Figure::new("Method by criterion", 1).with(
        Panel::new(
            Axis::categories("criterion", ["O_C", "O₂", "O3", "position error (mm)", "orientation error (°)"]),
            Axis::categories("", names),
        )
        .with(Series::new("", Kind::Cells { values, digits: 3, shade: Shade::Columns })),
    )
}

fn gains() -> Figure {
    let points = noise(9, 4)
        .into_iter()
        .enumerate()
        .map(|(i, v)| {
            let x = 1.1 + 0.2 * i as f64;
            let y = x + 0.08 * v;
            Estimate { x, y, x_interval: None, y_interval: Some([y - 0.15, y + 0.2]) }
        })
        .collect();
    Figure::new("Predicted and measured gain of a design over random sets", 1).with(
        Panel::new(Axis::linear("predicted gain (×)"), Axis::linear("measured gain (×), 95 %"))
            .equal()
            .with(Series::new("scenes", Kind::Estimates(points)))
            .with(Series::new("equal", Kind::Diagonal)),
    )
}

fn groups() -> Figure {
    let strip = |mean: f64, seed: u64| {
        Kind::Strip(
            (0..3).map(|k| noise(40, seed + k).into_iter().map(|v| mean * (1.0 + 0.2 * v) + 0.1 * k as f64).collect()).collect(),
        )
    };
    let names = ["UR5e", "a long name of an arm", "ABB IRB 120"];
    Figure::new("Groups", 2)
        .with(
            Panel::new(Axis::categories("arm", names), Axis::linear("error (µm)").zero())
                .with(Series::new("before", strip(1.5, 20)))
                .with(Series::new("after ± σ", strip(0.4, 30))),
        )
        .with(
            Panel::new(Axis::categories("arm", names), Axis::linear("error (µm)"))
                .with(Series::new("before", Kind::Bars(vec![1.5, 1.8, 1.6])))
                .with(Series::new("after", Kind::Bars(vec![0.4, f64::NAN, -0.2]))),
        )
        .with(
            Panel::new(Axis::linear("iteration"), Axis::log("cost (m²)"))
                .with(Series::new("swarm", Kind::Line((0..60).map(|i| [f64::from(i), 3e-5 / f64::from(i * i + 1)]).collect())))
                .with(Series::new("single", Kind::Dashed((0..60).map(|i| [f64::from(i), 5e-5 / f64::from(i + 1)]).collect()))),
        )
        .with(Panel::new(Axis::linear("nothing (m)"), Axis::linear("at all (m)")))
}

fn samples() -> Vec<(&'static str, Figure)> {
    vec![
        ("end_points", end_points()),
        ("errors_by_count", errors_by_count()),
        ("trials", trials()),
        ("random_sets", random_sets()),
        ("methods", methods()),
        ("gains", gains()),
        ("groups", groups()),
    ]
}

/// Width, height and the pixels: red, green, blue and opacity.
fn decoded(bytes: &[u8]) -> (u32, u32, Vec<u8>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    (info.width, info.height, pixels)
}

fn count(text: &str, part: &str) -> usize {
    text.matches(part).count()
}

/// Marks that a panel adds to the same panel without data.
fn marks(kind: Kind, part: &str) -> usize {
    let panel = |kind| {
        let axes = [Axis::linear("x (mm)").range(0.0, 10.0), Axis::linear("y (°)").range(0.0, 10.0)];
        let [x, y] = axes;
        let series = Series::new("the label", kind).colour(Colour::Palette(0));
        Figure::new("the title", 1).with(Panel::new(x, y).unlabelled().with(series)).svg().unwrap()
    };
    let (full, empty) = (panel(kind), panel(Kind::Points(Vec::new())));
    for text in ["x (mm)", "y (°)", "the title"] {
        assert!(full.contains(text) && empty.contains(text), "{text}");
    }
    assert!(empty.contains("no data") && !full.contains("no data"));
    count(&full, part) - count(&empty, part)
}

#[test]
fn samples_are_drawn_and_the_same_again_in_other_threads() {
    let folder = std::env::var("KINCAL_FIGURES").ok();
    for (name, figure) in samples() {
        let start = std::time::Instant::now();
        let svg = figure.svg().unwrap();
        let drawn = start.elapsed();
        let png = figure.png().unwrap();
        if let Some(folder) = &folder {
            println!("{name}: svg {drawn:?}, both {:?}; {} and {} bytes", start.elapsed(), svg.len(), png.len());
            std::fs::create_dir_all(folder).unwrap();
            std::fs::write(format!("{folder}/{name}.svg"), &svg).unwrap();
            std::fs::write(format!("{folder}/{name}.png"), &png).unwrap();
        }
        let again = std::thread::spawn(move || (figure.svg().unwrap(), figure.png().unwrap()));
        assert!((svg, png) == again.join().unwrap(), "{name}");
    }
}

#[test]
fn the_picture_has_two_pixels_for_each_point() {
    let figure = trials();
    let (width, height, pixels) = decoded(&figure.png().unwrap());
    assert_eq!(width, 1600);
    let points = height / 2;
    assert!(figure.svg().unwrap().contains(&format!("height=\"{points}\" viewBox=\"0 0 800 {points}\" width=\"800\"")));
    let blue = pixels.chunks(4).filter(|pixel| *pixel == [0, 114, 178, 255]).count();
    assert!(blue > 20 * 100, "{blue}");
    // Nothing touches the edge.
    let row = width as usize * 4;
    let edge = |y: usize| pixels[y * row..(y + 1) * row].iter().all(|byte| *byte == 255);
    assert!((0..16).all(edge) && (height as usize - 16..height as usize).all(edge));
    assert!(pixels.chunks(row).all(|line| line[..32].iter().chain(&line[row - 32..]).all(|byte| *byte == 255)));
}

#[test]
fn every_value_has_its_mark() {
    let points = vec![[1.0, 1.0], [2.0, f64::NAN], [3.0, 4.0], [4.0, 5.0], [f64::INFINITY, 1.0], [5.0, 50.0]];
    assert_eq!(marks(Kind::Points(points.clone()), "<circle"), 3);
    // From 3 to 4; the first has no neighbours, and the last is outside.
    assert_eq!(marks(Kind::Line(points), "stroke=\"#0072B2\""), 2);
    assert!(marks(Kind::Dashed(vec![[0.0, 0.0], [10.0, 10.0]]), "stroke=\"#0072B2\"") > 20);
    let band = |x: f64| BandPoint { x, y: 3.0, lower: 2.0, upper: 4.0 };
    assert_eq!(marks(Kind::Band(vec![band(1.0), band(2.0), band(3.0)]), "<polygon"), 1);
    let estimate = Estimate { x: 2.0, y: 3.0, x_interval: Some([1.0, 3.0]), y_interval: Some([2.0, 4.0]) };
    assert_eq!(marks(Kind::Estimates(vec![estimate]), "<circle"), 1);
    // Two intervals with two caps each.
    assert_eq!(marks(Kind::Estimates(vec![estimate]), "<polyline"), 6);
    assert_eq!(marks(Kind::Histogram { edges: vec![0.0, 1.0, 2.0, 3.0], counts: vec![1.0, 2.0, f64::NAN] }, "<polygon"), 2);
    assert_eq!(marks(Kind::Bars(vec![1.0, 2.0, f64::NAN, 4.0]), "<polygon"), 3);
    assert_eq!(marks(Kind::Strip(vec![vec![1.0, 2.0, 1.0], vec![f64::NAN]]), "<circle"), 3);
    assert_eq!(marks(Kind::Cloud(vec![[1.0, 2.0, 3.0]]), "<circle"), 1);
    for kind in [Kind::Horizontal(3.0), Kind::Vertical(4.0), Kind::Diagonal] {
        assert!(marks(kind.clone(), "stroke=\"#0072B2\"") > 20);
        // Without a legend it is labelled where it is.
        assert_eq!(marks(kind, "the label"), 1);
    }
    let cells = Kind::Cells { values: vec![vec![1.0, 2.5], vec![f64::NAN]], digits: 3, shade: Shade::Table };
    assert_eq!(marks(cells.clone(), "<polygon"), 4);
    let text = Figure::new("", 1).with(Panel::default().with(Series::new("", cells))).svg().unwrap();
    assert!(text.contains("\n2.50\n") && text.contains("\n1.00\n") && count(&text, "\n–\n") == 2);
}

#[test]
fn the_legend_names_every_labelled_series() {
    let text = errors_by_count().svg().unwrap();
    for label in ["optimal set, 95 %", "random sets, 95 %", "paper", "bound σ/√n", "position error (mm)"] {
        assert_eq!(count(&text, &format!("\n{label}\n")), 2, "{label}");
    }
}

#[test]
fn no_data_are_too_strange() {
    let strange = [
        vec![],
        vec![[1.0, 1.0]],
        vec![[0.0, 0.0]],
        vec![[f64::NAN, f64::INFINITY]],
        vec![[5.0, 3.0], [5.0, 3.0]],
        vec![[-1e308, 1e308], [1e308, -1e308]],
        vec![[-1e299, 1e299], [1e299, -1e299]],
        vec![[1e-308, 1e-320], [2e-308, 0.0]],
        vec![[1e-12, 1e12], [2e-12, 2e12]],
        vec![[-1.0, 0.0], [0.0, -5.0]],
        vec![[1e-300, 1e-300], [1e300, 1e300]],
        vec![[1e9, 1e9], [1e9 + 1e-6, 1e9 + 10.0]],
    ];
    let axes = || {
        [
            Axis::linear("a"),
            Axis::log("b"),
            Axis::linear("c").range(3.0, 3.0),
            Axis::linear("d").range(9.0, f64::NAN),
            Axis::linear("e").range(1e6, 1e7),
            Axis::log("f").range(-1.0, 5.0),
            Axis::log("g").range(1e-3, 2e-3),
            Axis::categories("h", ["p", "q"]),
            Axis::categories("", Vec::<String>::new()),
        ]
    };
    for points in &strange {
        let flat: Vec<f64> = points.iter().flatten().copied().collect();
        let band = |p: &[f64; 2]| BandPoint { x: p[0], y: p[1], lower: p[0], upper: -p[1] };
        let estimate =
            |p: &[f64; 2]| Estimate { x: p[0], y: p[1], x_interval: Some([p[1], p[0]]), y_interval: Some([p[1], f64::NAN]) };
        let kinds = [
            Kind::Line(points.clone()),
            Kind::Dashed(points.clone()),
            Kind::Points(points.clone()),
            Kind::Band(points.iter().map(band).collect()),
            Kind::Estimates(points.iter().map(estimate).collect()),
            Kind::Horizontal(flat.first().copied().unwrap_or(f64::NAN)),
            Kind::Vertical(flat.last().copied().unwrap_or(0.0)),
            Kind::Diagonal,
            Kind::Bars(flat.clone()),
            Kind::Histogram { edges: flat.clone(), counts: flat.clone() },
            Kind::histogram(&flat, 7),
            Kind::Strip(points.iter().map(|p| p.to_vec()).collect()),
            Kind::Cells { values: points.iter().map(|p| p.to_vec()).collect(), digits: 40, shade: Shade::Rows },
            Kind::Cloud(points.iter().map(|p| [p[0], p[1], p[0]]).collect()),
        ];
        for x in axes() {
            for y in axes() {
                for equal_aspect in [false, true] {
                    let mut figure = Figure::new("", 14);
                    for kind in &kinds {
                        let z = (equal_aspect && matches!(kind, Kind::Cloud(_))).then(|| Axis::linear("z"));
                        let series = vec![Series::new("s", kind.clone())];
                        figure.panels.push(Panel { x: x.clone(), y: y.clone(), z, series, equal_aspect, ..Panel::default() });
                    }
                    let text = figure.svg().unwrap();
                    assert!(!text.contains("NaN") && !text.contains("inf"), "{points:?} {x:?} {y:?}");
                }
            }
        }
    }
    assert!(Figure::default().svg().unwrap().contains("no data"));
    assert!(!decoded(&Figure::default().png().unwrap()).2.is_empty());
}

#[test]
fn texts_cannot_break_the_file() {
    let name = "a<b & \"c\" > d\u{1}\n\u{10ffff}";
    let axis = || Axis::linear(name);
    let panel = Panel::new(axis(), axis()).titled(name).with(Series::new(name, Kind::Points(vec![[1.0, 2.0]])));
    let figure = Figure::new(name, 1).with(panel);
    let text = figure.svg().unwrap();
    assert!(text.contains("a&lt;b &amp; \"c\" &gt; d") && !text.contains('\u{1}'));
    assert!(figure.png().is_ok());
}

#[test]
fn a_figure_that_no_memory_holds_is_refused() {
    let cells = Kind::Cells { values: vec![vec![1.0; 2000]; 2000], digits: 2, shade: Shade::Table };
    let figure = Figure::new("", 1).with(Panel::default().with(Series::new("", cells)));
    assert!(matches!(figure.png(), Err(FigureError::TooLarge { .. })));
}

#[test]
fn the_font_has_every_sign_that_is_used() {
    let face = Face::new().unwrap();
    let signs = "µ°±√²³σφΦπ–−×·≤≥…%₀₁₂₃₄₅₆₇₈₉⁰¹⁴⁵⁶⁷⁸⁹⁻δΔθαβχ∞";
    assert!(signs.chars().all(|sign| face.has(sign)), "{signs}");
    // Two letters, the first of which is not as wide as the second.
    assert!((face.width("im", 100.0) - face.width("i", 100.0) - face.width("m", 100.0)).abs() < 1.0);
}

#[test]
fn ticks_are_round_numbers() {
    let labels = |axis: &Axis, values: [f64; 2]| {
        let ruler = Ruler::new(axis, &Needs { values: values.to_vec(), ..Needs::default() }).unwrap();
        let ticks: Vec<String> = ruler.ticks(5).into_iter().map(|tick| tick.label).collect();
        (ticks.join(" "), ruler.label())
    };
    let linear = Axis::linear("l (m)");
    assert_eq!(labels(&linear, [0.0, 1.0]).0, "0.0 0.2 0.4 0.6 0.8 1.0");
    assert_eq!(labels(&linear, [-1.0, 1.0]).0, "−1.0 −0.5 0.0 0.5 1.0");
    assert_eq!(labels(&linear, [0.0, 100.0]).0, "0 20 40 60 80 100");
    assert_eq!(labels(&linear, [0.0, 2e-6]), ("0.0 0.5 1.0 1.5 2.0".to_owned(), "l (m) ×10⁻⁶".to_owned()));
    assert_eq!(labels(&Axis::log("l"), [0.02, 30.0]).0, "0.1 1 10");
    assert_eq!(labels(&Axis::log("l"), [1e-9, 1e-3]).0, "10⁻⁸ 10⁻⁶ 10⁻⁴");
    assert_eq!(labels(&Axis::log("l"), [3.0, 6.0]).0, "3.0 3.5 4.0 4.5 5.0 5.5 6.0");
}

#[test]
fn cells_have_significant_digits() {
    let texts = [(0.0, "0"), (1.0, "1.00"), (9.999, "10.0"), (0.001_234, "0.00123"), (-12.34, "−12.3"), (1234.0, "1234")];
    for (value, text) in texts {
        assert_eq!(significant(value, 3), text);
    }
    assert_eq!(significant(1.234e-7, 2), "1.2·10⁻⁷");
    assert_eq!(significant(9.99e9, 2), "1.0·10¹⁰");
}

#[test]
fn a_histogram_counts_every_value_once() {
    let Kind::Histogram { edges, counts } = Kind::histogram(&[0.0, 0.1, 0.5, 0.9, 1.0, f64::NAN], 2) else { panic!() };
    assert_eq!((edges, counts), (vec![0.0, 0.5, 1.0], vec![2.0, 3.0]));
}
