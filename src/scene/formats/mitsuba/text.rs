//! Parsing of numbers in attributes.

/// The words of a list, separated by blanks, commas or semicolons.
pub(super) fn words(text: &str) -> impl Iterator<Item = &str> + Clone {
    text.split(|c: char| c.is_ascii_whitespace() || matches!(c, ',' | ';')).filter(|word| !word.is_empty())
}

/// A finite number.
pub(super) fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|number: &f64| number.is_finite())
}

/// The numbers of a list; none if a word is not a number.
pub(super) fn numbers(text: &str) -> Option<Vec<f64>> {
    words(text).map(number).collect()
}

/// Three numbers, or one that stands for all three.
pub(super) fn triple(text: &str) -> Option<[f64; 3]> {
    match numbers(text)?[..] {
        [x] => Some([x; 3]),
        [x, y, z] => Some([x, y, z]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_numbers_are_read() {
        assert_eq!(numbers(" 1, 2\t3;-4e1\n"), Some(vec![1.0, 2.0, 3.0, -40.0]));
        assert_eq!((numbers("1 nan"), numbers("1 x"), numbers("1e999")), (None, None, None));
        assert_eq!(
            (triple("2"), triple("1,2,3"), triple("1 2")),
            (Some([2.0; 3]), Some([1.0, 2.0, 3.0]), None)
        );
        assert_eq!((number(" 7 "), number(""), number("1 2")), (Some(7.0), None, None));
    }
}
