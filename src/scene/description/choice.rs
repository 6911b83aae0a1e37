//! Named choices, for scene files and command lines.

use crate::scene::{spelling, synonyms};
use std::mem::discriminant;

/// A named choice. Readers, schema, messages and the program's help all follow its list of names.
pub trait Choice: Copy + 'static {
    /// The term for the choice, such as "integrator".
    const WHAT: &'static str;

    /// All values with their names, in the order of messages.
    const NAMED: &'static [(&'static str, Self)];

    /// The names.
    fn names() -> impl Iterator<Item = &'static str> + Clone {
        Self::NAMED.iter().map(|(name, _)| *name)
    }

    /// The name, without any parameters of the choice.
    fn name(self) -> &'static str {
        let found = Self::NAMED.iter().find(|(_, other)| discriminant(other) == discriminant(&self));
        found.map_or("?", |(name, _)| name)
    }

    /// The choice with this name.
    fn find(name: &str) -> Option<Self> {
        Self::NAMED.iter().find(|(known, _)| *known == name).map(|(_, choice)| *choice)
    }

    /// The choice with this name, or a message with the counterpart of another program's name or the nearest name.
    fn of_name(name: &str) -> Result<Self, String> {
        Self::find(name).ok_or_else(|| {
            let message = spelling::unknown(Self::WHAT, name);
            let advice = synonyms::advice(Self::WHAT, name).map(str::to_owned);
            match advice.or_else(|| spelling::instead(name, Self::names())) {
                Some(help) => format!("{message}; {help}"),
                None => message,
            }
        })
    }

    /// The names as text: "sobol or independent".
    fn listed() -> String {
        let names: Vec<&str> = Self::names().collect();
        match names.split_last() {
            Some((last, [])) => (*last).to_owned(),
            Some((last, others)) => format!("{} or {last}", others.join(", ")),
            None => String::new(),
        }
    }
}
