//! The description of an effect, and its parameters.

use std::collections::BTreeMap;

/// Parameters by name, the unit in the name.
pub type Parameters = BTreeMap<String, f64>;

/// Description of an effect.
#[derive(Debug, Clone, Copy)]
pub struct About {
    /// Identifier of the contract, such as `gyro.rate_ramp`.
    pub id: &'static str,
    /// For people: "rate random walk".
    pub title: &'static str,
    /// The equation, in words and symbols.
    pub equation: &'static str,
    /// Where it is known from.
    pub source: &'static str,
    /// Channel of the answer: `gyro`.
    pub channel: &'static str,
    /// Which equation of the nominal model it adds to, in words.
    pub deficient: &'static str,
    /// `condition` of the answer, where it follows one.
    pub condition: Option<&'static str>,
    /// Its parameters.
    pub parameters: &'static [Parameter],
    /// Advice on how to remove or model it: one sentence.
    pub remedy: &'static str,
}

impl About {
    /// Name of the parameter `i` in the order of [`About::parameters`]; empty where there are fewer.
    #[must_use]
    pub fn name(&self, i: usize) -> &'static str {
        self.parameters.get(i).map_or("", |p| p.name)
    }

    /// Name of the parameter that says how large it is: the first one.
    #[must_use]
    pub fn size(&self) -> &'static str {
        self.name(0)
    }
}

/// One parameter of an effect.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Name with unit.
    pub name: &'static str,
    /// Symbol, physical meaning and unit.
    pub meaning: &'static str,
    /// Smallest and largest value that is physically possible.
    pub bounds: [f64; 2],
    /// Value at which the effect changes nothing; none where only another parameter switches it off.
    pub null: Option<f64>,
    /// Whether the answer must hold it (else it describes the form).
    pub required: bool,
}
