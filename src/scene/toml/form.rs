//! Value forms. A [`ValueForm`] reads a value and describes it in JSON Schema, so that the two agree.

use ::toml::de::DeValue;
use serde_json::Value as Json;

use super::report::{Diagnostics, Reported};

/// A TOML value with its byte range.
pub(super) type Value<'t> = ::toml::Spanned<DeValue<'t>>;

/// The form of a value.
pub(super) trait ValueForm: Sync {
    /// The type of the result.
    type Output;

    /// Reads the value of `key`, and reports all problems with it.
    fn read(
        &self,
        key: &str,
        value: &Value<'_>,
        diagnostics: &mut Diagnostics<'_>,
    ) -> Result<Self::Output, Reported>;

    /// The names, each with an article, of those tables of this form that have a key with this name.
    fn owners(&self, _key: &str) -> Vec<&'static str> {
        Vec::new()
    }

    /// The JSON Schema of the values that [`Self::read`] accepts.
    fn schema(&self) -> Json;
}
