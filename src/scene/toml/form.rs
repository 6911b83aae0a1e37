//! What a value may be. A [`Form`] reads a value and describes it in JSON Schema, so the two agree.

use ::toml::de::DeValue;
use serde_json::Value as Json;

use super::report::{Reported, Reports};

/// A TOML value and the bytes it stands at.
pub(super) type Value<'t> = ::toml::Spanned<DeValue<'t>>;

/// What a value may be.
pub(super) trait Form: Sync {
    /// What it is read into.
    type Output;

    /// Reads the value of `key`, reporting all that is wrong with it.
    fn read(&self, key: &str, value: &Value<'_>, reports: &mut Reports<'_>)
    -> Result<Self::Output, Reported>;

    /// What the tables are of which it is one and that have a key of this name, each with an article.
    fn owners(&self, _key: &str) -> Vec<&'static str> {
        Vec::new()
    }

    /// The JSON Schema of what [`Self::read`] accepts.
    fn schema(&self) -> Json;
}
