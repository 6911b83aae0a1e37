//! The shapes that values come in: tables, lists.

use std::collections::BTreeMap;

use ::toml::de::{DeTable, DeValue};
use serde_json::{Value as Json, json};

use super::form::{Form, Value};
use super::report::{Placed, Reported, Reports};
use super::value;
use crate::scene::spelling::{self, quote};

/// What it means that a key is absent.
enum Absent {
    /// An error.
    Wrong,
    /// Nothing in itself; whoever reads the table decides.
    Fine,
    /// The same as this TOML value.
    Means(&'static str),
}

/// A key of a table, the form of its value, and what it is about.
pub(super) struct Key<F> {
    name: &'static str,
    about: &'static str,
    form: F,
    absent: Absent,
}

impl<F> Key<F> {
    /// A key without which there is no sense.
    pub(super) const fn required(name: &'static str, form: F, about: &'static str) -> Self {
        Self { name, about, form, absent: Absent::Wrong }
    }

    /// A key that may be absent.
    pub(super) const fn optional(name: &'static str, form: F, about: &'static str) -> Self {
        Self { name, about, form, absent: Absent::Fine }
    }

    /// A key whose absence means `default`, in TOML.
    pub(super) const fn default(
        name: &'static str,
        form: F,
        default: &'static str,
        about: &'static str,
    ) -> Self {
        Self { name, about, form, absent: Absent::Means(default) }
    }
}

/// A [`Key`] of any form, for the list that a [`Table`] keeps.
pub(super) trait AnyKey: Sync {
    fn name(&self) -> &'static str;
    fn is_required(&self) -> bool;
    /// What the tables are that may be its value and have a key of this name.
    fn owners(&self, key: &str) -> Vec<&'static str>;
    /// The schema of the value, with description and default.
    fn schema(&self) -> Json;
}

impl<F: Form> AnyKey for Key<F> {
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

fn read_default<F: Form>(
    key: &Key<F>,
    text: &str,
    at: usize,
    reports: &mut Reports<'_>,
) -> Result<F::Output, Reported> {
    match DeValue::parse(text) {
        Ok(value) => key.form.read(key.name, &value, reports),
        Err(error) => Err(reports.error(at, format!("the default of {}: {}", key.name, error.message()))),
    }
}

/// The keys of a table.
pub(super) struct Table {
    /// What the table describes, with an article: "the film", "a sphere".
    pub(super) what: &'static str,
    /// What there may be in it.
    pub(super) keys: &'static [&'static dyn AnyKey],
    /// JSON Schema keywords for what concerns several keys, as a JSON object.
    pub(super) rules: &'static str,
}

impl Table {
    pub(super) const fn new(what: &'static str, keys: &'static [&'static dyn AnyKey]) -> Self {
        Self { what, keys, rules: "{}" }
    }

    pub(super) fn names(&self) -> impl Iterator<Item = &'static str> + Clone {
        self.keys.iter().map(|key| key.name())
    }

    /// The schema of a table with these keys, and with `tag` as its `type` if there is one.
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

/// The schema of a table with some keys, and with `tag` as its `type` if there is one.
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
    /// Where the table begins.
    at: usize,
    what: &'static str,
    table: &'d DeTable<'t>,
    /// Keys that the file seems to have misspelt, which has been said.
    misspelt: Vec<(&'static str, Reported)>,
}

impl<'d, 't> Fields<'d, 't> {
    /// Checks that `value` is a table with known keys only. `what` is what it describes, with an article; `keys` are
    /// those inside of which other keys may belong.
    pub(super) fn open(
        what: &'static str,
        known: impl Iterator<Item = &'static str> + Clone,
        keys: &[&'static dyn AnyKey],
        key: &str,
        value: &'d Value<'t>,
        reports: &mut Reports<'_>,
    ) -> Result<Self, Reported> {
        let entries = expect_table(key, what, value, reports)?;
        let mut misspelt = Vec::new();
        for (name, _) in entries {
            if !known.clone().any(|known| known == name.get_ref()) {
                let message = format!("unknown key {} in {}", quote(name.get_ref()), what);
                let inside = keys.iter().find_map(|key| belongs_inside(*key, name.get_ref()));
                let is_misplaced = inside.is_some();
                let help = |reports: &Reports<'_>| {
                    inside.or_else(|| unknown_key_help(name.get_ref(), &known, reports))
                };
                let reported = reports.error_with(name.span().start, message, help);
                let nearest = spelling::nearest(name.get_ref(), known.clone()).filter(|_| !is_misplaced);
                misspelt.extend(nearest.map(|meant| (meant, reported)));
            }
        }
        Ok(Self { at: value.span().start, what, table: entries, misspelt })
    }

    /// Without any key, at some place. `table` is an empty one.
    pub(super) fn none(at: usize, what: &'static str, table: &'d DeTable<'t>) -> Self {
        Self { at, what, table, misspelt: Vec::new() }
    }

    /// The value of `key`, or its default; an error if there is neither.
    pub(super) fn get<F: Form>(
        &self,
        key: &Key<F>,
        reports: &mut Reports<'_>,
    ) -> Result<F::Output, Reported> {
        match (self.find(key, reports)?, &key.absent) {
            (Some(value), _) => Ok(value),
            (None, Absent::Means(text)) => read_default(key, text, self.at, reports),
            (None, _) => Err(match self.misspelt.iter().find(|(name, _)| *name == key.name) {
                // It lacks only because it is misspelt.
                Some((_, reported)) => *reported,
                None => reports.error(self.at, format!("missing key {} in {}", quote(key.name), self.what)),
            }),
        }
    }

    /// The value of `key`, or none; an error if the file seems to have misspelt it.
    pub(super) fn get_if_there<F: Form>(
        &self,
        key: &Key<F>,
        reports: &mut Reports<'_>,
    ) -> Result<Option<F::Output>, Reported> {
        match (self.find(key, reports)?, self.misspelt.iter().find(|(name, _)| *name == key.name)) {
            (None, Some((_, reported))) => Err(*reported),
            (value, _) => Ok(value),
        }
    }

    /// The value of `key` if the file gives one.
    pub(super) fn find<F: Form>(
        &self,
        key: &Key<F>,
        reports: &mut Reports<'_>,
    ) -> Result<Option<F::Output>, Reported> {
        self.table.get(key.name).map(|value| key.form.read(key.name, value, reports)).transpose()
    }

    /// Whether the file gives a value for `key`.
    pub(super) fn has<F>(&self, key: &Key<F>) -> bool {
        self.table.contains_key(key.name)
    }

    /// Where the value of `key` stands, or the table if the file gives none.
    pub(super) fn place_of<F>(&self, key: &Key<F>) -> usize {
        self.table.get(key.name).map_or(self.at, |value| value.span().start)
    }
}

/// The table that a value is, which describes `what`.
pub(super) fn expect_table<'d, 't>(
    key: &str,
    what: &str,
    value: &'d Value<'t>,
    reports: &mut Reports<'_>,
) -> Result<&'d DeTable<'t>, Reported> {
    match value.get_ref() {
        DeValue::Table(table) => Ok(table),
        other => {
            let message = format!("{key} must be a table that describes {what}, not {}", value::kind(other));
            Err(reports.error(value.span().start, message))
        }
    }
}

/// That a key of this name belongs inside the table that is the value of another key.
fn belongs_inside(key: &dyn AnyKey, name: &str) -> Option<String> {
    let owners = key.owners(name);
    (!owners.is_empty())
        .then(|| format!("{} belongs inside {}, as a key of {}", quote(name), key.name(), owners.join(", ")))
}

fn unknown_key_help<'c>(
    name: &str,
    known: &(impl Iterator<Item = &'c str> + Clone),
    reports: &Reports<'_>,
) -> Option<String> {
    if spelling::nearest(name, known.clone()).is_none()
        && let Some(header) = reports.header_of(name)
    {
        return Some(format!("{} belongs under {header}", quote(name)));
    }
    spelling::instead(name, known.clone())
}

/// A table that becomes one value.
pub(super) struct Block<T> {
    pub(super) table: &'static Table,
    pub(super) build: Build<T>,
}

/// Makes a value from a table whose keys are known.
pub(super) type Build<T> = fn(&Fields<'_, '_>, &mut Reports<'_>) -> Result<T, Reported>;

impl<T> Form for Block<T> {
    type Output = T;

    fn read(&self, key: &str, value: &Value<'_>, reports: &mut Reports<'_>) -> Result<T, Reported> {
        let fields = Fields::open(self.table.what, self.table.names(), self.table.keys, key, value, reports)?;
        (self.build)(&fields, reports)
    }

    fn schema(&self) -> Json {
        self.table.schema(None)
    }
}

/// An array of tables: `[[entities]]`.
pub(super) struct ListOf<F>(pub(super) F);

impl<F: Form> Form for ListOf<F> {
    type Output = Vec<F::Output>;

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        reports: &mut Reports<'_>,
    ) -> Result<Self::Output, Reported> {
        let DeValue::Array(items) = value.get_ref() else {
            let message = format!("{key} must be an array of tables, not {}", value::kind(value.get_ref()));
            let help = format!("begin each with [[{key}]]");
            return Err(reports.error_with(value.span().start, message, |_| Some(help)));
        };
        // All are read, so that all errors are seen, before the first failure counts.
        let read: Vec<_> = items.iter().map(|item| self.0.read(key, item, reports)).collect();
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
    /// Where the name stands.
    pub(super) at: usize,
    pub(super) value: T,
}

/// A table of values under names that the file chooses: `[materials.white]`.
pub(super) struct MapOf<F>(pub(super) F);

impl<F: Form> Form for MapOf<F> {
    /// In the order of the file. A name counts as given even if its value is wrong, so that those who use the
    /// name are not blamed.
    type Output = Vec<Named<Result<F::Output, Reported>>>;

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        reports: &mut Reports<'_>,
    ) -> Result<Self::Output, Reported> {
        let DeValue::Table(table) = value.get_ref() else {
            let message = format!("{key} must be a table of names, not {}", value::kind(value.get_ref()));
            let help = format!("begin each with [{key}.NAME]");
            return Err(reports.error_with(value.span().start, message, |_| Some(help)));
        };
        let mut entries: Vec<_> = table
            .iter()
            .map(|(name, value)| Named {
                name: name.get_ref().to_string(),
                at: name.span().start,
                value: self.0.read(&format!("{key}.{}", spelling::shorten(name.get_ref())), value, reports),
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
pub(super) struct WordOrMap<T, F: Form> {
    pub(super) word: &'static str,
    /// What the word stands for.
    pub(super) means: T,
    pub(super) value: F,
    /// What becomes of a table, in the order of the file.
    pub(super) map: fn(Vec<Named<F::Output>>) -> T,
}

impl<T: Clone + Sync, F: Form> Form for WordOrMap<T, F> {
    type Output = T;

    fn read(&self, key: &str, value: &Value<'_>, reports: &mut Reports<'_>) -> Result<T, Reported> {
        let table = match value.get_ref() {
            DeValue::String(word) if *word == self.word => return Ok(self.means.clone()),
            DeValue::Table(table) => table,
            other => {
                let given = match other {
                    DeValue::String(word) => quote(word),
                    other => value::kind(other).to_owned(),
                };
                let message = format!("{key} must be {} or a table of names, not {given}", quote(self.word));
                return Err(reports.error(value.span().start, message));
            }
        };
        let mut entries: Vec<_> = table.iter().collect();
        entries.sort_by_key(|(name, _)| name.span().start);
        let read = entries.into_iter().map(|(name, value)| {
            let key = format!("{key}.{}", spelling::shorten(name.get_ref()));
            let value = self.value.read(&key, value, reports)?;
            Ok(Named { name: name.get_ref().to_string(), at: name.span().start, value })
        });
        // All are read, so that all errors are seen, before the first failure counts.
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

/// Keeps the place of a value.
pub(super) struct At<F>(pub(super) F);

impl<F: Form> Form for At<F> {
    type Output = Placed<F::Output>;

    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        reports: &mut Reports<'_>,
    ) -> Result<Self::Output, Reported> {
        Ok(Placed { at: value.span().start, value: self.0.read(key, value, reports)? })
    }

    fn schema(&self) -> Json {
        self.0.schema()
    }
}
