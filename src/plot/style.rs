//! Colours, dashes and letters: what makes curves distinct in colour, in grey and for the colour-blind.

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

/// Drawn and left-out lengths in turn; empty is a solid line.
const DASHES: [&[f64]; 6] =
    [&[], &[7.0, 3.0], &[2.0, 2.5], &[8.0, 2.5, 2.0, 2.5], &[13.0, 4.0], &[8.0, 2.5, 2.0, 2.5, 2.0, 2.5]];

/// Almost black, for letters and axes.
pub const INK: RGBColor = RGBColor(0x20, 0x20, 0x20);
/// For grids and outlines that stand back.
pub const GREY: RGBColor = RGBColor(0xD8, 0xD8, 0xD8);
/// For the mesh of bodies that carry no colour.
pub const FAINT: RGBColor = RGBColor(0xA8, 0xA8, 0xA8);
/// For bodies that carry no colour.
pub const PALE: RGBColor = RGBColor(0xEE, 0xEE, 0xEA);

/// Height of letters of titles, labels and numbers.
pub const TITLE: f64 = 16.0;
/// Axis labels and legends.
pub const LABEL: f64 = 13.0;
/// Numbers on axes.
pub const NUMBER: f64 = 12.0;

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Colour of the line.
    pub colour: RGBColor,
    /// Drawn and left-out lengths in turn; empty is a solid line.
    pub dash: &'static [f64],
    /// Width of the line; 0 for marks without a line.
    pub width: f64,
    /// Half the size of the marks at the points; 0 where there are none.
    pub mark: f64,
}

impl Stroke {
    /// The stroke of the curve `index`: distinct by colour and, below 42 curves, by colour and dash together.
    pub fn of(index: usize) -> Self {
        Self {
            colour: COLOURS[index % COLOURS.len()],
            dash: DASHES[index % DASHES.len()],
            width: 1.8,
            mark: 0.0,
        }
    }

    /// A broad pale line that others are drawn upon.
    pub fn band() -> Self {
        Self { width: 6.0, ..Self::thin(RGBColor(0xDD, 0xDD, 0xD2)) }
    }

    /// A thin solid line.
    pub fn thin(colour: RGBColor) -> Self {
        Self { colour, dash: &[], width: 0.7, mark: 0.0 }
    }
}

/// Width of a text, estimated from letter classes of the usual sans-serif fonts, on the wide side.
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

/// The text, cut with an ellipsis where it is wider than `width`.
pub fn fitted(text: &str, size: f64, width: f64) -> String {
    if text_width(text, size) <= width {
        return text.to_string();
    }
    // No letter is narrower than a third of the height: what lies behind the width need not be looked at.
    let most = (width / (size / 3.0)).max(0.0) as usize;
    let mut cut: String = text.chars().take(most).collect();
    while !cut.is_empty() && text_width(&cut, size) + 0.99 * size > width {
        cut.pop();
    }
    cut.trim_end().to_string() + "…"
}

/// The text in lines of at most `width`, broken between words; what does not fit into the last of `most` is cut.
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

    /// Long titles go on in the next line and are cut in the last one only.
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

    /// Neighbouring curves differ in colour and in dash, and none is repeated among the first forty-two.
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

    /// Long texts are cut to fit, short ones are left alone, letters beyond ASCII included.
    #[test]
    fn texts_fit() {
        assert_eq!(fitted("µ = 1", 12.0, 100.0), "µ = 1");
        let cut = fitted(&"µ".repeat(100), 12.0, 100.0);
        assert!(cut.ends_with('…') && text_width(&cut, 12.0) <= 105.0);
    }
}
