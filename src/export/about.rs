//! The description of an export target: its program, its file and the keys of that.

use serde_json::{Value, json};

/// How the target's language marks a comment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comment {
    /// `# `
    Hash,
    /// `% `
    Percent,
    /// `<!-- -->`
    Xml,
    /// `// `
    Slashes,
}

/// A key of a target's file.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// As the target calls it.
    pub name: &'static str,
    /// Unit that the target expects.
    pub unit: &'static str,
    /// Meaning, in the terms of IEEE Std 952.
    pub meaning: &'static str,
}

/// Description of a target.
#[derive(Debug, Clone, Copy)]
pub struct About {
    /// Name on the command line.
    pub id: &'static str,
    /// The program, and what it is for.
    pub program: &'static str,
    /// Usual name of the file.
    pub file: &'static str,
    /// The keys that are filled.
    pub keys: &'static [Key],
    /// Tables that the configuration must hold, and the keys that are left out without them.
    pub needs: &'static str,
    /// How the program takes its noise from the numbers: why they are continuous or discrete.
    pub convention: &'static str,
    /// Where the convention stands.
    pub source: &'static str,
    /// Treatment of the warm-up e(t): only simulators with a bias that varies in time can hold it.
    pub warm_up: &'static str,
    /// How a comment is marked.
    pub comment: Comment,
}

impl About {
    /// The stable form.
    #[must_use]
    pub fn json(&self) -> Value {
        let key = |k: &Key| json!({ "key": k.name, "unit": k.unit, "meaning": k.meaning });
        json!({
            "id": self.id,
            "program": self.program,
            "file": self.file,
            "keys": self.keys.iter().map(key).collect::<Vec<_>>(),
            "needs": self.needs,
            "convention": self.convention,
            "source": self.source,
        })
    }

    /// For people.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = format!("{}: {}\n  file: {}\n", self.id, self.program, self.file);
        for k in self.keys {
            let unit = if k.unit.is_empty() { String::new() } else { format!(" [{}]", k.unit) };
            out += &format!("  {}{unit}: {}\n", k.name, k.meaning);
        }
        out + &format!("  convention: {}\n  needs: {}\n  source: {}\n", self.convention, self.needs, self.source)
    }
}
