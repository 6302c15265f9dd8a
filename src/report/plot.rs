//! A log-log plot of points and lines as SVG, for pages that open from disk.

use std::fmt::Write;

/// Points of one kind, in order.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    pub name: String,
    /// (x, y), both above 0; others are left out.
    pub points: Vec<(f64, f64)>,
    /// Joined by a line.
    pub is_line: bool,
}

/// Told apart also without colours: each has its own mark.
const COLORS: [&str; 8] = ["#8a8f98", "#d1495b", "#2e86ab", "#3c9d5b", "#e09f3e", "#7b5ea7", "#b8572a", "#2a9d8f"];
const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 420.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 180.0;
const TOP: f64 = 16.0;
const BOTTOM: f64 = 44.0;

/// Both axes logarithmic, ticks at powers of ten. Without a point there is nothing to draw: an empty text.
pub fn log_log(series: &[Series], x_label: &str, y_label: &str) -> String {
    let is_shown = |&(x, y): &(f64, f64)| x > 0.0 && y > 0.0 && x.is_finite() && y.is_finite();
    let shown: Vec<(f64, f64)> = series.iter().flat_map(|s| s.points.iter().copied().filter(is_shown)).collect();
    let Some(x) = Axis::of(shown.iter().map(|p| p.0)) else { return String::new() };
    let Some(y) = Axis::of(shown.iter().map(|p| p.1)) else { return String::new() };
    let at_x = |value: f64| LEFT + x.at(value) * (WIDTH - LEFT - RIGHT);
    let at_y = |value: f64| HEIGHT - BOTTOM - y.at(value) * (HEIGHT - TOP - BOTTOM);

    let mut svg = format!("<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" style=\"max-width:{WIDTH}px\">\n");
    for power in x.low..=x.high {
        let (at, low, high) = (at_x(10f64.powi(power)), HEIGHT - BOTTOM, TOP);
        let _ = writeln!(svg, "<line class=\"grid\" x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{low}\" y2=\"{high}\"/>");
        let _ = writeln!(svg, "<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>", low + 16.0, tick(power));
    }
    for power in y.low..=y.high {
        let (at, low, high) = (at_y(10f64.powi(power)), LEFT, WIDTH - RIGHT);
        let _ = writeln!(svg, "<line class=\"grid\" y1=\"{at:.1}\" y2=\"{at:.1}\" x1=\"{low}\" x2=\"{high}\"/>");
        let _ =
            writeln!(svg, "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>", low - 6.0, at + 4.0, tick(power));
    }
    let middle = (LEFT + WIDTH - RIGHT) / 2.0;
    let _ =
        writeln!(svg, "<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{}</text>", HEIGHT - 8.0, escaped(x_label));
    let _ = writeln!(
        svg,
        "<text x=\"14\" y=\"{0}\" text-anchor=\"middle\" transform=\"rotate(-90 14 {0})\">{1}</text>",
        HEIGHT / 2.0,
        escaped(y_label)
    );
    for (index, one) in series.iter().enumerate() {
        let color = COLORS[index % COLORS.len()];
        let points: Vec<(f64, f64)> =
            one.points.iter().filter(|p| is_shown(p)).map(|p| (at_x(p.0), at_y(p.1))).collect();
        if one.is_line {
            let path: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
            let _ = writeln!(svg, "<polyline fill=\"none\" stroke=\"{color}\" points=\"{}\"/>", path.join(" "));
        }
        for &(x, y) in &points {
            svg += &mark(index, x, y, color);
        }
        let (x, y) = (WIDTH - RIGHT + 18.0, TOP + 10.0 + 18.0 * index as f64);
        svg += &mark(index, x, y - 4.0, color);
        let _ = writeln!(svg, "<text x=\"{}\" y=\"{y}\">{}</text>", x + 10.0, escaped(&one.name));
    }
    svg + "</svg>\n"
}

fn mark(index: usize, x: f64, y: f64, color: &str) -> String {
    match index % 3 {
        0 => format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{color}\"/>\n"),
        1 => format!("<rect x=\"{:.1}\" y=\"{:.1}\" width=\"8\" height=\"8\" fill=\"{color}\"/>\n", x - 4.0, y - 4.0),
        _ => {
            let (top, low) = (y - 5.0, y + 4.0);
            format!("<path d=\"M{x:.1} {top:.1}L{:.1} {low:.1}H{:.1}Z\" fill=\"{color}\"/>\n", x + 5.0, x - 5.0)
        }
    }
}

fn tick(power: i32) -> String {
    match power {
        -3..=3 => format!("{}", 10f64.powi(power)),
        _ => format!("1e{power}"),
    }
}

/// From one power of ten to another.
struct Axis {
    low: i32,
    high: i32,
}

impl Axis {
    fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let (low, high) = values.fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
        (low <= high).then(|| {
            let low = low.log10().floor() as i32;
            Self { low, high: (high.log10().ceil() as i32).max(low + 1) }
        })
    }

    /// 0 at the low end, 1 at the high.
    fn at(&self, value: f64) -> f64 {
        (value.log10() - f64::from(self.low)) / f64::from(self.high - self.low)
    }
}

/// Text as it may stand in HTML and SVG, attributes included.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_stand_where_their_logarithms_say() {
        let one = Series { name: "a<b".into(), points: vec![(1.0, 0.1), (10.0, 1.0), (0.0, 5.0)], is_line: true };
        let svg = log_log(&[one], "ms", "error");
        let (right, low) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
        assert!(svg.contains(&format!("points=\"{LEFT:.1},{low:.1} {right:.1},{TOP:.1}\"")), "{svg}");
        assert!(svg.contains("a&lt;b") && !svg.contains("a<b"));
        assert_eq!(svg.matches("<circle").count(), 3, "two points and the legend");
    }

    #[test]
    fn nothing_is_drawn_of_nothing() {
        let bad = Series { name: String::new(), points: vec![(f64::NAN, 1.0), (-1.0, 1.0)], is_line: false };
        assert_eq!(log_log(&[bad], "", ""), "");
        assert_eq!(log_log(&[], "", ""), "");
    }
}
