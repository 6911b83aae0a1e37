//! Variables: `$name` in attributes, with values from the command line or from `<default>`.

use super::limits::LONGEST_SUBSTITUTED;
use std::collections::HashMap;

#[derive(Debug)]
struct Variable {
    value: String,
    /// Whether a file has used it or has a default for it.
    known: bool,
}

/// The variables of a scene.
#[derive(Debug, Default)]
pub(super) struct Variables {
    by_name: HashMap<String, Variable>,
    /// The length of the longest name in bytes.
    longest: usize,
}

impl Variables {
    /// The variables of the command line. If a name has several values, the last one counts.
    pub(super) fn given(defines: &[(String, String)]) -> Variables {
        let mut variables = Variables::default();
        defines.iter().for_each(|(name, value)| variables.set(name, value, false));
        variables
    }

    fn set(&mut self, name: &str, value: &str, known: bool) {
        self.longest = self.longest.max(name.len());
        self.by_name.insert(name.to_owned(), Variable { value: value.to_owned(), known });
    }

    /// Sets the default of a variable that has no value.
    pub(super) fn fall_back(&mut self, name: &str, value: &str) {
        match self.by_name.get_mut(name) {
            Some(variable) => variable.known = true,
            None => self.set(name, value, true),
        }
    }

    /// A text with the values of its variables, or the name of an unknown variable. The longest matching name counts.
    /// `\$` is a dollar sign.
    pub(super) fn put_into(&mut self, text: &str) -> Result<String, String> {
        let mut done = String::new();
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            let (before, after) = rest.split_at(at);
            let after = &after[1..];
            rest = after;
            if let Some(before) = before.strip_suffix('\\') {
                done += before;
                done.push('$');
                continue;
            }
            done += before;
            let longest = self.longest.min(after.len());
            let name = (1..=longest)
                .rev()
                .filter_map(|end| after.get(..end))
                .find(|name| self.by_name.contains_key(*name));
            let Some(variable) = name.and_then(|name| self.by_name.get_mut(name)) else {
                let end = after.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(after.len());
                return Err(after[..end].to_owned());
            };
            variable.known = true;
            done += &variable.value;
            if done.len() > LONGEST_SUBSTITUTED {
                // The text is already too long. The caller refuses it.
                return Ok(done);
            }
            rest = &after[name.map_or(0, str::len)..];
        }
        Ok(done + rest)
    }

    /// The names from the command line that no file uses, in order.
    pub(super) fn unused(&self) -> Vec<String> {
        let unused = self.by_name.iter().filter(|(_, variable)| !variable.known);
        let mut names: Vec<_> = unused.map(|(name, _)| name.clone()).collect();
        names.sort_unstable();
        names
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_put_in_place_of_the_longest_name() {
        let given = [("spp", "8"), ("sppx", "9"), ("a", "$spp")].map(|(n, v)| (n.to_owned(), v.to_owned()));
        let mut variables = Variables::given(&given);
        variables.fall_back("spp", "1");
        variables.fall_back("depth", "5");
        let mut put = |text| variables.put_into(text);
        assert_eq!(put("$spp"), Ok("8".into()));
        assert_eq!(put("x$sppx y$depth."), Ok("x9 y5.".into()));
        assert_eq!(put("\\$spp $spp"), Ok("$spp 8".into()));
        // Variables in values are not replaced, so each text grows by at most the lengths of its values.
        assert_eq!(put("$a"), Ok("$spp".into()));
        assert_eq!(put("$none!"), Err("none".into()));
        assert_eq!(put("é$"), Err(String::new()));
    }

    #[test]
    fn variables_that_no_file_knows_are_told() {
        let mut variables = Variables::given(&[("b".into(), "1".into()), ("a".into(), "1".into())]);
        assert_eq!(variables.unused(), ["a", "b"]);
        variables.fall_back("a", "2");
        assert_eq!(variables.put_into("$a"), Ok("1".into()));
        assert_eq!(variables.unused(), ["b"]);
    }
}
