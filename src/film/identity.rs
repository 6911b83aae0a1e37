//! The identity of a film: the facts that determine the bits of its samples.

use std::fmt;

/// Named facts, in the order of presentation. Films with equal facts belong to the same render, and can be resumed and
/// merged.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Identity(Vec<(String, String)>);

/// A difference between the identities of two films.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The name of the fact that differs.
    pub name: String,
    /// Its value in the first film, if it has one.
    pub ours: Option<String>,
    /// Its value in the other film, if it has one.
    pub theirs: Option<String>,
    /// A description of the difference within the value, if that is more helpful than the two values.
    pub within: Option<String>,
}

impl Identity {
    /// Adds a fact. Line breaks in names and values become spaces, and a colon in the name is replaced.
    pub fn with(mut self, name: &str, value: impl fmt::Display) -> Identity {
        let clean = |text: String| text.replace(['\n', '\r'], " ");
        self.0.push((clean(name.replace(':', " ")), clean(value.to_string())));
        self
    }

    /// The value of a fact.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.0.iter().find(|(n, _)| n == name).map(|(_, value)| &value[..])
    }

    /// All facts as pairs of name and value.
    pub fn facts(&self) -> impl Iterator<Item = (&str, &str)> {
        self.0.iter().map(|(name, value)| (&name[..], &value[..]))
    }

    /// The first fact that differs from the other identity.
    pub fn difference(&self, other: &Identity) -> Option<Difference> {
        let names = self.0.iter().chain(&other.0).map(|(name, _)| name);
        names
            .map(|name| (name, self.get(name), other.get(name)))
            .find(|(_, ours, theirs)| ours != theirs)
            .map(|(name, ours, theirs)| Difference {
                name: name.clone(),
                ours: ours.map(str::to_owned),
                theirs: theirs.map(str::to_owned),
                within: None,
            })
    }

    /// Parses the lines that [`fmt::Display`] writes; `None` if one is not a fact.
    pub fn parse(text: &str) -> Option<Identity> {
        text.lines()
            .map(|line| line.split_once(": ").map(|(name, value)| (name.to_owned(), value.to_owned())))
            .collect::<Option<_>>()
            .map(Identity)
    }
}

/// One line per fact: `name: value`.
impl fmt::Display for Identity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|(name, value)| writeln!(f, "{name}: {value}"))
    }
}

/// "its seed is 1, not 2".
impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Difference { name, ours, theirs, within } = self;
        if let Some(within) = within {
            return write!(f, "its {name} differs in {within}");
        }
        match (ours, theirs) {
            (Some(ours), Some(theirs)) => write!(f, "its {name} is {theirs}, not {ours}"),
            (None, Some(theirs)) => write!(f, "its {name} is {theirs}, but none is set here"),
            (Some(ours), None) => write!(f, "its {name} is missing, but is {ours} here"),
            (None, None) => write!(f, "its {name} differs"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn identity() -> Identity {
        Identity::default().with("scene", "0a").with("size", "6x4").with("filter", "tent 1")
    }

    #[test]
    fn lines_are_read_back() {
        let text = identity().to_string();
        assert_eq!(text, "scene: 0a\nsize: 6x4\nfilter: tent 1\n");
        assert_eq!(Identity::parse(&text), Some(identity()));
        assert_eq!(Identity::parse("scene: 0a\nsize\n"), None);
        let odd = Identity::default().with("de:vice\n", "gpu: one\r\ntwo");
        assert_eq!(Identity::parse(&odd.to_string()), Some(odd));
    }

    #[test]
    fn differences_are_described_with_both_values() {
        let said = |other: Identity| identity().difference(&other).map(|d| d.to_string());
        assert_eq!(said(identity()), None);
        let other = Identity::default().with("scene", "0a").with("size", "6x4").with("filter", "box 0.5");
        assert_eq!(said(other).unwrap(), "its filter is box 0.5, not tent 1");
        let shorter = Identity::default().with("scene", "0a").with("size", "6x4");
        assert_eq!(said(shorter).unwrap(), "its filter is missing, but is tent 1 here");
        let longer = identity().with("device", "gpu");
        assert_eq!(said(longer).unwrap(), "its device is gpu, but none is set here");
    }
}
