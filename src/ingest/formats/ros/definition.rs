//! Message definitions of ROS: their text, taken apart.
//!
//! A bag holds the definition of every message in it: the `.msg` text, and after it that of each type it is made of,
//! parted by lines of `=` and headed `MSG: package/Type`.

use crate::ingest::formats::scalar::Scalar;
use std::collections::HashMap;

/// Fixed arrays up to this length are columns; longer ones are covariances.
pub(super) const LONGEST_ARRAY: usize = 8;

/// A number in a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::ingest) enum Primitive {
    Bool,
    Scalar(Scalar),
    /// Seconds and nanoseconds.
    Time,
    /// Seconds and nanoseconds, signed.
    Duration,
}

/// Type of a field.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::ingest) enum Shape {
    Number(Primitive),
    Text,
    Wide,
    Struct(Vec<Field>),
    /// A fixed number of elements.
    Array(Box<Shape>, usize),
    /// As many elements as the message says.
    Sequence(Box<Shape>),
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::ingest) struct Field {
    pub name: String,
    pub shape: Shape,
}

/// The generation of ROS, which differ in their definitions and in their bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::ingest) enum Generation {
    One,
    Two,
}

/// Types within types, and fields of a message, beyond which a definition is no message's.
const DEEPEST: usize = 12;
const MOST_FIELDS: usize = 4096;

/// Definitions that not every file carries.
const COMMON: [(&str, &str); 6] = [
    ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id"),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z"),
    ("geometry_msgs/Vector3Stamped", "std_msgs/Header header\ngeometry_msgs/Vector3 vector"),
    ("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w"),
    (
        "sensor_msgs/Imu",
        "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n\
         geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n\
         geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance",
    ),
    ("sensor_msgs/Temperature", "std_msgs/Header header\nfloat64 temperature\nfloat64 variance"),
];

/// `package/msg/Type` as `package/Type`.
pub(in crate::ingest) fn plain(type_name: &str) -> String {
    type_name.trim().replace("/msg/", "/").replace("::msg::", "/").replace("::", "/")
}

/// The fields of `type_name`; `text` is its definition, if the file has one. The error says what is amiss.
pub(in crate::ingest) fn parse(
    type_name: &str,
    text: Option<&str>,
    generation: Generation,
) -> Result<Vec<Field>, String> {
    let name = plain(type_name);
    let mut types: HashMap<String, &str> = COMMON.iter().map(|(n, t)| ((*n).to_string(), *t)).collect();
    if let Some(text) = text {
        sections(&name, text, &mut types);
    }
    let mut fields = 0;
    let fields = fields_of(&name, &types, generation, 0, &mut fields)?;
    // short arrays of types with short arrays: each level has eight times as many
    match fields.iter().map(|f| numbers(&f.shape)).fold(0, usize::saturating_add) {
        0..=MOST_FIELDS => Ok(fields),
        more => Err(format!("more than {MOST_FIELDS} numbers, {more}, in {name}")),
    }
}

/// Numbers of a shape that become columns.
pub(super) fn numbers(shape: &Shape) -> usize {
    match shape {
        Shape::Number(_) => 1,
        Shape::Struct(fields) => fields.iter().map(|f| numbers(&f.shape)).fold(0, usize::saturating_add),
        Shape::Array(element, n) if *n <= LONGEST_ARRAY => numbers(element).saturating_mul(*n),
        Shape::Array(..) | Shape::Sequence(_) | Shape::Text | Shape::Wide => 0,
    }
}

/// The definitions in `text` by their names.
fn sections<'a>(name: &str, text: &'a str, types: &mut HashMap<String, &'a str>) {
    let mut current = name.to_string();
    let mut begin = 0;
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let end = at + line.len();
        let bare = line.trim();
        if bare.len() >= 3 && bare.bytes().all(|b| b == b'=') {
            types.insert(std::mem::take(&mut current), &text[begin..at]);
            begin = end;
        } else if let Some(next) = bare.strip_prefix("MSG:")
            && current.is_empty()
        {
            current = plain(next);
            begin = end;
        }
        at = end;
    }
    if !current.is_empty() {
        types.insert(current, &text[begin..]);
    }
}

fn fields_of(
    name: &str,
    types: &HashMap<String, &str>,
    generation: Generation,
    depth: usize,
    count: &mut usize,
) -> Result<Vec<Field>, String> {
    let Some(text) = types.get(name) else { return Err(format!("the definition of {name} is missing")) };
    if depth > DEEPEST {
        return Err(format!("types within types {DEEPEST} deep, at {name}"));
    }
    let package = name.rsplit_once('/').map_or("", |(package, _)| package);
    let mut fields = Vec::new();
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or_default().trim();
        let Some((type_text, rest)) = line.split_once(char::is_whitespace) else { continue };
        let rest = rest.trim();
        let field = rest.split(|c: char| c.is_whitespace() || c == '=').next().unwrap_or_default();
        // NAME=VALUE is a constant; a default value stands without the sign
        let after = rest[field.len()..].trim_start();
        if after.starts_with('=') {
            continue;
        }
        *count += 1;
        if *count > MOST_FIELDS {
            return Err(format!("more than {MOST_FIELDS} fields, at {name}"));
        }
        let shape = shape_of(type_text, package, types, generation, depth, count)?;
        fields.push(Field { name: field.to_string(), shape });
    }
    Ok(fields)
}

fn shape_of(
    text: &str,
    package: &str,
    types: &HashMap<String, &str>,
    generation: Generation,
    depth: usize,
    count: &mut usize,
) -> Result<Shape, String> {
    if let Some((element, bound)) = text.strip_suffix(']').and_then(|t| t.rsplit_once('[')) {
        if element.ends_with(']') {
            return Err(format!("{text:?} is no type"));
        }
        let element = Box::new(shape_of(element, package, types, generation, depth, count)?);
        return match bound.parse::<usize>() {
            Ok(n) => Ok(Shape::Array(element, n)),
            Err(_) if bound.is_empty() || bound.starts_with("<=") => Ok(Shape::Sequence(element)),
            Err(_) => Err(format!("{text:?} is no type")),
        };
    }
    use Primitive as P;
    let number = |scalar| Shape::Number(P::Scalar(scalar));
    let one = generation == Generation::One;
    Ok(match text.split("<=").next().unwrap_or_default() {
        "bool" | "boolean" => Shape::Number(P::Bool),
        "int8" => number(Scalar::I8),
        "uint8" => number(Scalar::U8),
        "byte" => number(if one { Scalar::I8 } else { Scalar::U8 }),
        "char" => number(Scalar::U8),
        "int16" => number(Scalar::I16),
        "uint16" => number(Scalar::U16),
        "int32" => number(Scalar::I32),
        "uint32" => number(Scalar::U32),
        "int64" => number(Scalar::I64),
        "uint64" => number(Scalar::U64),
        "float32" | "float" => number(Scalar::F32),
        "float64" | "double" => number(Scalar::F64),
        "time" | "builtin_interfaces/Time" | "builtin_interfaces/msg/Time" => Shape::Number(P::Time),
        "duration" | "builtin_interfaces/Duration" | "builtin_interfaces/msg/Duration" => Shape::Number(P::Duration),
        "string" => Shape::Text,
        "wstring" => Shape::Wide,
        name => {
            let full = plain(name);
            let full = match full.as_str() {
                "Header" => "std_msgs/Header".to_string(),
                bare if !bare.contains('/') => format!("{package}/{bare}"),
                _ => full,
            };
            let mut fields = fields_of(&full, types, generation, depth + 1, count)?;
            // what the stamp of ROS 1's header is preceded by
            if full == "std_msgs/Header" && one && !fields.iter().any(|f| f.name == "seq") {
                fields.insert(0, Field { name: "seq".into(), shape: number(Scalar::U32) });
            }
            Shape::Struct(fields)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(fields: &[Field]) -> Vec<&str> {
        fields.iter().map(|f| f.name.as_str()).collect()
    }

    #[test]
    fn constants_comments_defaults_and_bounds_are_told_apart() {
        let text = "# a comment\nuint8 OK=0\nstring NAME = a b # c\nint32 a 5\nstring<=10 b\nfloat32[<=3] c\nfloat64[3] d # e\nuint8[] f\n";
        let fields = parse("p/msg/T", Some(text), Generation::Two).unwrap();
        assert_eq!(names(&fields), ["a", "b", "c", "d", "f"]);
        assert_eq!(fields[1].shape, Shape::Text);
        assert!(matches!(fields[2].shape, Shape::Sequence(_)));
        assert!(matches!(fields[3].shape, Shape::Array(_, 3)));
    }

    #[test]
    fn nested_types_are_found_by_their_full_and_bare_names() {
        let text = "Header header\nInner a\nother/Far b\n====\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n\
                    ===\nMSG: p/Inner\nint8 x\n===\nMSG: other/Far\nint8 y\n";
        let fields = parse("p/T", Some(text), Generation::One).unwrap();
        let Shape::Struct(header) = &fields[0].shape else { panic!("{fields:?}") };
        assert_eq!(names(header), ["seq", "stamp", "frame_id"]);
        let Shape::Struct(far) = &fields[2].shape else { panic!("{fields:?}") };
        assert_eq!(names(far), ["y"]);
    }

    #[test]
    fn definitions_that_never_end_are_refused() {
        assert!(parse("p/T", Some("T again"), Generation::Two).unwrap_err().contains("deep"));
        // each level doubles: the count of fields ends it
        let wide: String = (0..11).map(|i| format!("===\nMSG: p/A{i}\nA{0} a\nA{0} b\nA{0} c\n", i + 1)).collect();
        assert!(parse("p/T", Some(&format!("A0 a\n{wide}")), Generation::Two).is_err());
        // each level is an array of eight of the next
        let deep: String = (0..11).map(|i| format!("===\nMSG: p/A{i}\nA{}[8] a\n", i + 1)).collect();
        let text = format!("A0 a\n{deep}===\nMSG: p/A11\nint8 a\n");
        assert!(parse("p/T", Some(&text), Generation::Two).unwrap_err().contains("numbers"));
        assert!(parse("p/T", Some("q/U a"), Generation::Two).unwrap_err().contains("q/U"));
        assert!(parse("p/T", None, Generation::Two).unwrap_err().contains("p/T"));
        assert!(parse("p/T", Some("float64[x] a"), Generation::Two).is_err());
    }

    #[test]
    fn an_imu_is_known_without_its_definition() {
        let fields = parse("sensor_msgs/msg/Imu", None, Generation::Two).unwrap();
        assert_eq!(names(&fields)[3], "angular_velocity");
    }
}
