//! Variables: `$name` in attributes, with values from the command line or from `<default>`.

use super::limits::LONGEST_SUBSTITUTED;
use std::collections::HashMap;

#[derive(Debug)]
struct Variable {
    name: String,
    value: String,
    /// Whether a file has used it or has a default for it.
    known: bool,
}

/// The variables of a scene. Their names are in a tree of bytes, so that the longest name at the start of a text is
/// found in one pass.
#[derive(Debug, Default)]
pub(super) struct Variables {
    all: Vec<Variable>,
    /// The next node for a node and a byte; the root is 0.
    edges: HashMap<(u32, u8), u32>,
    /// The variable whose name ends at a node.
    ends: HashMap<u32, usize>,
}

impl Variables {
    /// The variables of the command line. If a name has several values, the last one counts.
    pub(super) fn given(defines: &[(String, String)]) -> Variables {
        let mut variables = Variables::default();
        for (name, value) in defines {
            match variables.exactly(name) {
                Some(known) => variables.all[known].value.clone_from(value),
                None => variables.add(name, value, false),
            }
        }
        variables
    }

    fn add(&mut self, name: &str, value: &str, known: bool) {
        let mut node = 0;
        for byte in name.bytes() {
            let next = self.edges.len() as u32 + 1;
            node = *self.edges.entry((node, byte)).or_insert(next);
        }
        self.ends.insert(node, self.all.len());
        self.all.push(Variable { name: name.to_owned(), value: value.to_owned(), known });
    }

    /// The variable with the longest name that is a prefix of a text.
    fn longest(&self, text: &str) -> Option<usize> {
        let mut node = 0;
        let mut found = None;
        for byte in text.bytes() {
            match self.edges.get(&(node, byte)) {
                Some(&next) => node = next,
                None => break,
            }
            found = self.ends.get(&node).copied().or(found);
        }
        found
    }

    /// The variable with this name.
    fn exactly(&self, name: &str) -> Option<usize> {
        self.longest(name).filter(|&found| self.all[found].name == name)
    }

    /// Sets the default of a variable that has no value. Its name contains no dollar sign, so that a text is searched
    /// for names in one pass.
    pub(super) fn fall_back(&mut self, name: &str, value: &str) {
        match self.exactly(name) {
            Some(variable) => self.all[variable].known = true,
            None => self.add(name, value, true),
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
            let Some(found) = self.longest(after) else {
                let end = after.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(after.len());
                return Err(after[..end].to_owned());
            };
            let variable = &mut self.all[found];
            variable.known = true;
            done += &variable.value;
            if done.len() > LONGEST_SUBSTITUTED {
                // The text is already too long. The caller refuses it.
                return Ok(done);
            }
            rest = &after[variable.name.len()..];
        }
        Ok(done + rest)
    }

    /// The names that a file has used or has defaults for.
    pub(super) fn known(&self) -> impl Iterator<Item = &str> + Clone {
        self.all.iter().filter(|variable| variable.known).map(|variable| variable.name.as_str())
    }

    /// The names from the command line that no file uses, in order.
    pub(super) fn unused(&self) -> Vec<String> {
        let unused = self.all.iter().filter(|variable| !variable.known);
        let mut names: Vec<_> = unused.map(|variable| variable.name.clone()).collect();
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
    fn the_last_value_of_the_command_line_counts_and_then_the_first_default() {
        let given = [("a", "1"), ("a", "2"), ("ab", "3")].map(|(n, v)| (n.to_owned(), v.to_owned()));
        let mut variables = Variables::given(&given);
        variables.fall_back("a", "4");
        variables.fall_back("é", "5");
        variables.fall_back("é", "6");
        assert_eq!(variables.put_into("$a $ab $é $abc"), Ok("2 3 5 3c".into()));
        assert_eq!(variables.unused(), [""; 0]);
    }

    /// Each search ends at the next dollar sign, so that together they read each byte once.
    #[test]
    fn a_long_name_makes_no_text_slow() {
        let mut variables = Variables::default();
        variables.fall_back("a", "");
        variables.fall_back(&"a".repeat(1 << 18), "long");
        // A search of all prefixes would hash 2⁵² bytes.
        let text = format!("{}{}", "$a".repeat(1 << 17), "a".repeat((1 << 18) - 1));
        assert_eq!(variables.put_into(&text), Ok("long".into()));
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
