//! The subset of HTML that a report needs. It is written as XML so that every tag is closed, and
//! every text is escaped.

use crate::output::xml::escaped;

const STYLE: &str = "
:root { --ink: #202020; --faint: #666; --line: #d8d8d8; --pale: #f6f6f3; --bar: #0072b2; }
body { font: 15px/1.5 'DejaVu Sans', Verdana, sans-serif; color: var(--ink); background: #fff; margin: 0 auto; padding: 1.5em;
  max-width: 900px; }
h1 { font-size: 1.5em; line-height: 1.25; margin: 0 0 .2em; }
h2 { font-size: 1.15em; margin: 2em 0 .6em; padding-bottom: .2em; border-bottom: 1px solid var(--line); }
p { margin: .4em 0; } .faint { color: var(--faint); }
table { border-collapse: collapse; font-size: .9em; margin: .5em 0; }
th, td { text-align: left; padding: .2em .9em .2em 0; border-bottom: 1px solid var(--line); vertical-align: top; }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.wide { overflow-x: auto; }
.bar { display: block; width: 12em; height: .75em; margin-top: .4em; background: var(--pale); }
.bar span { display: block; height: 100%; background: var(--bar); }
.verdict { display: inline-block; padding: .1em .7em; border-radius: 1em; color: #fff; background: #666; font-size: .9em; }
.completed { background: #007a59; } .failed { background: #b03a00; }
.warning { border-left: 4px solid #d55e00; background: #fdf3ec; padding: .4em .8em; margin: .5em 0; white-space: pre-wrap; }
figure { margin: 1em 0; } figure svg { max-width: 100%; height: auto; }
pre { background: var(--pale); padding: .8em; overflow-x: auto; font: 12.5px/1.4 'DejaVu Sans Mono', monospace; }
pre.wrap { white-space: pre-wrap; }
summary { cursor: pointer; } ul { padding-left: 1.2em; }
@page { margin: 15mm; }
@media print {
  body { max-width: none; padding: 0; font-size: 10.5pt; }
  h2 { break-after: avoid; } figure, tr, .warning { break-inside: avoid; }
  pre { white-space: pre-wrap; overflow: visible; } .wide { overflow: visible; } table { font-size: 8pt; }
  th, td { padding-right: .5em; }
  .bar, .bar span, .verdict, .warning, pre { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
  details::details-content { content-visibility: visible; block-size: auto; }
}
";

/// A page that is being written.
#[derive(Debug, Default)]
pub struct Page {
    body: String,
}

/// Contents of a table cell.
#[derive(Debug, Clone, PartialEq)]
pub enum HtmlCell {
    /// A text.
    Text(String),
    /// A number, or a number with its unit, right-aligned.
    Number(String),
    /// A bar with this fraction of the full width.
    Bar(f64),
}

impl HtmlCell {
    /// A text cell.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// A number cell.
    pub fn number(text: impl ToString) -> Self {
        Self::Number(text.to_string())
    }
}

impl Page {
    /// Writes the headline and the verdict, which precede everything else.
    pub fn head(&mut self, title: &str, verdict: &str, words: &str) {
        let class = if ["completed", "failed"].contains(&verdict) { verdict } else { "other" };
        self.body.push_str(&format!(
            "<h1>{}</h1>\n<p><span class=\"verdict {class}\">{}</span> <span class=\"faint\">{}</span></p>\n",
            escaped(title),
            escaped(verdict),
            escaped(words)
        ));
    }

    /// Writes a heading.
    pub fn section(&mut self, id: &str, title: &str) {
        self.body.push_str(&format!("<h2 id=\"{}\">{}</h2>\n", escaped(id), escaped(title)));
    }

    /// Writes a paragraph.
    pub fn paragraph(&mut self, text: &str) {
        self.body.push_str(&format!("<p>{}</p>\n", escaped(text)));
    }

    /// Writes a list with one sentence per entry.
    pub fn list(&mut self, entries: impl IntoIterator<Item = impl AsRef<str>>) {
        self.body.push_str("<ul>\n");
        for entry in entries {
            self.body.push_str(&format!("<li>{}</li>\n", escaped(entry.as_ref())));
        }
        self.body.push_str("</ul>\n");
    }

    /// Writes a prominent warning.
    pub fn warning(&mut self, text: &str) {
        self.body.push_str(&format!("<div class=\"warning\">{}</div>\n", escaped(text)));
    }

    /// Writes a picture, given as SVG of this program.
    pub fn figure(&mut self, name: &str, svg: &str) {
        let start = svg.find("<svg").unwrap_or(0);
        let name = escaped(&name.replace(['_', '-'], " "));
        self.body.push_str(&format!(
            "<figure role=\"img\" aria-label=\"{name}\">{}</figure>\n",
            svg[start..].trim_end()
        ));
    }

    /// Writes a table. An empty header is left out.
    pub fn table(&mut self, header: &[&str], rows: &[Vec<HtmlCell>]) {
        self.body.push_str("<div class=\"wide\"><table>\n");
        if !header.is_empty() {
            let is_number =
                |k: usize| rows.first().is_some_and(|row| matches!(row.get(k), Some(HtmlCell::Number(_))));
            let class = |k: usize| if is_number(k) { " class=\"number\"" } else { "" };
            let cells =
                header.iter().enumerate().map(|(k, name)| format!("<th{}>{}</th>", class(k), escaped(name)));
            self.body.push_str(&format!("<thead><tr>{}</tr></thead>\n", cells.collect::<String>()));
        }
        self.body.push_str("<tbody>\n");
        for row in rows {
            let cells: String = row.iter().map(cell).collect();
            self.body.push_str(&format!("<tr>{cells}</tr>\n"));
        }
        self.body.push_str("</tbody>\n</table></div>\n");
    }

    /// Writes a preformatted text.
    pub fn verbatim(&mut self, text: &str) {
        self.body.push_str(&format!("<pre class=\"wrap\">{}</pre>\n", escaped(text)));
    }

    /// Writes a long text that opens on demand.
    pub fn details(&mut self, summary: &str, text: &str) {
        let (summary, text) = (escaped(summary), escaped(text));
        self.body.push_str(&format!("<details><summary>{summary}</summary><pre>{text}</pre></details>\n"));
    }

    /// Returns the whole page.
    pub fn finish(self, title: &str) -> String {
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{}</title>\n\
             <style>{STYLE}</style>\n</head>\n<body>\n{}</body>\n</html>\n",
            escaped(title),
            self.body
        )
    }
}

fn cell(cell: &HtmlCell) -> String {
    match cell {
        HtmlCell::Text(text) => format!("<td>{}</td>", escaped(text)),
        HtmlCell::Number(text) => format!("<td class=\"number\">{}</td>", escaped(text)),
        HtmlCell::Bar(share) => {
            let width = 100.0 * if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
            format!("<td><span class=\"bar\"><span style=\"width: {width:.1}%\"></span></span></td>")
        }
    }
}
