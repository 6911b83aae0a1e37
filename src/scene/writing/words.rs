//! Numbers, names and vectors.

use std::collections::HashSet;

/// The shortest decimal number that is read as the same value.
pub(super) fn number(value: f64) -> String {
    format!("{value:?}")
}

/// A list: `[1.0, 2.0]`.
pub(super) fn list(values: &[f64]) -> String {
    let values: Vec<_> = values.iter().map(|&value| number(value)).collect();
    format!("[{}]", values.join(", "))
}

/// A quoted string.
pub(super) fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => quoted += &format!("\\u{:04X}", u32::from(c)),
            c => quoted.push(c),
        }
    }
    quoted + "\""
}

/// The names, made unique and not empty.
pub(super) fn different<'n>(names: impl Iterator<Item = &'n str>) -> Vec<String> {
    let mut taken = HashSet::new();
    let mut all = Vec::new();
    for name in names {
        let name = if name.is_empty() { "unnamed" } else { name };
        let mut own = name.to_owned();
        let mut number = 1;
        while !taken.insert(own.clone()) {
            number += 1;
            own = format!("{name} ({number})");
        }
        all.push(own);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_names_are_as_toml_has_them() {
        let all = [1.0, -0.0, 0.1, 1e300, 1e-300, 1.0 / 3.0, 123456789012345680.0];
        for value in all {
            let text = format!("x = {}", number(value));
            let read = ::toml::from_str::<std::collections::HashMap<String, f64>>(&text).expect("TOML");
            assert_eq!(read["x"].to_bits(), value.to_bits(), "{text}");
        }
        let name = "a \"b\" \\ c\n\u{7f}é";
        let text = format!("x = {}", quoted(name));
        let read = ::toml::from_str::<std::collections::HashMap<String, String>>(&text).expect("TOML");
        assert_eq!(read["x"], name);
        assert_eq!(different(["a", "", "a", "a (2)"].into_iter()), ["a", "unnamed", "a (2)", "a (2) (2)"]);
    }
}
