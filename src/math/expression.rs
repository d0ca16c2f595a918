//! text → f(x): an expression in named quantities, evaluated by the crate exmex
//!
//! exmex alone takes -x^2 for (-x)^2 and 2^3^2 for (2^3)^2, knows no 1e-3 and no f(a, g(b, c)), and its errors have no place.
//! The text is therefore read once here: names and signs are checked with their column, and what exmex is given can be read
//! in one way only.

use crate::error::one_of;
use exmex::{Express, FlatEx};

/// Functions of one number.
const UNARY: [&str; 19] = [
    "abs", "acos", "asin", "atan", "ceil", "cos", "cosh", "exp", "floor", "ln", "log10", "round", "signum", "sin",
    "sinh", "sqrt", "tan", "tanh", "trunc",
];
/// Functions of two numbers.
const BINARY: [&str; 3] = ["atan2", "max", "min"];
/// The number that has a name.
const PI: &str = "pi";
/// Most characters of an expression, and most parentheses that are open at once.
const LONGEST: usize = 2000;
const DEEPEST: usize = 64;

/// A fault in the text of an expression.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Fault {
    /// Column in the text, from 1.
    pub column: usize,
    /// Description of the fault.
    pub found: String,
    /// Advice.
    pub hint: String,
}

/// An expression in named quantities.
#[derive(Debug, Clone)]
pub(crate) struct Expression {
    compiled: FlatEx<f64>,
    /// Place of each of exmex's variables in the names.
    places: Vec<usize>,
}

/// Whether `name` is a function's or a number's, and so no quantity's.
#[must_use]
pub(crate) fn is_reserved(name: &str) -> bool {
    name == PI || UNARY.contains(&name) || BINARY.contains(&name)
}

impl Expression {
    /// The expression `text` in the quantities `names`.
    pub(crate) fn new(text: &str, names: &[&str]) -> Result<Self, Fault> {
        let plain = Reader::new(text, names).read()?;
        let refused = |found: &str| Fault {
            column: 1,
            found: format!("cannot be read: {found}"),
            hint: "write it with more parentheses".into(),
        };
        let compiled = FlatEx::parse(&plain).map_err(|e| refused(e.msg()))?;
        let place = |name: &String| names.iter().position(|n| n == name);
        let places = compiled.var_names().iter().map(place).collect::<Option<Vec<usize>>>();
        let places = places.ok_or_else(|| refused("a name is unknown"))?;
        Ok(Self { compiled, places })
    }

    /// Its value, where `at` gives the quantity at a place in the names; NaN where it has none.
    #[must_use]
    pub(crate) fn value(&self, at: impl Fn(usize) -> f64) -> f64 {
        self.compiled.eval_iter(self.places.iter().map(|place| at(*place))).unwrap_or(f64::NAN)
    }

    /// Whether the quantity at `place` in the names is in it.
    #[must_use]
    pub(crate) fn uses(&self, place: usize) -> bool {
        self.places.contains(&place)
    }
}

/// An open parenthesis.
struct Open {
    column: usize,
    /// The function of two numbers that it belongs to, and whether its comma was read.
    pair: Option<(&'static str, bool)>,
    /// Whether the last operator before the value to come was a power.
    power: bool,
}

/// Reads a text from left to right.
struct Reader<'a> {
    chars: Vec<char>,
    names: &'a [&'a str],
    at: usize,
    out: String,
    open: Vec<Open>,
    power: bool,
}

impl<'a> Reader<'a> {
    fn new(text: &str, names: &'a [&'a str]) -> Self {
        Self { chars: text.chars().collect(), names, at: 0, out: String::new(), open: Vec::new(), power: false }
    }

    fn fault<T>(&self, at: usize, found: impl Into<String>, hint: impl Into<String>) -> Result<T, Fault> {
        Err(Fault { column: at + 1, found: found.into(), hint: hint.into() })
    }

    fn skip_blanks(&mut self) {
        while self.chars.get(self.at).is_some_and(|c| c.is_whitespace()) {
            self.at += 1;
        }
    }

    /// The text as exmex can read it in one way only.
    fn read(mut self) -> Result<String, Fault> {
        if self.chars.len() > LONGEST {
            let found = format!("{} characters", self.chars.len());
            return self.fault(LONGEST, found, format!("at most {LONGEST} are read"));
        }
        // a value, with signs and parentheses before it, and what follows it
        let mut first = true;
        loop {
            self.skip_blanks();
            self.begin(&mut first)?;
            self.skip_blanks();
            let Some(&c) = self.chars.get(self.at) else { break };
            match c {
                '+' | '-' | '*' | '/' => {
                    self.power = false;
                    self.out.push(c);
                }
                '^' if self.power => {
                    return self.fault(self.at, "a power of a power", "say which comes first: (a^b)^c or a^(b^c)");
                }
                '^' => {
                    self.power = true;
                    self.out.push(c);
                }
                ',' => {
                    let Some(Open { pair: Some((name, comma @ false)), .. }) = self.open.last_mut() else {
                        let hint = format!("commas stand in {} alone, one in each", BINARY.join(", "));
                        return self.fault(self.at, "a comma", hint);
                    };
                    *comma = true;
                    self.out += &format!(") {name} (");
                    (self.power, first) = (false, true);
                }
                _ => {
                    let hint = "an operator is expected here: + - * / ^, or the end";
                    return self.fault(self.at, format!("{c:?} after a value"), hint);
                }
            }
            self.at += 1;
        }
        match self.open.last() {
            Some(open) => self.fault(open.column, "a parenthesis that is not closed", "add ) where it ends"),
            None => Ok(self.out),
        }
    }

    /// Reads a value up to its end, closing parentheses after it included. `first`: nothing stands before it in its
    /// parentheses, so that it may have a sign.
    fn begin(&mut self, first: &mut bool) -> Result<(), Fault> {
        loop {
            self.skip_blanks();
            let start = self.at;
            let Some(&c) = self.chars.get(start) else {
                return self.fault(start, "the end, where a value is expected", "a number, a signal, a parameter or (");
            };
            match c {
                '+' | '-' if *first => {
                    if c == '-' {
                        self.out += "(0-1)*";
                    }
                    *first = false;
                    self.at += 1;
                    continue;
                }
                '+' | '-' => return self.fault(start, "a sign after an operator", "put it into parentheses: a*(-b)"),
                '(' => {
                    self.open(None, "(")?;
                    *first = true;
                    continue;
                }
                _ if c.is_ascii_digit() || c == '.' => self.number()?,
                _ if c.is_alphabetic() || c == '_' => {
                    if self.name()? {
                        *first = true;
                        continue;
                    }
                }
                _ => {
                    let hint = "a value is expected here: a number, a signal, a parameter or (";
                    return self.fault(start, format!("{c:?}"), hint);
                }
            }
            *first = false;
            return self.close();
        }
    }

    fn open(&mut self, pair: Option<&'static str>, text: &str) -> Result<(), Fault> {
        if self.open.len() >= DEEPEST {
            return self.fault(self.at, "too many open parentheses", format!("at most {DEEPEST} may be open at once"));
        }
        self.out += text;
        self.open.push(Open { column: self.at, pair: pair.map(|name| (name, false)), power: self.power });
        self.power = false;
        self.at += 1;
        Ok(())
    }

    fn close(&mut self) -> Result<(), Fault> {
        loop {
            self.skip_blanks();
            if self.chars.get(self.at) != Some(&')') {
                return Ok(());
            }
            let Some(open) = self.open.pop() else {
                return self.fault(self.at, "a parenthesis that was not opened", "delete it, or add ( where it begins");
            };
            if let Some((name, false)) = open.pair {
                return self.fault(open.column, format!("{name} of one number"), format!("write {name}(a, b)"));
            }
            self.out += if open.pair.is_some() { "))" } else { ")" };
            self.power = open.power;
            self.at += 1;
        }
    }

    fn number(&mut self) -> Result<(), Fault> {
        let start = self.at;
        let digits = |at: &mut usize, chars: &[char]| {
            while chars.get(*at).is_some_and(|c| c.is_ascii_digit() || *c == '.') {
                *at += 1;
            }
        };
        digits(&mut self.at, &self.chars);
        if let Some('e' | 'E') = self.chars.get(self.at) {
            let sign = usize::from(matches!(self.chars.get(self.at + 1), Some('+' | '-')));
            if self.chars.get(self.at + 1 + sign).is_some_and(char::is_ascii_digit) {
                self.at += 1 + sign;
                digits(&mut self.at, &self.chars);
            }
        }
        let text: String = self.chars[start..self.at].iter().collect();
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => {
                // without an exponent, to the last digit
                self.out += &value.to_string();
                Ok(())
            }
            _ => self.fault(start, format!("{text:?} is no number"), "write it as 0.02 or 2e-2"),
        }
    }

    /// A quantity, or the beginning of a function, which is then open.
    fn name(&mut self) -> Result<bool, Fault> {
        let start = self.at;
        while self.chars.get(self.at).is_some_and(|c| c.is_alphanumeric() || *c == '_') {
            self.at += 1;
        }
        let name: String = self.chars[start..self.at].iter().collect();
        let pair = BINARY.into_iter().find(|f| *f == name);
        let one = UNARY.into_iter().find(|f| *f == name);
        if let Some(function) = pair.or(one) {
            self.skip_blanks();
            if self.chars.get(self.at) != Some(&'(') {
                return self.fault(start, format!("{function} without parentheses"), format!("write {function}(...)"));
            }
            self.open(pair, &if pair.is_some() { "((".to_string() } else { format!("{function}(") })?;
            return Ok(true);
        }
        if name == PI {
            self.out += &std::f64::consts::PI.to_string();
        } else if self.names.contains(&name.as_str()) {
            self.out += &format!("{{{name}}}");
        } else {
            let called = self.chars[self.at..].iter().find(|c| !c.is_whitespace()) == Some(&'(');
            let known: Vec<&str> = match called {
                true => UNARY.into_iter().chain(BINARY).collect(),
                false => self.names.iter().copied().chain([PI]).collect(),
            };
            return self.fault(start, format!("{name} is unknown"), one_of(&name, &known));
        }
        Ok(false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const NAMES: [&str; 3] = ["x", "max_force_n", "t_s"];

    fn value(text: &str) -> f64 {
        let at = [3.0, 2.0, -0.5];
        Expression::new(text, &NAMES).unwrap_or_else(|f| panic!("{text}: {f:?}")).value(|i| at[i])
    }

    #[test]
    fn expressions_are_what_they_are_on_paper() {
        let close = |text: &str, wanted: f64| {
            let found = value(text);
            assert!((found - wanted).abs() <= 1e-14 * wanted.abs().max(1.0), "{text} is {found}, not {wanted}");
        };
        close("-x^2", -9.0);
        close("(-x)^2", 9.0);
        close("2 - 3 + x", 2.0);
        close("1 - 2 - 3 - x", -7.0);
        close("12 / 2 / 3 * x", 6.0);
        close("x / 2 * 4", 6.0);
        close("1e-3*x + 2.5E+2", 250.003);
        close("2^(-1) * x", 1.5);
        close("-x + 4 * 0", -3.0);
        close("sin(x)^2 + cos(x)^2", 1.0);
        close("max(1, min(x, max_force_n))", 2.0);
        close("max(-x, -max_force_n) - 1", -3.0);
        close("2 * max(x, 1) ^ 2", 18.0);
        close("atan2(-1, 0) + pi / 2", 0.0);
        close("abs(-t_s) * (x - (1 - (2 - x)))", 0.5);
        close("exp(-(t_s * 2)^2)", (-1.0_f64).exp());
        close("sqrt(x^2 + 16) * (-1) + 5", 0.0);
        close("ln(exp(x)) - tanh(0)", 3.0);
    }

    #[test]
    fn faults_have_a_column_and_advice() {
        let fault = |text: &str| Expression::new(text, &NAMES).unwrap_err();
        let unknown = fault("1 + max_force * x");
        assert_eq!((unknown.column, unknown.found.as_str()), (5, "max_force is unknown"));
        assert_eq!(unknown.hint, "did you mean max_force_n? there are x, max_force_n, t_s, pi");
        assert!(fault("sine(x)").hint.starts_with("did you mean sin? there are abs,"), "{}", fault("sine(x)").hint);
        for (text, column) in [
            ("", 1),
            ("x +", 4),
            ("x * (1 + t_s", 5),
            ("x)", 2),
            ("2^3^x", 4),
            ("x * -t_s", 5),
            ("x t_s", 3),
            ("max(x)", 4),
            ("max(x, 1, 2)", 9),
            ("sin x", 1),
            ("1.2.3", 1),
            ("x, 1", 2),
            ("3 $ x", 3),
            ("()", 2),
        ] {
            assert_eq!(fault(text).column, column, "{text}: {:?}", fault(text));
        }
        assert_eq!(fault(&"(".repeat(100)).column, DEEPEST + 1);
    }

    proptest! {
        /// Whatever is written, there is a value or a fault, and no panic.
        #[test]
        fn no_text_panics(text in "[-x0-9.e+*/^(), maxsin_t]{0,40}") {
            if let Ok(expression) = Expression::new(&text, &NAMES) {
                let _ = expression.value(|_| 1.5);
            }
        }
    }
}
