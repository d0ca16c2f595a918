//! Messages that ROS has no type for, in protobuf; their definition travels in the file.

use super::message::Message;
use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet};
use std::io;

/// Type of a field.
#[derive(Clone, Copy)]
pub(super) enum Field {
    Number,
    Numbers,
    Truth,
    Text,
    /// Messages of this name.
    Messages(&'static str),
}

use Field::{Messages, Number, Numbers, Text, Truth};

/// A type of `gyroid.proto`; its fields are numbered from one in the order in which they stand.
pub(super) trait Described: prost::Message + Default {
    const NAME: &'static str;
    const FIELDS: &'static [(&'static str, Field)];
}

/// A reading's innovation.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct Innovation {
    /// Reading minus expectation, in the sensor's unit.
    #[prost(double)]
    pub residual: f64,
    /// Its standard deviation.
    #[prost(double)]
    pub std: f64,
    /// Residual in standard deviations.
    #[prost(double)]
    pub standardised: f64,
    /// Normalised innovation squared.
    #[prost(double)]
    pub nis: f64,
    /// Whether it passed the gate.
    #[prost(bool)]
    pub used: bool,
}

impl Described for Innovation {
    const NAME: &'static str = "Innovation";
    const FIELDS: &'static [(&'static str, Field)] =
        &[("residual", Number), ("std", Number), ("standardised", Number), ("nis", Number), ("used", Truth)];
}

/// A channel of a drive: as recorded, and as the nominal and the augmented simulator have it.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct Compared {
    #[prost(double)]
    pub recorded: f64,
    #[prost(double)]
    pub before: f64,
    #[prost(double)]
    pub after: f64,
}

impl Described for Compared {
    const NAME: &'static str = "Compared";
    const FIELDS: &'static [(&'static str, Field)] = &[("recorded", Number), ("before", Number), ("after", Number)];
}

/// A recorded value with the 95 % bands of the nominal and the augmented simulator.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct Banded {
    #[prost(double)]
    pub recorded: f64,
    #[prost(double)]
    pub before_low: f64,
    #[prost(double)]
    pub before_high: f64,
    #[prost(double)]
    pub after_low: f64,
    #[prost(double)]
    pub after_high: f64,
}

impl Described for Banded {
    const NAME: &'static str = "Banded";
    const FIELDS: &'static [(&'static str, Field)] = &[
        ("recorded", Number),
        ("before_low", Number),
        ("before_high", Number),
        ("after_low", Number),
        ("after_high", Number),
    ];
}

/// A band of a curve.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct Band {
    #[prost(string)]
    pub name: String,
    #[prost(double, repeated)]
    pub low: Vec<f64>,
    #[prost(double, repeated)]
    pub high: Vec<f64>,
}

impl Described for Band {
    const NAME: &'static str = "Band";
    const FIELDS: &'static [(&'static str, Field)] = &[("name", Text), ("low", Numbers), ("high", Numbers)];
}

/// A curve over something else than time, with its bands.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct Curve {
    #[prost(string)]
    pub name: String,
    #[prost(string)]
    pub x_unit: String,
    #[prost(string)]
    pub unit: String,
    #[prost(double, repeated)]
    pub x: Vec<f64>,
    #[prost(double, repeated)]
    pub recorded: Vec<f64>,
    #[prost(message, repeated)]
    pub bands: Vec<Band>,
}

impl Described for Curve {
    const NAME: &'static str = "Curve";
    const FIELDS: &'static [(&'static str, Field)] = &[
        ("name", Text),
        ("x_unit", Text),
        ("unit", Text),
        ("x", Numbers),
        ("recorded", Numbers),
        ("bands", Messages("Band")),
    ];
}

/// An estimate of a verdict.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct Quantity {
    #[prost(string)]
    pub name: String,
    #[prost(string)]
    pub unit: String,
    #[prost(double)]
    pub value: f64,
    #[prost(double)]
    pub std: f64,
    /// 95 % interval, where there is one.
    #[prost(double, repeated)]
    pub ci95: Vec<f64>,
}

impl Described for Quantity {
    const NAME: &'static str = "Quantity";
    const FIELDS: &'static [(&'static str, Field)] =
        &[("name", Text), ("unit", Text), ("value", Number), ("std", Number), ("ci95", Numbers)];
}

/// The result of a command.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct Verdict {
    /// As in the JSON's schema, such as `gap.diagnose`.
    #[prost(string)]
    pub command: String,
    /// One word, such as `identified`.
    #[prost(string)]
    pub verdict: String,
    /// The page for a terminal.
    #[prost(string)]
    pub text: String,
    #[prost(message, repeated)]
    pub quantities: Vec<Quantity>,
}

impl Described for Verdict {
    const NAME: &'static str = "Verdict";
    const FIELDS: &'static [(&'static str, Field)] =
        &[("command", Text), ("verdict", Text), ("text", Text), ("quantities", Messages("Quantity"))];
}

impl<M: Described> Message for M {
    const ENCODINGS: [&'static str; 2] = ["protobuf", "protobuf"];

    fn kind() -> String {
        format!("gyroid.{}", Self::NAME)
    }

    fn schema() -> Vec<u8> {
        let file = FileDescriptorProto {
            name: Some("gyroid.proto".into()),
            package: Some("gyroid".into()),
            message_type: vec![
                described::<Innovation>(),
                described::<Compared>(),
                described::<Banded>(),
                described::<Band>(),
                described::<Curve>(),
                described::<Quantity>(),
                described::<Verdict>(),
            ],
            syntax: Some("proto3".into()),
            ..FileDescriptorProto::default()
        };
        FileDescriptorSet { file: vec![file] }.encode_to_vec()
    }

    fn encode(&self, to: &mut Vec<u8>) -> io::Result<()> {
        prost::Message::encode(self, to).map_err(io::Error::other)
    }
}

fn described<M: Described>() -> DescriptorProto {
    let field = |(number, (name, field)): (i32, &(&str, Field))| {
        let (kind, label, of) = match *field {
            Number => (Type::Double, Label::Optional, None),
            Numbers => (Type::Double, Label::Repeated, None),
            Truth => (Type::Bool, Label::Optional, None),
            Text => (Type::String, Label::Optional, None),
            Messages(name) => (Type::Message, Label::Repeated, Some(format!(".gyroid.{name}"))),
        };
        FieldDescriptorProto {
            name: Some((*name).into()),
            number: Some(number),
            label: Some(label.into()),
            r#type: Some(kind.into()),
            type_name: of,
            ..FieldDescriptorProto::default()
        }
    };
    DescriptorProto {
        name: Some(M::NAME.into()),
        field: (1..).zip(M::FIELDS).map(field).collect(),
        ..DescriptorProto::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names of a message's fields, in their order, as its text form has them.
    fn named<M: Described + std::fmt::Debug>() -> Vec<String> {
        let text = format!("{:?}", M::default());
        let inner = text.split_once('{').unwrap().1;
        inner.split(", ").map(|part| part.split(':').next().unwrap().trim().to_string()).collect()
    }

    fn agrees<M: Described + std::fmt::Debug>() {
        assert_eq!(named::<M>(), M::FIELDS.iter().map(|f| f.0.to_string()).collect::<Vec<_>>(), "{}", M::NAME);
    }

    #[test]
    fn definitions_have_the_fields_of_the_messages() {
        agrees::<Innovation>();
        agrees::<Compared>();
        agrees::<Banded>();
        agrees::<Band>();
        agrees::<Curve>();
        agrees::<Quantity>();
        agrees::<Verdict>();
    }
}
