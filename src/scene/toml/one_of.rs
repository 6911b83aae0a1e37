//! Tables selected by a `type`, or by a word.

use ::toml::de::{DeTable, DeValue};
use serde_json::{Value as Json, json};

use super::declared::{self, Values, names};
use super::form::{Value, ValueForm};
use super::report::{Diagnostics, Read, Reported};
use super::table::{AnyKey, Build, Fields, Table, expect_table};
use super::value;
use crate::parameter::Declaration;
use crate::scene::spelling::{self, quote};

/// One of the tables, with its `type`.
pub(super) struct Variant<T: 'static> {
    pub(super) tag: &'static str,
    pub(super) table: &'static Table,
    pub(super) build: Build<T>,
}

impl<T> Variant<T> {
    pub(super) const fn new(tag: &'static str, table: &'static Table, build: Build<T>) -> Self {
        Self { tag, table, build }
    }
}

/// The members of a family, each of which is declared in a file of its own.
pub(super) struct Members<T: 'static> {
    pub(super) declarations: &'static [Declaration],
    /// Whether their numbers and colours may be textures.
    pub(super) textured: bool,
    /// The parameters that all members share.
    pub(super) common: Option<&'static Declaration>,
    /// Further keys of a member.
    pub(super) more: fn(&Declaration) -> &'static [&'static dyn AnyKey],
    /// Converts the values and the table that contains them.
    pub(super) build: fn(Values, &Fields<'_, '_>, &mut Diagnostics<'_>) -> Read<T>,
}

/// A table whose `type` determines its keys.
pub(super) struct OneOf<T: 'static> {
    /// The term for the family, without an article: "material".
    pub(super) what: &'static str,
    /// Declared members, listed before the others.
    pub(super) members: Option<Members<T>>,
    pub(super) variants: &'static [Variant<T>],
}

impl<T> OneOf<T> {
    fn declarations(&self) -> &'static [Declaration] {
        self.members.as_ref().map_or(&[], |members| members.declarations)
    }

    /// The members in lists and in the schema.
    fn shown(&self) -> impl Iterator<Item = &'static Declaration> + Clone {
        self.declarations().iter().filter(|declaration| !declaration.is_hidden)
    }

    /// The names of a member's keys, except `type` and the shared ones.
    fn keys_of(&self, declaration: &'static Declaration) -> impl Iterator<Item = &'static str> + Clone {
        names(declaration).chain(self.more(declaration).iter().map(|key| key.name()))
    }

    fn more(&self, declaration: &Declaration) -> &'static [&'static dyn AnyKey] {
        self.members.as_ref().map_or(&[], |members| (members.more)(declaration))
    }

    /// Whether this family has a key that was given for the item `what`, which is not of this family: its members have
    /// different keys.
    pub(super) fn is_home(&self, what: &str, key: &str) -> bool {
        let is_declared = self.declarations().iter().any(|declaration| declaration.what == what);
        let is_variant = self.variants.iter().any(|variant| variant.table.what == what);
        let common = self.members.as_ref().and_then(|members| members.common);
        let is_known =
            || !self.owners(key).is_empty() || common.into_iter().flat_map(names).any(|n| n == key);
        !is_declared && !is_variant && is_known()
    }

    fn tags(&self) -> impl Iterator<Item = &'static str> + Clone {
        self.shown()
            .map(|declaration| declaration.name)
            .chain(self.variants.iter().map(|variant| variant.tag))
    }

    fn pick(
        &self,
        tag: &str,
        at: usize,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<&'static Variant<T>, Reported> {
        match self.variants.iter().find(|variant| variant.tag == tag) {
            Some(variant) => Ok(variant),
            None => {
                let what = format!("{} type", self.what);
                Err(value::unknown_word(&what, tag, self.tags(), at, diagnostics))
            }
        }
    }
}

impl<T> ValueForm for OneOf<T> {
    type Output = T;

    fn read(&self, key: &str, value: &Value<'_>, diagnostics: &mut Diagnostics<'_>) -> Result<T, Reported> {
        let table = expect_table(key, &format!("a {}", self.what), value, diagnostics)?;
        let Some(tag) = table.get("type") else {
            let is_like_it = |name: &str| {
                self.owners(name).is_empty() && spelling::nearest(name, ["type"].into_iter()).is_some()
            };
            if let Some((name, _)) = table.iter().find(|(name, _)| is_like_it(name.get_ref())) {
                let message = format!("unknown key {} in {key}", quote(name.get_ref()));
                let help = spelling::instead(name.get_ref(), ["type"].into_iter());
                return Err(diagnostics.error_with(name.span().start, message, |_| help));
            }
            let message = format!("missing key \"type\" in {key}");
            let types = || spelling::list(self.tags()).map(|all| format!("a {} is one of {all}", self.what));
            return Err(diagnostics.error_with(value.span().start, message, |_| types()));
        };
        let word = value::Word.read("type", tag, diagnostics)?;
        if let Some(members) = &self.members
            && let Some(place) = members.declarations.iter().position(|declaration| declaration.name == word)
        {
            let declaration = &members.declarations[place];
            let common = members.common.into_iter().flat_map(names);
            let known = ["type"].into_iter().chain(self.keys_of(declaration)).chain(common);
            let fields =
                Fields::open(declaration.what, known, self.more(declaration), key, value, diagnostics)?;
            let mut values = Values::read(place, declaration, members.textured, &fields, diagnostics);
            let common =
                members.common.map(|common| Values::read(0, common, members.textured, &fields, diagnostics));
            values.common = common.map(Box::new);
            return (members.build)(values, &fields, diagnostics);
        }
        let variant = self.pick(&word, tag.span().start, diagnostics)?;
        let known = ["type"].into_iter().chain(variant.table.names());
        let fields = Fields::open(variant.table.what, known, variant.table.keys, key, value, diagnostics)?;
        (variant.build)(&fields, diagnostics)
    }

    fn owners(&self, key: &str) -> Vec<&'static str> {
        let declared = self.shown().filter(|declaration| self.keys_of(declaration).any(|name| name == key));
        let variants = self.variants.iter().filter(|variant| variant.table.names().any(|name| name == key));
        declared.map(|declared| declared.what).chain(variants.map(|variant| variant.table.what)).collect()
    }

    fn schema(&self) -> Json {
        let textured = self.members.as_ref().is_some_and(|members| members.textured);
        let common = self.members.as_ref().and_then(|members| members.common);
        let variants = self.variants.iter().map(|variant| variant.table.schema(Some(variant.tag)));
        let schema_of = |shown| declared::schema(shown, common, textured, self.more(shown));
        json!({ "oneOf": self.shown().map(schema_of).chain(variants).collect::<Vec<_>>() })
    }
}

/// Either a `type` alone, as a word, or a table with a `type`.
pub(super) struct WordOr<T: 'static>(pub(super) OneOf<T>);

impl<T> WordOr<T> {
    /// Reads the word.
    fn read_word(&self, word: &str, at: usize, diagnostics: &mut Diagnostics<'_>) -> Result<T, Reported> {
        let variant = self.0.pick(word, at, diagnostics)?;
        let none = DeTable::new();
        (variant.build)(&Fields::none(at, variant.table.what, &none), diagnostics)
    }
}

impl<T> ValueForm for WordOr<T> {
    type Output = T;

    fn read(&self, key: &str, value: &Value<'_>, diagnostics: &mut Diagnostics<'_>) -> Result<T, Reported> {
        match value.get_ref() {
            DeValue::String(word) => self.read_word(word, value.span().start, diagnostics),
            DeValue::Table(_) => self.0.read(key, value, diagnostics),
            other => {
                let message = format!("{key} must be a string or a table, not {}", value::kind(other));
                let help = spelling::list(self.0.tags()).map(|all| format!("valid here: {all}"));
                Err(diagnostics.error_with(value.span().start, message, |_| help))
            }
        }
    }

    fn schema(&self) -> Json {
        let words: Vec<&str> = self.0.tags().collect();
        json!({ "anyOf": [{ "enum": words }, self.0.schema()] })
    }
}
