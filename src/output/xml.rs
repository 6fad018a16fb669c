//! The subset of XML that the field files of this program need: tags with attributes, read
//! strictly.

use crate::error::{Error, Result};

/// A tag with its attributes; `</name>` is a tag called `/name`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tag {
    /// Name of the element.
    pub name: String,
    attributes: Vec<(String, String)>,
    /// Position behind the tag in the file.
    pub end: usize,
}

impl Tag {
    /// The value of a required attribute.
    ///
    /// # Errors
    /// The attribute is missing.
    pub fn get(&self, key: &str) -> Result<&str> {
        self.find(key).ok_or_else(|| Error::file(format!("<{}> has no `{key}`", self.name)))
    }

    /// The value of an optional attribute.
    pub fn find(&self, key: &str) -> Option<&str> {
        self.attributes.iter().find(|(name, _)| name == key).map(|(_, value)| value.as_str())
    }

    /// The value of an attribute as a number.
    ///
    /// # Errors
    /// The attribute is missing or is not such a number.
    pub fn number<T: std::str::FromStr>(&self, key: &str) -> Result<T> {
        let text = self.get(key)?;
        text.parse().map_err(|_| Error::file(format!("<{}>: `{key}=\"{text}\"` is not a number", self.name)))
    }
}

/// All tags of `bytes` up to and including the one called `last`, or to the end.
///
/// # Errors
/// A tag is not closed, an attribute is not quoted, or `last` is missing.
pub fn tags(bytes: &[u8], last: &str) -> Result<Vec<Tag>> {
    let mut tags: Vec<Tag> = Vec::new();
    let mut at = 0;
    while tags.last().is_none_or(|tag| tag.name != last) {
        let start = find(bytes, at, b'<').ok_or_else(|| Error::file(format!("truncated: no <{last}>")))?;
        let end = find(bytes, start, b'>')
            .ok_or_else(|| Error::file(format!("truncated in a tag at byte {start}")))?;
        let inner = std::str::from_utf8(&bytes[start + 1..end])
            .map_err(|_| Error::file(format!("the tag at byte {start} is not text")))?;
        at = end + 1;
        if !inner.starts_with(['?', '!']) {
            tags.push(parse(inner, at)?);
        }
    }
    Ok(tags)
}

/// Escapes a text for use between the quotes of an attribute or between tags. Characters that XML
/// can not represent become U+FFFD.
pub fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            letter => safe.push(legal(letter)),
        }
    }
    safe
}

/// The character, or U+FFFD if XML 1.0 forbids it.
pub fn legal(letter: char) -> char {
    let is_legal = !letter.is_control() && !matches!(letter, '\u{fffe}' | '\u{ffff}');
    if is_legal || matches!(letter, '\t' | '\n' | '\r') { letter } else { char::REPLACEMENT_CHARACTER }
}

fn unescaped(text: &str) -> String {
    text.replace("&quot;", "\"").replace("&gt;", ">").replace("&lt;", "<").replace("&amp;", "&")
}

fn find(bytes: &[u8], from: usize, what: u8) -> Option<usize> {
    bytes[from..].iter().position(|&byte| byte == what).map(|position| from + position)
}

fn parse(inner: &str, end: usize) -> Result<Tag> {
    let inner = inner.strip_suffix('/').unwrap_or(inner);
    let (name, mut rest) = inner.split_once(char::is_whitespace).unwrap_or((inner, ""));
    let mut attributes = Vec::new();
    rest = rest.trim_start();
    while !rest.is_empty() {
        let wrong = || Error::file(format!("<{name}>: attributes are not `key=\"value\"`"));
        let (key, after) = rest.split_once("=\"").ok_or_else(wrong)?;
        let (value, after) = after.split_once('"').ok_or_else(wrong)?;
        attributes.push((key.trim().to_string(), unescaped(value)));
        rest = after.trim_start();
    }
    Ok(Tag { name: name.to_string(), attributes, end })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names, attributes and positions are read; declarations are skipped.
    #[test]
    fn reads_tags_and_attributes() {
        let text = b"<?xml version=\"1.0\"?>\n<A x=\"1\" y=\"a &lt; b\">\n<B z=\"2\"/></A>";
        let tags = tags(text, "/A").unwrap();
        let names: Vec<_> = tags.iter().map(|tag| tag.name.as_str()).collect();
        assert_eq!(names, ["A", "B", "/A"]);
        assert_eq!(tags[0].get("y").unwrap(), "a < b");
        assert_eq!(tags[1].number::<u32>("z").unwrap(), 2);
        assert_eq!(tags[2].end, text.len());
        assert!(tags[0].get("z").is_err() && tags[0].number::<u32>("y").is_err());
    }

    /// A truncated tag or an unquoted attribute is an error.
    #[test]
    fn refuses_broken_text() {
        for text in ["<A x=\"1\"", "<A x=1></A>", "<A x=\"1></A>", "<A>", ""] {
            assert!(tags(text.as_bytes(), "/A").is_err(), "{text}");
        }
    }

    /// Escaping and reading are inverse.
    #[test]
    fn escapes_what_would_break_a_tag() {
        let text = "a<b> & \"c\" &lt;\nd\te &#10;";
        assert_eq!(unescaped(&escaped(text)), text);
    }

    /// Control characters, which XML can not represent, are not written to a file.
    #[test]
    fn control_characters_are_replaced() {
        assert_eq!(escaped("a\u{0}\u{1b}[31m\u{7f}\u{ffff}b"), "a\u{fffd}\u{fffd}[31m\u{fffd}\u{fffd}b");
    }
}
