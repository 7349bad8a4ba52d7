//! DXF of AutoCAD release 12: the version that all programs read. Each level has a layer, and its polylines have the
//! level as their elevation. y is up.
use super::super::heights::told;
use super::Level;
use std::fmt::Write;

/// The text of a file; `height` is that of the canvas in mm.
pub(super) fn text(levels: &[Level], height: f64) -> String {
    let mut file = Dxf(String::new());
    file.all(&[(0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009"), (0, "ENDSEC")]);
    file.all(&[(0, "SECTION"), (2, "TABLES"), (0, "TABLE"), (2, "LAYER"), (70, &levels.len().to_string())]);
    for level in levels {
        file.all(&[(0, "LAYER"), (2, &layer(level.height)), (70, "0"), (62, "7"), (6, "CONTINUOUS")]);
    }
    file.all(&[(0, "ENDTAB"), (0, "ENDSEC"), (0, "SECTION"), (2, "ENTITIES")]);
    for level in levels {
        let layer = layer(level.height);
        for line in &level.lines {
            file.all(&[(0, "POLYLINE"), (8, &layer), (66, "1")]);
            file.point(0.0, 0.0, level.height);
            file.text(70, if line.closed { "1" } else { "0" });
            let points = if line.closed { &line.points[..line.points.len() - 1] } else { &line.points[..] };
            for point in points {
                file.all(&[(0, "VERTEX"), (8, &layer)]);
                file.point(point.x, height - point.y, level.height);
            }
            file.all(&[(0, "SEQEND"), (8, &layer)]);
        }
    }
    file.all(&[(0, "ENDSEC"), (0, "EOF")]);
    file.0
}

/// The name of a level's layer, in micrometres. Names have no sign and no point: -12.5 µm is `Z_M12D5_UM`.
fn layer(level: f64) -> String {
    format!("Z_{}_UM", told(level * 1000.0).replace('-', "M").replace('.', "D"))
}

struct Dxf(String);

impl Dxf {
    /// Adds pairs of a code and a text.
    fn all(&mut self, pairs: &[(u8, &str)]) {
        pairs.iter().for_each(|(code, text)| self.text(*code, text));
    }

    /// A group code and its value.
    fn text(&mut self, code: u8, value: &str) {
        let _ = writeln!(self.0, "{code:>3}\n{value}");
    }

    fn point(&mut self, x: f64, y: f64, z: f64) {
        for (code, value) in [(10, x), (20, y), (30, z)] {
            self.text(code, &format!("{value:.6}"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::lines::Line;
    use super::*;
    use glam::DVec2;

    #[test]
    fn layers_have_names_that_the_format_allows() {
        assert_eq!([0.1, -0.0125, 0.0, 3.0].map(layer), ["Z_100_UM", "Z_M12D5_UM", "Z_0_UM", "Z_3000_UM"]);
    }

    #[test]
    fn lines_have_elevation_and_y_up() {
        let points = [(0.0, 1.0), (2.0, 1.0), (2.0, 3.0), (0.0, 1.0)].map(|(x, y)| DVec2::new(x, y)).to_vec();
        let text = text(&[Level { height: 0.25, lines: vec![Line { points, closed: true }] }], 10.0);
        let groups: Vec<&str> = text.lines().map(str::trim).collect();
        let pairs: Vec<(&str, &str)> = groups.chunks(2).map(|pair| (pair[0], pair[1])).collect();
        assert_eq!(pairs.iter().filter(|pair| **pair == ("0", "VERTEX")).count(), 3);
        assert!(
            pairs.contains(&("30", "0.250000")) && pairs.contains(&("8", "Z_250_UM")) && pairs.contains(&("70", "1"))
        );
        assert!(pairs.contains(&("20", "9.000000")) && pairs.last() == Some(&("0", "EOF")));
    }
}
