//! JSON schemas of our files, for editors; made from the types, so they cannot lag behind them.

use std::collections::{HashMap, HashSet};

use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};
use schemars::{JsonSchema, Schema};
use serde_json::{Map, Value, json};

/// Draft-07 schema of a file of ours.
pub fn schema_of<T: JsonSchema>() -> Value {
    let settings = SchemaSettings::draft07().for_deserialize();
    let mut schema = settings.into_generator().into_root_schema_for::<T>();
    let definitions = schema.get("definitions").cloned().unwrap_or_default();
    RecursiveTransform(|schema: &mut Schema| both_spellings(schema, &definitions)).transform(&mut schema);
    RecursiveTransform(plain_brackets).transform(&mut schema);
    schema.to_value()
}

/// Units stand in brackets, which Rust's documentation would take for links unless they are escaped.
fn plain_brackets(schema: &mut Schema) {
    if let Some(Value::String(text)) = schema.get_mut("description") {
        *text = text.replace("\\[", "[").replace("\\]", "]");
    }
}

/// Adds the spellings of a law that `tagged` takes beside the one that serde describes.
fn both_spellings(schema: &mut Schema, definitions: &Value) {
    let Some(Value::Array(variants)) = schema.get_mut("oneOf") else { return };
    variants.iter_mut().for_each(|variant| describe(variant, definitions));
    let mut further = Vec::new();
    for variant in variants.iter() {
        if let Some(name) = variant.get("const").and_then(Value::as_str) {
            let nothing = json!({ "type": ["object", "null"], "maxProperties": 0 });
            further.push(json!({
                "type": "object", "properties": { name: nothing }, "required": [name], "additionalProperties": false
            }));
            continue;
        }
        let Some((name, parameters)) = only_property(variant) else { continue };
        if name == "constant" {
            further.push(json!({ "type": "number" }));
        } else if may_be_empty(parameters, definitions) {
            further.push(json!({ "type": "string", "const": name }));
        }
    }
    variants.append(&mut further);
}

/// Gives a variant the description of its parameters: the documentation of a law is at its struct.
fn describe(variant: &mut Value, definitions: &Value) {
    if variant.get("description").is_some() {
        return;
    }
    let parameters = only_property(variant).map(|(_, parameters)| resolved(parameters, definitions));
    let Some(description) = parameters.and_then(|parameters| parameters.get("description")).cloned() else {
        return;
    };
    if let Value::Object(variant) = variant {
        variant.insert("description".to_owned(), description);
    }
}

/// A schema, or the definition that it refers to.
fn resolved<'a>(schema: &'a Value, definitions: &'a Value) -> &'a Value {
    let reference = schema.get("$ref").and_then(Value::as_str);
    let name = reference.and_then(|path| path.strip_prefix("#/definitions/"));
    name.and_then(|name| definitions.get(name)).unwrap_or(schema)
}

fn may_be_empty(parameters: &Value, definitions: &Value) -> bool {
    let parameters = resolved(parameters, definitions);
    parameters.get("type") == Some(&json!("object")) && parameters.get("required").is_none()
}

fn only_property(variant: &Value) -> Option<(&String, &Value)> {
    let properties = variant.get("properties")?.as_object()?;
    properties.iter().next().filter(|_| properties.len() == 1)
}

/// Blocks and laws of a schema in which a key is known, for the hint to a key that is in the wrong place.
///
/// A block that several keys share, such as the components of a vector, is called by these keys.
pub(super) fn owners_of(schema: &Value, key: &str) -> Vec<String> {
    let mut owners = Vec::new();
    if let Value::Object(root) = schema {
        collect(root, key, "the case", &mut owners);
        if let Some(Value::Object(definitions)) = root.get("definitions") {
            let mut uses = HashMap::new();
            note_uses(schema, None, &mut uses);
            for (name, definition) in definitions {
                let Value::Object(definition) = definition else { continue };
                match uses.get(name.as_str()) {
                    Some(keys) => keys.iter().for_each(|owner| collect(definition, key, owner, &mut owners)),
                    None => collect(definition, key, &snake(name), &mut owners),
                }
            }
        }
    }
    let mut known = HashSet::new();
    owners.retain(|owner| known.insert(owner.clone()));
    owners
}

/// Notes the keys whose values are described by each definition.
fn note_uses<'a>(schema: &'a Value, key: Option<&'a str>, uses: &mut HashMap<&'a str, Vec<&'a str>>) {
    match schema {
        Value::Array(list) => list.iter().for_each(|inner| note_uses(inner, key, uses)),
        Value::Object(fields) => {
            for (name, inner) in fields {
                match (name.as_str(), inner) {
                    ("$ref", Value::String(path)) => {
                        let definition = path.strip_prefix("#/definitions/");
                        if let (Some(definition), Some(key)) = (definition, key) {
                            uses.entry(definition).or_default().push(key);
                        }
                    }
                    ("properties", Value::Object(properties)) => {
                        properties.iter().for_each(|(key, inner)| note_uses(inner, Some(key), uses));
                    }
                    ("definitions", Value::Object(definitions)) => {
                        definitions.values().for_each(|inner| note_uses(inner, None, uses));
                    }
                    _ => note_uses(inner, key, uses),
                }
            }
        }
        _ => {}
    }
}

fn collect(schema: &Map<String, Value>, key: &str, owner: &str, owners: &mut Vec<String>) {
    if let Some(Value::Object(properties)) = schema.get("properties") {
        // A variant's one property is its name; its parameters belong to it.
        if properties.contains_key(key) {
            owners.push(owner.to_string());
        }
        for (name, inner) in properties {
            let Value::Object(inner) = inner else { continue };
            collect(inner, key, name, owners);
        }
    }
    for list in ["oneOf", "anyOf", "allOf"] {
        let Some(Value::Array(variants)) = schema.get(list) else { continue };
        for variant in variants.iter().filter_map(Value::as_object) {
            collect(variant, key, owner, owners);
        }
    }
}

/// `FileMesh` becomes `file mesh`.
fn snake(name: &str) -> String {
    let mut words = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.extend(c.to_lowercase());
    }
    words
}
