//! The header of a NumPy array: a dictionary in Python's notation with type, order and shape.

use std::fmt;

/// A plain type: `<f8`, `>i2`, `|u1`, `<M8[ns]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Plain {
    pub big: bool,
    pub letter: char,
    /// Bytes.
    pub size: usize,
    /// Unit of a date, such as `ns`; empty for other types.
    pub unit: String,
}

/// A plain type at an offset of each item.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Field {
    /// Empty where the item is one number.
    pub name: String,
    pub plain: Plain,
    pub at: usize,
    /// Numbers beside each other in an item.
    pub count: usize,
}

/// Content of the header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Header {
    pub fields: Vec<Field>,
    pub item_bytes: usize,
    pub fortran_order: bool,
    pub shape: Vec<u64>,
}

/// Records within records, and fields, beyond which no log is described.
const DEEPEST: usize = 8;
const MOST_FIELDS: usize = 1024;

/// A value in Python's notation.
#[derive(Debug, Clone, PartialEq)]
enum Value {
    Text(String),
    Whole(u64),
    Truth(bool),
    /// A list or a tuple.
    List(Vec<Value>),
    Dict(Vec<(String, Value)>),
}

impl fmt::Display for Plain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match self.letter {
            'b' => "bool",
            'i' => "int",
            'u' => "uint",
            'f' => "float",
            'c' => "complex",
            'M' => "datetime",
            'm' => "timedelta",
            'O' => "object",
            'S' | 'U' => return f.write_str("text"),
            _ => return f.write_str("bytes"),
        };
        let unit = if self.unit.is_empty() { String::new() } else { format!("[{}]", self.unit) };
        if matches!(self.letter, 'b' | 'O') {
            f.write_str(name)
        } else {
            write!(f, "{name}{}{unit}", self.size.saturating_mul(8))
        }
    }
}

impl Plain {
    fn parse(text: &str) -> Result<Self, String> {
        let wrong = || format!("{text:?} is no type");
        let mut letters = text.chars();
        let big = match letters.next() {
            Some('<' | '|') => false,
            Some('>') => true,
            // the machine's own order
            Some('=') => cfg!(target_endian = "big"),
            _ => return Err(wrong()),
        };
        let letter = letters.next().filter(char::is_ascii_alphabetic).ok_or_else(wrong)?;
        let rest = letters.as_str();
        let (size, unit) = match rest.split_once('[') {
            Some((size, unit)) => (size, unit.trim_end_matches(']')),
            None => (rest, ""),
        };
        // an object has no size: a pointer's is assumed
        let size = if letter == 'O' { 8 } else { size.parse().map_err(|_| wrong())? };
        // letters of Unicode take four bytes each
        let size = if letter == 'U' { usize::checked_mul(size, 4).ok_or_else(wrong)? } else { size };
        Ok(Self { big, letter, size, unit: unit.to_string() })
    }
}

impl Header {
    /// Reads the text after the magic number; the error says what is amiss.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let mut reader = Reader { rest: text };
        let Value::Dict(all) = reader.value(0)? else { return Err("the header is no dictionary".into()) };
        let get = |key: &str| {
            all.iter().find(|(k, _)| k == key).map(|(_, v)| v).ok_or_else(|| format!("the header has no {key:?}"))
        };
        let Value::Truth(fortran_order) = get("fortran_order")? else {
            return Err("the order is neither true nor false".into());
        };
        let Value::List(shape) = get("shape")? else { return Err("the shape is no tuple".into()) };
        let whole = |v: &Value| match v {
            Value::Whole(n) => Ok(*n),
            _ => Err("the shape is not of whole numbers".to_string()),
        };
        let shape = shape.iter().map(whole).collect::<Result<_, _>>()?;
        let mut fields = Vec::new();
        let item_bytes = add("", get("descr")?, 0, 0, &mut fields)?;
        Ok(Self { fields, item_bytes, fortran_order: *fortran_order, shape })
    }
}

/// Appends the fields of a type at byte `at`; returns where it ends.
fn add(name: &str, descr: &Value, at: usize, depth: usize, fields: &mut Vec<Field>) -> Result<usize, String> {
    let all = match descr {
        Value::Text(text) => {
            let plain = Plain::parse(text)?;
            let end = at.checked_add(plain.size).ok_or("an item is larger than any memory")?;
            fields.push(Field { name: name.to_string(), plain, at, count: 1 });
            return Ok(end);
        }
        Value::List(all) if depth < DEEPEST => all,
        _ => return Err("the type is not described".into()),
    };
    let mut end = at;
    for field in all {
        if fields.len() >= MOST_FIELDS {
            return Err(format!("more than {MOST_FIELDS} fields"));
        }
        let Value::List(parts) = field else { return Err("a field is not described".into()) };
        let (own, of, shape) = match &parts[..] {
            [own, of] => (own, of, None),
            [own, of, shape] => (own, of, Some(shape)),
            _ => return Err("a field is not described".into()),
        };
        let own = match own {
            Value::Text(own) => own,
            // title and name
            Value::List(two) => match &two[..] {
                [_, Value::Text(own)] => own,
                _ => return Err("a field has no name".into()),
            },
            _ => return Err("a field has no name".into()),
        };
        let full = if name.is_empty() { own.clone() } else { format!("{name}.{own}") };
        let before = fields.len();
        let begin = end;
        end = add(&full, of, begin, depth + 1, fields)?;
        let Some(shape) = shape else { continue };
        let sides: &[Value] = match shape {
            Value::List(sides) => sides,
            one => std::slice::from_ref(one),
        };
        let mut count = 1usize;
        for side in sides {
            let Value::Whole(n) = side else { return Err("a field's shape is not of whole numbers".into()) };
            let n = usize::try_from(*n).map_err(|_| "a field is larger than any memory")?;
            count = count.checked_mul(n).ok_or("a field is larger than any memory")?;
        }
        let size = (end - begin).checked_mul(count).ok_or("a field is larger than any memory")?;
        end = begin.checked_add(size).ok_or("an item is larger than any memory")?;
        // a row of numbers is a matrix; rows of records are left out
        match fields.get_mut(before..) {
            Some([one]) => one.count = count,
            _ => fields.truncate(before),
        }
    }
    Ok(end)
}

/// Python's notation, as far as headers need it.
struct Reader<'a> {
    rest: &'a str,
}

impl Reader<'_> {
    fn blank(&mut self) {
        self.rest = self.rest.trim_start();
    }

    fn takes(&mut self, token: &str) -> bool {
        self.blank();
        self.rest.strip_prefix(token).map(|rest| self.rest = rest).is_some()
    }

    fn wrong(&self) -> String {
        let next: String = self.rest.chars().take(12).collect();
        format!("the header cannot be read at {next:?}")
    }

    fn value(&mut self, depth: usize) -> Result<Value, String> {
        self.blank();
        if depth > 3 * DEEPEST {
            return Err(self.wrong());
        }
        if self.takes("{") {
            let mut all = Vec::new();
            while !self.takes("}") {
                let Value::Text(key) = self.value(depth + 1)? else { return Err(self.wrong()) };
                if !self.takes(":") {
                    return Err(self.wrong());
                }
                all.push((key, self.value(depth + 1)?));
                if !self.takes(",") && !self.rest.trim_start().starts_with('}') {
                    return Err(self.wrong());
                }
            }
            return Ok(Value::Dict(all));
        }
        for (open, close) in [("(", ")"), ("[", "]")] {
            if self.takes(open) {
                let mut all = Vec::new();
                while !self.takes(close) {
                    all.push(self.value(depth + 1)?);
                    if !self.takes(",") && !self.rest.trim_start().starts_with(close) {
                        return Err(self.wrong());
                    }
                }
                return Ok(Value::List(all));
            }
        }
        if self.takes("True") {
            return Ok(Value::Truth(true));
        }
        if self.takes("False") {
            return Ok(Value::Truth(false));
        }
        match self.rest.chars().next() {
            Some(quote @ ('\'' | '"')) => self.text(quote),
            _ => {
                let end = self.rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(self.rest.len());
                let number = self.rest[..end].parse().map_err(|_| self.wrong())?;
                // Python 2 marks large ones
                self.rest = self.rest[end..].trim_start_matches('L');
                Ok(Value::Whole(number))
            }
        }
    }

    fn text(&mut self, quote: char) -> Result<Value, String> {
        let mut out = String::new();
        let mut letters = self.rest.char_indices().skip(1);
        while let Some((at, letter)) = letters.next() {
            match letter {
                '\\' => out.extend(letters.next().map(|l| l.1)),
                _ if letter == quote => {
                    self.rest = &self.rest[at + letter.len_utf8()..];
                    return Ok(Value::Text(out));
                }
                _ => out.push(letter),
            }
        }
        Err(self.wrong())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_arrays_and_records_are_described() {
        let header = Header::parse("{'descr': '<f8', 'fortran_order': False, 'shape': (400, 3), }   \n").unwrap();
        assert_eq!((header.item_bytes, &header.shape[..], header.fortran_order), (8, &[400, 3][..], false));
        assert_eq!(header.fields[0].plain, Plain { big: false, letter: 'f', size: 8, unit: String::new() });
        let text = "{'descr': [('t', '<M8[ns]'), ('w', '>f4', (3,)), ('p', [('a', '|u1'), ('b', '<i2')], (2,)), \
                    ('in', [('x', '<f8')])], 'fortran_order': True, 'shape': (7L,)}";
        let header = Header::parse(text).unwrap();
        let places: Vec<(&str, usize, usize)> =
            header.fields.iter().map(|f| (f.name.as_str(), f.at, f.count)).collect();
        assert_eq!(places, [("t", 0, 1), ("w", 8, 3), ("in.x", 26, 1)]);
        assert_eq!((header.item_bytes, header.shape), (34, vec![7]));
        assert_eq!((header.fields[0].plain.unit.as_str(), header.fields[1].plain.big), ("ns", true));
    }

    #[test]
    fn headers_that_are_none_are_refused() {
        for text in [
            "",
            "{",
            "[1]",
            "{'descr': '<f8'}",
            "{'descr': 'f8', 'fortran_order': False, 'shape': (1,)}",
            "{'descr': '<f8', 'fortran_order': 1, 'shape': (1,)}",
            "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,)}",
            "{'descr': '<f99999999999999999999', 'fortran_order': False, 'shape': (1,)}",
            "{'descr': [('a',)], 'fortran_order': False, 'shape': (1,)}",
            "{'descr': [('a', '<f8', (99999999999999, 99999999999999))], 'fortran_order': False, 'shape': (1,)}",
            "{'descr' '<f8'}",
            "{'descr': '<f8",
        ] {
            assert!(Header::parse(text).is_err(), "{text}");
        }
        assert!(Header::parse(&"[".repeat(60_000)).is_err());
    }
}
