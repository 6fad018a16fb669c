//! Formatting of positions for messages.

/// A position for messages, with six digits \[m\]: `[0.06, 0.479167]`.
pub fn spelled(place: &[f64]) -> String {
    format!("[{}]", place.iter().map(|&x| digits(x)).collect::<Vec<_>>().join(", "))
}

/// A position as in a file, with all digits: `(0.48, 0)`.
pub(super) fn coordinates(point: &[f64]) -> String {
    let parts: Vec<String> = point.iter().map(f64::to_string).collect();
    format!("({})", parts.join(", "))
}

/// A number with at most six digits, without trailing zeros.
pub fn digits(number: f64) -> String {
    let short = format!("{number:.5e}").parse::<f64>().unwrap_or(number);
    match short {
        0.0 => "0".to_owned(),
        _ if (1e-4..1e7).contains(&short.abs()) => format!("{short}"),
        _ => format!("{short:e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding errors of coordinates are not shown, and small and large numbers remain readable.
    #[test]
    fn places_have_six_digits() {
        assert_eq!(spelled(&[0.059_999_999_999_999_984, 0.479_166_666_666_666_63]), "[0.06, 0.479167]");
        assert_eq!(spelled(&[-0.0, 1.0, -2.5e-9]), "[0, 1, -2.5e-9]");
        assert_eq!(digits(1e12 + 1.0), "1e12");
        assert_eq!(digits(f64::NAN), "NaN");
    }
}
