//! Materials in the format of a case file: the name of the law is a key, and its table contains the
//! constants.

use super::{Constant, Form, LawKind, Material, Value};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use std::borrow::Cow;
use std::fmt::{self, Display};

impl Serialize for Material {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        struct Constants<'a>(&'a Material);
        impl Serialize for Constants<'_> {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let mut map = serializer.serialize_map(None)?;
                if let Some(form) = self.0.kind().form_other_than_default() {
                    map.serialize_entry("form", form)?;
                }
                for (constant, value) in self.0.constants() {
                    map.serialize_entry(constant.key, &value)?;
                }
                map.end()
            }
        }
        let mut map = serializer.serialize_map(Some(1))?;
        map.serialize_entry(self.kind().word(), &Constants(self))?;
        map.end()
    }
}

/// Formats the material as an inline table of a case file:
/// `{ neo_hooke = { youngs_modulus = 1000.0, … } }`.
impl Display for Material {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{{ {} = {{ ", self.kind().word())?;
        if let Some(form) = self.kind().form_other_than_default() {
            write!(f, "form = \"{form}\", ")?;
        }
        for (i, (constant, value)) in self.constants().enumerate() {
            write!(f, "{}{} = ", if i > 0 { ", " } else { "" }, constant.key)?;
            match value {
                Value::Number(number) => write!(f, "{number:?}")?,
                Value::Numbers(numbers) => write!(f, "{numbers:?}")?,
            }
        }
        write!(f, " }} }}")
    }
}

impl JsonSchema for Material {
    fn schema_name() -> Cow<'static, str> {
        "Material".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let variant = |law: LawKind| {
            let mut properties = json_schema!({});
            // all forms of a law have the same constants
            if let Some((default, _)) = LawKind::forms(law.word()).first() {
                let about = format!("The form of the energy; `{default}` if omitted.");
                let words: Vec<&str> = LawKind::forms(law.word()).iter().map(|(form, _)| *form).collect();
                let form = json_schema!({ "description": about, "type": "string", "enum": words });
                properties.insert("form".into(), form.to_value());
            }
            for constant in law.constants() {
                properties.insert(constant.key.into(), of_constant(constant).to_value());
            }
            json_schema!({
                "description": law.about(),
                "type": "object",
                "properties": { law.word(): { "type": "object", "properties": properties } },
                "required": [law.word()],
            })
        };
        let laws: Vec<Schema> =
            LawKind::WORDS.iter().filter_map(|word| LawKind::from_word(word)).map(variant).collect();
        json_schema!({ "description": "A material law.", "oneOf": laws })
    }
}

/// The type of a constant.
fn of_constant(constant: &Constant) -> Schema {
    let number = json_schema!({ "type": "number", "format": "double" });
    let list = |least: usize, most: usize| json_schema!({ "type": "array", "items": number, "minItems": least, "maxItems": most });
    let mut schema = match constant.form {
        Form::Modulus(_) | Form::Number(_) => number.clone(),
        Form::Moduli { most } | Form::Numbers { most } => list(1, most),
        Form::Direction(_) => list(3, 3),
    };
    schema.insert("description".into(), constant.about.into());
    schema
}
