//! Tables and lists.

use std::collections::BTreeMap;

use ::toml::de::{DeTable, DeValue};
use serde_json::{Value as Json, json};

use super::form::{Value, ValueForm};
use super::report::{Diagnostics, Placed, Reported};
use super::value;
use crate::scene::spelling::{self, quote};
use crate::scene::synonyms;

/// The meaning of an absent key.
enum Absent {
    /// An error.
    Wrong,
    /// Nothing in itself; the reader of the table decides.
    Fine,
    /// The same as this TOML value.
    Means(&'static str),
}

/// A key of a table: its name, the form of its value, and its description.
pub(super) struct Key<F> {
    name: &'static str,
    about: &'static str,
    form: F,
    absent: Absent,
}

impl<F> Key<F> {
    /// A required key.
    pub(super) const fn required(name: &'static str, form: F, about: &'static str) -> Self {
        Self { name, about, form, absent: Absent::Wrong }
    }

    /// An optional key.
    pub(super) const fn optional(name: &'static str, form: F, about: &'static str) -> Self {
        Self { name, about, form, absent: Absent::Fine }
    }

    /// A key with a default in TOML.
    pub(super) const fn default(
        name: &'static str,
        form: F,
        default: &'static str,
        about: &'static str,
    ) -> Self {
        Self { name, about, form, absent: Absent::Means(default) }
    }
}

/// A [`Key`] of any form, for the list of a [`Table`].
pub(super) trait AnyKey: Sync {
    fn name(&self) -> &'static str;
    fn is_required(&self) -> bool;
    /// The names of tables of this value that have a key with this name.
    fn owners(&self, key: &str) -> Vec<&'static str>;
    /// The schema of the value, with description and default.
    fn schema(&self) -> Json;
}

impl<F: ValueForm> AnyKey for Key<F> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn is_required(&self) -> bool {
        matches!(self.absent, Absent::Wrong)
    }

    fn owners(&self, key: &str) -> Vec<&'static str> {
        self.form.owners(key)
    }

    fn schema(&self) -> Json {
        let mut schema = self.form.schema();
        schema["description"] = self.about.into();
        if let Absent::Means(text) = self.absent
            && let Ok(default) = DeValue::parse(text)
        {
            schema["default"] = value::to_json(default.get_ref());
        }
        schema
    }
}

fn read_default<F: ValueForm>(
    key: &Key<F>,
    text: &str,
    at: usize,
    diagnostics: &mut Diagnostics<'_>,
) -> Result<F::Output, Reported> {
    match DeValue::parse(text) {
        Ok(value) => key.form.read(key.name, &value, diagnostics),
        Err(error) => Err(diagnostics.error(at, format!("the default of {}: {}", key.name, error.message()))),
    }
}

/// The keys of a table.
pub(super) struct Table {
    /// The item that the table describes, with an article: "the film", "a sphere".
    pub(super) what: &'static str,
    /// The keys of the table.
    pub(super) keys: &'static [&'static dyn AnyKey],
    /// JSON Schema keywords for relations between keys, as a JSON object.
    pub(super) rules: &'static str,
}

impl Table {
    pub(super) const fn new(what: &'static str, keys: &'static [&'static dyn AnyKey]) -> Self {
        Self { what, keys, rules: "{}" }
    }

    pub(super) fn names(&self) -> impl Iterator<Item = &'static str> + Clone {
        self.keys.iter().map(|key| key.name())
    }

    /// The schema of this table, with `tag` as its `type` if it has one.
    pub(super) fn schema(&self, tag: Option<&str>) -> Json {
        let mut schema = schema(self.keys.iter().copied(), tag);
        add_rules(&mut schema, self.rules);
        schema
    }
}

/// Adds the keywords of a JSON object to a schema.
pub(super) fn add_rules(schema: &mut Json, rules: &str) {
    if let Ok(Json::Object(rules)) = serde_json::from_str(rules)
        && let Json::Object(schema) = schema
    {
        schema.extend(rules);
    }
}

/// The schema of a table with some keys, with `tag` as its `type` if it has one.
pub(super) fn schema<'k>(keys: impl Iterator<Item = &'k dyn AnyKey>, tag: Option<&str>) -> Json {
    let mut properties = BTreeMap::new();
    let mut required: Vec<&str> = Vec::new();
    if let Some(tag) = tag {
        properties.insert("type", json!({ "const": tag }));
        required.push("type");
    }
    for key in keys {
        properties.insert(key.name(), key.schema());
        if key.is_required() {
            required.push(key.name());
        }
    }
    let mut schema = json!({ "type": "object", "properties": properties, "additionalProperties": false });
    if !required.is_empty() {
        schema["required"] = required.into();
    }
    schema
}

/// A table that is being read.
pub(super) struct Fields<'d, 't> {
    /// The byte offset of the table.
    at: usize,
    what: &'static str,
    table: &'d DeTable<'t>,
    /// Keys that are probably misspelt in the file, which has been reported.
    misspelt: Vec<(&'static str, Reported)>,
}

impl<'d, 't> Fields<'d, 't> {
    /// Checks that `value` is a table with known keys only. `what` is the item that it describes, with an article;
    /// `keys` are those inside of which other keys may belong.
    pub(super) fn open(
        what: &'static str,
        known: impl Iterator<Item = &'static str> + Clone,
        keys: &[&'static dyn AnyKey],
        key: &str,
        value: &'d Value<'t>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<Self, Reported> {
        let entries = expect_table(key, what, value, diagnostics)?;
        let mut misspelt = Vec::new();
        for (name, _) in entries {
            if !known.clone().any(|known| known == name.get_ref()) {
                let message = format!("unknown key {} in {}", quote(name.get_ref()), what);
                let inside = keys.iter().find_map(|key| belongs_inside(*key, name.get_ref()));
                let is_misplaced = inside.is_some();
                let help = |diagnostics: &Diagnostics<'_>| {
                    inside.or_else(|| unknown_key_help(what, name.get_ref(), &known, diagnostics))
                };
                let reported = diagnostics.error_with(name.span().start, message, help);
                let nearest = spelling::nearest(name.get_ref(), known.clone()).filter(|_| !is_misplaced);
                misspelt.extend(nearest.map(|meant| (meant, reported)));
            }
        }
        Ok(Self { at: value.span().start, what, table: entries, misspelt })
    }

    /// A table without keys at a given position. `table` is an empty one.
    pub(super) fn none(at: usize, what: &'static str, table: &'d DeTable<'t>) -> Self {
        Self { at, what, table, misspelt: Vec::new() }
    }

    /// The value of `key`, or its default; an error if there is neither.
    pub(super) fn get<F: ValueForm>(
        &self,
        key: &Key<F>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<F::Output, Reported> {
        match (self.find(key, diagnostics)?, &key.absent) {
            (Some(value), _) => Ok(value),
            (None, Absent::Means(text)) => read_default(key, text, self.at, diagnostics),
            (None, _) => Err(match self.misspelt.iter().find(|(name, _)| *name == key.name) {
                // It is absent only because it is misspelt.
                Some((_, reported)) => *reported,
                None => {
                    diagnostics.error(self.at, format!("missing key {} in {}", quote(key.name), self.what))
                }
            }),
        }
    }

    /// The value of `key`, or `None`; an error if it is probably misspelt.
    pub(super) fn get_if_there<F: ValueForm>(
        &self,
        key: &Key<F>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<Option<F::Output>, Reported> {
        match (self.find(key, diagnostics)?, self.misspelt.iter().find(|(name, _)| *name == key.name)) {
            (None, Some((_, reported))) => Err(*reported),
            (value, _) => Ok(value),
        }
    }

    /// The value of `key` if it is present.
    pub(super) fn find<F: ValueForm>(
        &self,
        key: &Key<F>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<Option<F::Output>, Reported> {
        self.table.get(key.name).map(|value| key.form.read(key.name, value, diagnostics)).transpose()
    }

    /// Whether `key` is present.
    pub(super) fn has<F>(&self, key: &Key<F>) -> bool {
        self.table.contains_key(key.name)
    }

    /// The position of the value of `key`, or of the table if it is absent.
    pub(super) fn place_of<F>(&self, key: &Key<F>) -> usize {
        self.table.get(key.name).map_or(self.at, |value| value.span().start)
    }
}

/// The value as a table that describes `what`.
pub(super) fn expect_table<'d, 't>(
    key: &str,
    what: &str,
    value: &'d Value<'t>,
    diagnostics: &mut Diagnostics<'_>,
) -> Result<&'d DeTable<'t>, Reported> {
    match value.get_ref() {
        DeValue::Table(table) => Ok(table),
        other => {
            let message = format!("{key} must be a table that describes {what}, not {}", value::kind(other));
            Err(diagnostics.error(value.span().start, message))
        }
    }
}

/// Whether a key with this name belongs inside the table that is the value of another key.
fn belongs_inside(key: &dyn AnyKey, name: &str) -> Option<String> {
    let owners = key.owners(name);
    match owners[..] {
        [] => None,
        // "Inside transform, as a key of a transform" would say less than an example.
        [owner] if owner.ends_with(key.name()) => {
            Some(format!("{} belongs inside {1}: {1} = {{ {name} = … }}", quote(name), key.name()))
        }
        _ => {
            Some(format!("{} belongs inside {}, as a key of {}", quote(name), key.name(), owners.join(", ")))
        }
    }
}

fn unknown_key_help<'c>(
    what: &str,
    name: &str,
    known: &(impl Iterator<Item = &'c str> + Clone),
    diagnostics: &Diagnostics<'_>,
) -> Option<String> {
    if spelling::nearest(name, known.clone()).is_none() {
        if let Some(advice) = synonyms::advice(what, name).or_else(|| synonyms::advice("key", name)) {
            return Some(advice.to_owned());
        }
        match &diagnostics.places_of(what, name)[..] {
            [] => {}
            [place] => return Some(format!("{} belongs {place}", quote(name))),
            [others @ .., last] => {
                return Some(format!("{} belongs {} or {last}", quote(name), others.join(", ")));
            }
        }
    }
    spelling::instead(name, known.clone())
}

/// A table that is converted to a value.
pub(super) struct Block<T> {
    pub(super) table: &'static Table,
    pub(super) build: Build<T>,
}

/// Converts a table with known keys.
pub(super) type Build<T> = fn(&Fields<'_, '_>, &mut Diagnostics<'_>) -> Result<T, Reported>;

impl<T> ValueForm for Block<T> {
    type Output = T;

    fn read(&self, key: &str, value: &Value<'_>, diagnostics: &mut Diagnostics<'_>) -> Result<T, Reported> {
        let fields =
            Fields::open(self.table.what, self.table.names(), self.table.keys, key, value, diagnostics)?;
        (self.build)(&fields, diagnostics)
    }

    fn schema(&self) -> Json {
        self.table.schema(None)
    }
}

/// An array of tables: `[[entities]]`.
pub(super) struct ListOf<F>(pub(super) F);

impl<F: ValueForm> ValueForm for ListOf<F> {
    type Output = Vec<F::Output>;

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<Self::Output, Reported> {
        let DeValue::Array(items) = value.get_ref() else {
            let message = format!("{key} must be an array of tables, not {}", value::kind(value.get_ref()));
            let help = format!("begin each with [[{key}]]");
            return Err(diagnostics.error_with(value.span().start, message, |_| Some(help)));
        };
        // All are read, so that all errors are reported, before the first failure is returned.
        let read: Vec<_> = items.iter().map(|item| self.0.read(key, item, diagnostics)).collect();
        read.into_iter().collect()
    }

    fn schema(&self) -> Json {
        json!({ "type": "array", "items": self.0.schema() })
    }
}

/// A value under a name that the file chooses.
#[derive(Clone, Debug)]
pub(super) struct Named<T> {
    pub(super) name: String,
    /// The position of the name.
    pub(super) at: usize,
    pub(super) value: T,
}

/// A table of values under names that the file chooses: `[materials.white]`.
pub(super) struct MapOf<F>(pub(super) F);

impl<F: ValueForm> ValueForm for MapOf<F> {
    /// In the order of the file. A name is defined even if its value is invalid, so that references to it are no
    /// further errors.
    type Output = Vec<Named<Result<F::Output, Reported>>>;

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<Self::Output, Reported> {
        let DeValue::Table(table) = value.get_ref() else {
            let message =
                format!("{key} must be a table of named tables, not {}", value::kind(value.get_ref()));
            let help = format!("begin each with [{key}.NAME]");
            return Err(diagnostics.error_with(value.span().start, message, |_| Some(help)));
        };
        let mut entries: Vec<_> = table
            .iter()
            .map(|(name, value)| Named {
                name: name.get_ref().to_string(),
                at: name.span().start,
                value: self.0.read(
                    &format!("{key}.{}", spelling::shorten(name.get_ref())),
                    value,
                    diagnostics,
                ),
            })
            .collect();
        entries.sort_by_key(|entry| entry.at);
        Ok(entries)
    }

    fn schema(&self) -> Json {
        json!({ "type": "object", "additionalProperties": self.0.schema() })
    }
}

/// A word, or a table of values under names that the file chooses.
pub(super) struct WordOrMap<T, F: ValueForm> {
    pub(super) word: &'static str,
    /// The value of the word.
    pub(super) means: T,
    pub(super) value: F,
    /// Converts the table's values, in the order of the file.
    pub(super) map: fn(Vec<Named<F::Output>>) -> T,
}

impl<T: Clone + Sync, F: ValueForm> ValueForm for WordOrMap<T, F> {
    type Output = T;

    fn read(&self, key: &str, value: &Value<'_>, diagnostics: &mut Diagnostics<'_>) -> Result<T, Reported> {
        let table = match value.get_ref() {
            DeValue::String(word) if *word == self.word => return Ok(self.means.clone()),
            DeValue::Table(table) => table,
            other => {
                let given = match other {
                    DeValue::String(word) => quote(word),
                    other => value::kind(other).to_owned(),
                };
                let message =
                    format!("{key} must be {} or a table of named tables, not {given}", quote(self.word));
                return Err(diagnostics.error(value.span().start, message));
            }
        };
        let mut entries: Vec<_> = table.iter().collect();
        entries.sort_by_key(|(name, _)| name.span().start);
        let read = entries.into_iter().map(|(name, value)| {
            let key = format!("{key}.{}", spelling::shorten(name.get_ref()));
            let value = self.value.read(&key, value, diagnostics)?;
            Ok(Named { name: name.get_ref().to_string(), at: name.span().start, value })
        });
        // All are read, so that all errors are reported, before the first failure is returned.
        let read: Vec<_> = read.collect();
        Ok((self.map)(read.into_iter().collect::<Result<_, _>>()?))
    }

    fn schema(&self) -> Json {
        json!({ "anyOf": [
            { "const": self.word },
            { "type": "object", "additionalProperties": self.value.schema() },
        ] })
    }
}

/// Adds the position of a value.
pub(super) struct At<F>(pub(super) F);

impl<F: ValueForm> ValueForm for At<F> {
    type Output = Placed<F::Output>;

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<Self::Output, Reported> {
        Ok(Placed { at: value.span().start, value: self.0.read(key, value, diagnostics)? })
    }

    fn owners(&self, key: &str) -> Vec<&'static str> {
        self.0.owners(key)
    }

    fn schema(&self) -> Json {
        self.0.schema()
    }
}
