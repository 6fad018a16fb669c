//! The reference pages of the book: a JSON schema of ours as Markdown.
//!
//! One section for each mapping and each choice, headed by its path in the file. A definition that
//! occurs at several paths is described at the first one; the others link to it.

use serde_json::{Map, Value};

use super::schema;

/// Deepest level of a heading.
const DEEPEST: usize = 5;

/// The head of the page of a case.
const CASE_HEAD: &str = "\
# Case reference

Every key of a case file, with its type, unit, default and meaning. This page is generated from the types
that read the file (`contact-petsc schema --markdown`), so it agrees with the program.
`contact-petsc list` prints the names of all laws, elements, schemes and solvers. An editor that
knows JSON schemas completes and checks keys if the first line of the case is

```yaml
# yaml-language-server: $schema=PATH/case.schema.json
```

with the path of `meshes/case.schema.json`, or of a file with the output of `contact-petsc schema`.
";

/// The head of the page of a study.
const STUDY_HEAD: &str = "\
# Study reference

Every key of a study file, with its type, unit, default and meaning. This page is generated from the types
that read the file (`contact-petsc schema --study --markdown`), so it agrees with the program.
[Studies](how-to/studies.md) explains how to use them.
";

/// What the column of types means.
const TYPES: &str = "\
## Types of values

| Type | What to write |
|---|---|
| number | A number, or text with a unit: `5e6`, `\"5 MPa\"`, `\"0.5 mm\"`. Plain numbers are in the units of the case (m, kg, s unless `units` says otherwise) |
| function | A number, an expression in `x, y, z, t`, or a table. An expression is text: `\"1.0 * t\"`. A table is linear between its rows: `{ table: [[0, 0], [0.01, 8.0e4], [0.02, 0]] }` |
| choice | One of several laws or options. With parameters it is a mapping of one key, `{ coulomb: { ... } }`; without parameters its name is enough. For `constant` the number itself is enough |
| mapping | Keys with values. A key that is unknown, repeated or does not apply is an error with line and column |
| mapping by name | Entries under names of your own, written NAME in the headings below |
| list | Values in brackets: `[0, 0.5]` |

Expressions know `+ - * / ^`, `sin`, `cos`, `tanh`, `exp`, `log`, `sqrt`, `abs`, `atan2(y, x)`,
`pow(a, b)`, `mod(a, b)`, `min` and `max` of two or more values, `pi`, and `if(condition, a, b)`. A
condition is made of comparisons, `and`, `or` and `not`: `\"if(t > 1 and t < 2, 1, 0)\"`. `mod(a, b)`
has the sign of `b`; its derivatives are those between its jumps. `x`, `y`, `z` is the reference
position. Names under `parameters` may be used in functions and numbers, but not in whole numbers.
Physical constants have no default.
";

/// The page of the keys of a case file.
pub fn case_reference() -> String {
    page(&schema(), &format!("{CASE_HEAD}\n{TYPES}"))
}

/// The page of the keys of a study file, whose schema is given.
pub fn study_reference(schema: &Value) -> String {
    page(schema, STUDY_HEAD)
}

/// Written twice: the first pass finds where each definition is described, so that links may point
/// forward.
fn page(schema: &Value, head: &str) -> String {
    let mut page = Page { schema, text: String::new(), described: Vec::new(), known: Vec::new() };
    page.mapping("", schema, 1);
    let known = std::mem::take(&mut page.described);
    let text = format!("{head}\n## Top level\n\n");
    let mut page = Page { schema, text, described: Vec::new(), known };
    page.mapping("", schema, 1);
    page.text.trim_end().to_owned() + "\n"
}

struct Page<'a> {
    schema: &'a Value,
    text: String,
    /// Names of the definitions that are described so far, and the paths at which they are.
    described: Vec<(String, String)>,
    /// All of them, from an earlier writing of the page.
    known: Vec<(String, String)>,
}

/// A schema whose references and alternatives with `null` are resolved.
struct Resolved<'a> {
    schema: &'a Value,
    /// Name of the definition that it is.
    name: Option<&'a str>,
    /// Rest of the path: empty, or `.NAME` for the entries of a mapping by name.
    suffix: &'static str,
}

impl<'a> Page<'a> {
    /// A table of the keys of a mapping, then the sections of those that have keys or choices of their own.
    fn mapping(&mut self, path: &str, schema: &'a Value, level: usize) {
        let Some(properties) = properties(schema) else { return };
        let required = required(schema);
        self.text.push_str("| Key | Type | Unit | Default | Meaning |\n|---|---|---|---|---|\n");
        for (key, value) in properties {
            let at = join(path, key);
            let (meaning, unit) = match has_section(self.resolve(value).schema) {
                true => (cell(description(value)), String::new()),
                false => meaning_and_unit(description(value)),
            };
            let default = if required.contains(&key.as_str()) {
                "required".to_owned()
            } else {
                value.get("default").map_or_else(String::new, default)
            };
            let kind = self.kind(value, &at);
            self.text.push_str(&format!("| `{key}` | {kind} | {unit} | {default} | {meaning} |\n"));
        }
        self.text.push('\n');
        for (key, value) in properties {
            self.section(&join(path, key), value, level + 1);
        }
    }

    /// The section of a value that has keys or choices of its own.
    fn section(&mut self, path: &str, value: &'a Value, level: usize) {
        let resolved = self.resolve(value);
        let inner = resolved.schema;
        if !has_section(inner) {
            return;
        }
        let path = format!("{path}{}", resolved.suffix);
        if let Some(name) = resolved.name {
            if self.described.iter().any(|(known, _)| known == name) {
                return;
            }
            self.described.push((name.to_owned(), path.clone()));
        }
        self.heading(&path, level);
        let text = description(inner);
        if !text.is_empty() {
            self.text.push_str(&format!("{}\n\n", wrapped(text)));
        }
        match variants(inner) {
            Some(variants) => self.choice(&path, variants, level),
            None => self.mapping(&path, inner, level),
        }
    }

    /// A table of the variants of a choice, then a section for each that has parameters.
    fn choice(&mut self, path: &str, variants: &'a [Value], level: usize) {
        self.text.push_str("| Choice | Unit | Meaning |\n|---|---|---|\n");
        for variant in variants {
            let (meaning, unit) = meaning_and_unit(description(variant));
            if let Some(words) = variant.get("enum").and_then(Value::as_array) {
                let words: Vec<String> = words.iter().map(|word| format!("`{}`", flow(word))).collect();
                self.text.push_str(&format!("| {} | {unit} | {meaning} |\n", words.join(", ")));
            } else if let Some(name) = variant.get("const").and_then(Value::as_str) {
                self.text.push_str(&format!("| `{name}` | {unit} | {meaning} |\n"));
            } else if let Some((name, parameters)) = tagged(variant) {
                let resolved = self.resolve(parameters);
                let name = match (properties(resolved.schema), resolved.name) {
                    (Some(_), Some(known)) => {
                        format!("[`{name}`](#{})", self.anchor_of(known, &join(path, name)))
                    }
                    (Some(_), None) => format!("[`{name}`](#{})", anchor(&join(path, name))),
                    (None, _) => format!("`{name}`: {}", self.kind(parameters, path)),
                };
                self.text.push_str(&format!("| {name} | {unit} | {meaning} |\n"));
            } else if properties(variant).is_some() {
                self.text.push_str("| a mapping of the keys below | | |\n");
            }
        }
        self.text.push('\n');
        for variant in variants {
            if let Some((name, parameters)) = tagged(variant) {
                self.section(&join(path, name), parameters, level + 1);
            } else if properties(variant).is_some() {
                self.mapping(path, variant, level);
            }
        }
    }

    fn heading(&mut self, path: &str, level: usize) {
        let marks = "#".repeat(level.min(DEEPEST));
        self.text.push_str(&format!("{marks} `{path}`\n\n"));
    }

    /// What the column of types says of a value.
    fn kind(&self, value: &'a Value, path: &str) -> String {
        let resolved = self.resolve(value);
        let inner = resolved.schema;
        if !has_section(inner) {
            return plain_kind(inner);
        }
        let path = format!("{path}{}", resolved.suffix);
        let link = resolved.name.map_or_else(|| anchor(&path), |name| self.anchor_of(name, &path));
        let word = match (resolved.suffix.is_empty(), variants(inner).is_some()) {
            (false, _) => "mapping by name",
            (true, true) => "choice",
            (true, false) => "mapping",
        };
        format!("[{word}](#{link})")
    }

    /// Where a definition is described: at the path at which it was met first.
    fn anchor_of(&self, name: &str, path: &str) -> String {
        let known = self.known.iter().find(|(known, _)| known == name);
        anchor(known.map_or(path, |(_, at)| at))
    }

    fn resolve(&self, value: &'a Value) -> Resolved<'a> {
        let mut resolved = Resolved { schema: value, name: None, suffix: "" };
        loop {
            let schema = resolved.schema;
            let only = |list: &str| {
                let alternatives = schema.get(list)?.as_array()?;
                let refers = alternatives.iter().any(|one| one.get("$ref").is_some());
                let is_short = |one: &Value| refers && one == &serde_json::json!({ "type": "string" });
                let is_other = |one: &&Value| !is_null(one) && one.get("const").is_none() && !is_short(one);
                let mut some = alternatives.iter().filter(is_other);
                some.next().filter(|_| some.next().is_none())
            };
            if let Some(name) = schema.get("$ref").and_then(Value::as_str) {
                let name = name.trim_start_matches("#/definitions/");
                let Some(definition) = self.schema.get("definitions").and_then(|all| all.get(name)) else {
                    return resolved;
                };
                resolved.name = Some(name);
                resolved.schema = definition;
            } else if let Some(inner) = only("allOf").or_else(|| only("anyOf")) {
                resolved.schema = inner;
            } else if let Some(inner @ Value::Object(entries)) = schema.get("additionalProperties") {
                if entries.get("$ref").is_none() {
                    return resolved;
                }
                resolved.suffix = ".NAME";
                resolved.schema = inner;
            } else {
                return resolved;
            }
        }
    }
}

fn has_section(schema: &Value) -> bool {
    properties(schema).is_some_and(|keys| !keys.is_empty() && !is_function(schema))
        || variants(schema).is_some()
}

/// The described variants of a choice: of `oneOf`, or of `anyOf` with an enumeration. A variant
/// without a description is another spelling of one that has it.
fn variants(schema: &Value) -> Option<&[Value]> {
    if let Some(Value::Array(variants)) = schema.get("oneOf") {
        return Some(variants).filter(|all| all.iter().any(|one| !description(one).is_empty())).map(|all| {
            let spelt = all.iter().position(|one| description(one).is_empty()).unwrap_or(all.len());
            &all[..spelt]
        });
    }
    let Some(Value::Array(variants)) = schema.get("anyOf") else { return None };
    variants.iter().any(|one| one.get("enum").is_some()).then_some(variants)
}

/// Name and parameters of a variant that is a mapping of one key.
fn tagged(variant: &Value) -> Option<(&String, &Value)> {
    let keys = properties(variant)?;
    let required = required(variant);
    keys.iter().next().filter(|(name, _)| keys.len() == 1 && required.contains(&name.as_str()))
}

fn properties(schema: &Value) -> Option<&Map<String, Value>> {
    schema.get("properties").and_then(Value::as_object)
}

fn required(schema: &Value) -> Vec<&str> {
    let names = schema.get("required").and_then(Value::as_array);
    names.into_iter().flatten().filter_map(Value::as_str).collect()
}

fn is_null(schema: &Value) -> bool {
    schema.get("type").and_then(Value::as_str) == Some("null")
}

/// A number or text, or a table.
fn is_function(schema: &Value) -> bool {
    let is_table =
        |one: &Value| properties(one).is_some_and(|keys| keys.contains_key("table") && keys.len() == 1);
    let alternatives = schema.get("anyOf").and_then(Value::as_array);
    is_table(schema) || alternatives.is_some_and(|all| all.iter().any(is_table))
}

/// The type of a value without keys or choices of its own.
fn plain_kind(schema: &Value) -> String {
    if is_function(schema) {
        return "function".to_owned();
    }
    let types: Vec<&str> = match schema.get("type") {
        Some(Value::String(one)) => vec![one],
        Some(Value::Array(several)) => several.iter().filter_map(Value::as_str).collect(),
        _ => Vec::new(),
    };
    if let Some(Value::Array(words)) = schema.get("enum") {
        let words: Vec<String> = words.iter().map(|word| format!("`{}`", flow(word))).collect();
        return words.join(", ");
    }
    if types.contains(&"array") {
        return match schema.get("items").map(plain_kind).as_deref() {
            Some("any") | None => "list".to_owned(),
            Some("function") => "list of functions".to_owned(),
            Some(one) => format!(
                "list of {}",
                if one.starts_with("list") { one.replacen("list", "lists", 1) } else { format!("{one}s") }
            ),
        };
    }
    if types.contains(&"object") {
        return "mapping".to_owned();
    }
    if let Some(Value::Array(alternatives)) = schema.get("anyOf") {
        let kinds: Vec<String> = alternatives.iter().filter(|one| !is_null(one)).map(plain_kind).collect();
        return kinds.join(" or ");
    }
    let words = types.iter().filter(|word| **word != "null").copied();
    match words.collect::<Vec<_>>().as_slice() {
        ["number", "string"] => "number".to_owned(),
        ["string"] => "text".to_owned(),
        ["boolean"] => "`true` or `false`".to_owned(),
        [] => "any".to_owned(),
        several => several.join(" or ").replace("string", "text"),
    }
}

fn description(schema: &Value) -> &str {
    schema.get("description").and_then(Value::as_str).unwrap_or_default()
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A paragraph in lines of at most 100 characters.
fn wrapped(text: &str) -> String {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last().map_or(0, |line| line.chars().count());
        if line > 0 && line + 1 + word.chars().count() > 100 {
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            line.push_str(if line.is_empty() { "" } else { " " });
            line.push_str(word);
        }
    }
    lines.join("\n")
}

/// A description for a cell of a table.
fn cell(text: &str) -> String {
    one_line(text).replace('|', "\\|")
}

/// A description for a cell of a table, and the unit that it names first in brackets.
fn meaning_and_unit(text: &str) -> (String, String) {
    let text = cell(text);
    let unit = text.find('[').and_then(|start| {
        let end = start + text[start..].find(']')?;
        let inside = &text[start + 1..end];
        inside.starts_with(|c: char| c.is_alphabetic()).then(|| (start, end, inside.to_owned()))
    });
    let Some((start, end, unit)) = unit else { return (text, String::new()) };
    let before = text[..start].trim_end();
    let after = &text[end + 1..];
    let meaning = format!("{before}{after}");
    (meaning, unit)
}

/// A default for a cell of a table. Defaults of a mapping are in its own table.
fn default(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::Object(keys) if keys.is_empty() => "none".to_owned(),
        Value::Object(keys) if keys.len() > 1 => "see below".to_owned(),
        other => format!("`{}`", flow(other)),
    }
}

/// A value as YAML in one line.
fn flow(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(items) => format!("[{}]", items.iter().map(flow).collect::<Vec<_>>().join(", ")),
        Value::Object(keys) if keys.is_empty() => "{}".to_owned(),
        Value::Object(keys) => {
            let pairs: Vec<String> =
                keys.iter().map(|(key, value)| format!("{key}: {}", flow(value))).collect();
            format!("{{ {} }}", pairs.join(", "))
        }
        Value::Number(number) => number.as_f64().map_or_else(|| number.to_string(), short),
        other => other.to_string(),
    }
}

/// A number as people write it: 1e-9, 0.25, 25.
fn short(number: f64) -> String {
    if number != 0.0 && number.abs() < 1e-3 { format!("{number:e}") } else { format!("{number}") }
}

fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}

/// The anchor of a heading that is a path: forges and mdBook drop dots and brackets.
fn anchor(path: &str) -> String {
    path.chars().filter(|c| c.is_alphanumeric() || matches!(c, '_' | '-')).collect::<String>().to_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No key and no law of the schema is missing from the page.
    #[test]
    fn the_page_names_every_key_and_every_law() {
        let (schema, page) = (schema(), case_reference());
        let definitions = schema["definitions"].as_object().unwrap();
        for (name, definition) in definitions.iter().chain([(&"the case".to_owned(), &schema)]) {
            let keys = properties(definition).into_iter().flatten().map(|(key, _)| key.as_str());
            let choices = variants(definition).unwrap_or_default().iter();
            let laws = choices.clone().filter_map(tagged).map(|(law, _)| law.as_str());
            let words = choices.filter_map(|one| one.get("const").and_then(Value::as_str));
            for word in keys.chain(laws).chain(words) {
                assert!(page.contains(&format!("`{word}`")), "{name}: {word}");
            }
        }
        assert!(
            page.contains("| `young_modulus` | number | Pa | required | Young's modulus, > 0. |"),
            "{page}"
        );
    }
}
