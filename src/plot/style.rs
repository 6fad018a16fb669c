//! Colours, dashes and fonts that keep curves distinct in colour, in grey and for the colour-blind.

use plotters::style::RGBColor;

/// Colours of Okabe and Ito without yellow, which is too light for a line on white.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0x00, 0x72, 0xB2),
    RGBColor(0xD5, 0x5E, 0x00),
    RGBColor(0x00, 0x9E, 0x73),
    RGBColor(0xCC, 0x79, 0xA7),
    RGBColor(0xE6, 0x9F, 0x00),
    RGBColor(0x56, 0xB4, 0xE9),
    RGBColor(0x00, 0x00, 0x00),
];

/// Alternating lengths of dashes and gaps; empty for a solid line.
const DASHES: [&[f64]; 6] =
    [&[], &[7.0, 3.0], &[2.0, 2.5], &[8.0, 2.5, 2.0, 2.5], &[13.0, 4.0], &[8.0, 2.5, 2.0, 2.5, 2.0, 2.5]];

/// Almost black, for text and axes.
pub const INK: RGBColor = RGBColor(0x20, 0x20, 0x20);
/// For grids and outlines in the background.
pub const GREY: RGBColor = RGBColor(0xD8, 0xD8, 0xD8);
/// For the mesh of bodies without colour.
pub const FAINT: RGBColor = RGBColor(0xA8, 0xA8, 0xA8);
/// For bodies without colour.
pub const PALE: RGBColor = RGBColor(0xEE, 0xEE, 0xEA);

/// Font size of titles.
pub const TITLE: f64 = 16.0;
/// Font size of axis labels and legends.
pub const LABEL: f64 = 13.0;
/// Font size of numbers on axes.
pub const NUMBER: f64 = 12.0;

/// Style of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Colour of the line.
    pub colour: RGBColor,
    /// Alternating lengths of dashes and gaps; empty for a solid line.
    pub dash: &'static [f64],
    /// Width of the line; 0 for marks without a line.
    pub width: f64,
    /// Half the size of the marks at the points; 0 for no marks.
    pub mark: f64,
}

impl Stroke {
    /// The stroke of the curve `index`. Neighbours differ in colour, and the first 42 curves differ
    /// in colour and dash together.
    pub fn of(index: usize) -> Self {
        Self {
            colour: COLOURS[index % COLOURS.len()],
            dash: DASHES[index % DASHES.len()],
            width: 1.8,
            mark: 0.0,
        }
    }

    /// A broad pale line on which others are drawn.
    pub fn band() -> Self {
        Self { width: 6.0, ..Self::thin(RGBColor(0xDD, 0xDD, 0xD2)) }
    }

    /// A thin solid line.
    pub const fn thin(colour: RGBColor) -> Self {
        Self { colour, dash: &[], width: 0.7, mark: 0.0 }
    }
}

/// Width of a text, estimated from letter classes of common sans-serif fonts. The estimate is on
/// the wide side.
pub fn text_width(text: &str, size: f64) -> f64 {
    let em = |letter: char| match letter {
        'i' | 'j' | 'l' | 'I' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' => 0.34,
        'f' | 't' | 'r' | ' ' | '(' | ')' | '[' | ']' | '/' | '-' => 0.43,
        'm' | 'w' | 'M' | 'W' | '%' | '@' => 0.99,
        letter if letter.is_uppercase() => 0.74,
        _ => 0.65,
    };
    text.chars().map(em).sum::<f64>() * size
}

/// The text, truncated with an ellipsis if it is wider than `width`.
pub fn fitted(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size) <= width {
        return text.to_string();
    }
    // No letter is narrower than a third of the height, so that text beyond this length need not be
    // examined.
    let most = (width / (size / 3.0)).max(0.0) as usize;
    let mut cut: String = text.chars().take(most).collect();
    while !cut.is_empty() && text_width(&cut, size) + 0.99 * size > width {
        cut.pop();
    }
    cut.trim_end().to_string() + "…"
}

/// The text in lines of at most `width`, broken between words. Text that does not fit into `most`
/// lines is truncated.
pub fn wrapped(text: &str, size: f64, width: f64, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split_whitespace() {
        let count = lines.len();
        let Some(line) = lines.last_mut() else { break };
        let longer = if line.is_empty() { word.to_owned() } else { format!("{line} {word}") };
        if line.is_empty() || count == most || text_width(&longer, size) <= width {
            *line = longer;
        } else {
            lines.push(word.to_owned());
        }
    }
    lines.iter().map(|line| fitted(line, size, width)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Long titles continue in the next line and are truncated only in the last one.
    #[test]
    fn titles_wrap() {
        let title = "Rubber block dragged over a rigid foundation, power law 2, t = 70 ms";
        let lines = wrapped(title, LABEL, 330.0, 2);
        assert_eq!(lines.join(" "), title);
        assert_eq!(lines.len(), 2);
        assert_eq!(wrapped("short", LABEL, 330.0, 2), ["short"]);
        let cut = wrapped(&title.repeat(3), LABEL, 330.0, 2);
        assert!(cut.len() == 2 && cut[1].ends_with('…'), "{cut:?}");
        assert!(cut.iter().all(|line| text_width(line, LABEL) <= 330.0));
    }

    /// Neighbouring curves differ in colour and in dash, and no style is repeated among the first
    /// forty-two.
    #[test]
    fn strokes_are_distinct() {
        for (a, b) in (0..42).flat_map(|a| (0..a).map(move |b| (a, b))) {
            assert_ne!(Stroke::of(a), Stroke::of(b), "{a} and {b}");
            if a == b + 1 {
                assert!(
                    Stroke::of(a).colour != Stroke::of(b).colour && Stroke::of(a).dash != Stroke::of(b).dash
                );
            }
        }
    }

    /// Long texts are truncated to fit, and short ones are unchanged, including letters beyond
    /// ASCII.
    #[test]
    fn texts_fit() {
        assert_eq!(fitted("µ = 1", 12.0, 100.0), "µ = 1");
        let cut = fitted(&"µ".repeat(100), 12.0, 100.0);
        assert!(cut.ends_with('…') && text_width(&cut, 12.0) <= 105.0);
    }
}
