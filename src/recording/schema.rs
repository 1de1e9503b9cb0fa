//! JSON Schemas of what kincal writes, derived from the types that are written: doc comments are the descriptions.

use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema};
use serde_json::{Map, Value, json};

use super::json::{CANDIDATES, SETS};

/// The only field of a recorded configuration, and what it is.
const JOINTS: (&str, &str) = ("joints", "Joint coordinates from the base outwards, rad (m for prismatic joints).");

/// What stands in recordings as arrays of objects where the types have arrays of arrays, and the objects' only field.
const NESTED: [(&str, (&str, &str)); 3] =
    [("configurations", JOINTS), ("best_configurations", JOINTS), (SETS, (CANDIDATES, "Its hypotheses."))];

/// Schema of `T` as `--json` writes it, without references; what may be null is said to.
#[must_use]
pub fn json_schema<T: JsonSchema>(title: &str) -> Schema {
    let settings = SchemaSettings::draft2020_12().for_serialize().with(|settings| settings.inline_subschemas = true);
    let mut schema = settings.with_transform(RecursiveTransform(tidy)).into_generator().into_root_schema_for::<T>();
    schema.insert("title".to_owned(), title.into());
    schema
}

/// Schema of `T` as it is recorded, for viewers: what is absent is not written, and Foxglove takes neither types that may be null, nor
/// alternatives, nor arrays of arrays.
#[must_use]
pub fn recorded<T: JsonSchema>(title: &str) -> Schema {
    let mut schema = json_schema::<T>(title);
    schemars::transform::Transform::transform(&mut RecursiveTransform(for_viewers), &mut schema);
    schema
}

/// Descriptions in one line and without rustdoc's links; no formats such as `double`, which say nothing more.
fn tidy(schema: &mut Schema) {
    schema.remove("format");
    if let Some(Value::String(description)) = schema.get_mut("description") {
        *description = description
            .replace("[`", "`")
            .replace("`]", "`")
            .replace("\\[", "[")
            .replace("\\]", "]")
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
    }
}

fn for_viewers(schema: &mut Schema) {
    let Some(schema) = schema.as_object_mut() else { return };
    one_alternative(schema);
    let mut nullable = Vec::new();
    for (name, property) in schema.get_mut("properties").and_then(Value::as_object_mut).into_iter().flatten() {
        let Some(property) = property.as_object_mut() else { continue };
        if without_null(property) {
            nullable.push(Value::from(name.as_str()));
        }
        if let Some((_, (field, description))) = NESTED.iter().find(|(array, _)| array == name) {
            let mut inner = property.remove("items").unwrap_or_default();
            inner["description"] = (*description).into();
            let outer = json!({ "type": "object", "required": [field], "properties": { *field: inner } });
            property.insert("items".to_owned(), outer);
        }
    }
    if let Some(required) = schema.get_mut("required").and_then(Value::as_array_mut) {
        required.retain(|name| !nullable.contains(name));
    }
}

/// Takes null out of what a property may be; whether it was there.
fn without_null(property: &mut Map<String, Value>) -> bool {
    let null = Value::from("null");
    if let Some(Value::Array(types)) = property.get_mut("type") {
        let all = types.len();
        types.retain(|name| *name != null);
        let found = types.len() < all;
        if let [only] = types.as_slice() {
            let only = only.clone();
            property.insert("type".to_owned(), only);
        }
        return found;
    }
    let Some(Value::Array(mut choices)) = property.remove("anyOf") else { return false };
    let all = choices.len();
    choices.retain(|choice| choice["type"] != null);
    let found = choices.len() < all;
    match choices.as_mut_slice() {
        [Value::Object(only)] => {
            // The property's own description comes before that of its type.
            for (key, value) in std::mem::take(only) {
                property.entry(key).or_insert(value);
            }
        }
        _ => {
            property.insert("anyOf".to_owned(), choices.into());
        }
    }
    found
}

/// Alternatives become one: values of an enumeration a list of them; objects an object with the members of all, of which those are
/// required that all have. What each alternative means stands in the description.
fn one_alternative(schema: &mut Map<String, Value>) {
    let Some(Value::Array(choices)) = schema.remove("oneOf") else { return };
    let mut merged = Map::new();
    for choice in choices {
        let Value::Object(mut choice) = choice else { continue };
        named(&mut choice);
        merge(&mut merged, choice);
    }
    let required = merged.remove("required");
    merge(schema, merged);
    if let Some(Value::Array(more)) = required {
        match schema.get_mut("required") {
            Some(Value::Array(known)) => known.extend(more),
            _ => {
                schema.insert("required".to_owned(), more.into());
            }
        }
    }
}

/// Puts the name of an alternative before what it means, where the name is.
fn named(choice: &mut Map<String, Value>) {
    let Some(Value::String(meant)) = choice.remove("description") else { return };
    let name = |of: &Map<String, Value>| of.get("const").and_then(Value::as_str).map(|name| format!("{name}: {meant}"));
    if let Some(text) = name(choice) {
        choice.insert("description".to_owned(), text.into());
    }
    for property in choice.get_mut("properties").and_then(Value::as_object_mut).into_iter().flat_map(Map::values_mut) {
        let Some(property) = property.as_object_mut() else { continue };
        if let Some(text) = name(property) {
            property.insert("description".to_owned(), text.into());
        }
        // The member that an alternative with content is written as.
        property.entry("description").or_insert_with(|| meant.as_str().into());
    }
}

/// Takes what an alternative allows into `all`.
fn merge(all: &mut Map<String, Value>, choice: Map<String, Value>) {
    for (key, value) in choice {
        match (key.as_str(), value) {
            ("const", value) => merge_values(all, vec![value]),
            ("description", Value::String(more)) => match all.get_mut("description") {
                Some(Value::String(known)) if known.contains(&more) => {}
                Some(Value::String(known)) => *known = format!("{known} {more}"),
                _ => {
                    all.insert(key, more.into());
                }
            },
            ("enum", Value::Array(values)) => merge_values(all, values),
            ("properties", Value::Object(properties)) => {
                let known = all.entry("properties").or_insert_with(|| Map::new().into());
                for (name, property) in properties {
                    match (known.get_mut(&name), property) {
                        (Some(Value::Object(known)), Value::Object(property)) => merge(known, property),
                        (_, property) => known[&name] = property,
                    }
                }
            }
            ("required", Value::Array(required)) => match all.get_mut("required") {
                Some(Value::Array(known)) => known.retain(|name| required.contains(name)),
                _ => {
                    all.insert(key, required.into());
                }
            },
            (_, value) => {
                all.entry(key).or_insert(value);
            }
        }
    }
}

fn merge_values(all: &mut Map<String, Value>, values: Vec<Value>) {
    let known = all.remove("const").into_iter();
    let more = match all.remove("enum") {
        Some(Value::Array(more)) => more,
        _ => Vec::new(),
    };
    all.insert("enum".to_owned(), known.chain(more).chain(values).collect());
}

/// Whether `value` is as `schema` says, with no member that the schema does not have.
#[cfg(test)]
pub(crate) fn check(schema: &Schema, value: &Value) -> Result<(), String> {
    let mut closed = schema.clone();
    let mut close = RecursiveTransform(|schema: &mut Schema| {
        // The members of an alternative are not all that there may be.
        if schema.remove("alternative").is_none() && schema.get("properties").is_some() {
            schema.insert("unevaluatedProperties".to_owned(), false.into());
        }
        for choice in schema.get_mut("oneOf").and_then(Value::as_array_mut).into_iter().flatten() {
            choice["alternative"] = true.into();
        }
    });
    schemars::transform::Transform::transform(&mut close, &mut closed);
    let (mut schemas, mut compiler) = (boon::Schemas::new(), boon::Compiler::new());
    compiler.add_resource("schema.json", closed.to_value()).map_err(|error| error.to_string())?;
    let index = compiler.compile("schema.json", &mut schemas).map_err(|error| error.to_string())?;
    schemas.validate(value, index).map_err(|error| format!("{error:#}"))
}
