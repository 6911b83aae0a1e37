//! Lines of PLY text, and the elements in them.

use super::header::Element;
use crate::scene::mesh::source::number_or_nan;

/// True if each element has a line: there are as many lines as elements or more, and each has at least the numbers of its
/// element. Lines without words do not count, and elements without properties take none.
///
/// Of the elements, `begun` are before the text.
///
/// Were the numbers read without regard to lines, some would be left over, unless there are no more on any line than its
/// element has.
pub(super) fn correspond(text: &[u8], elements: &[Element], mut begun: u64) -> bool {
    let mut lines = text.split(|byte| matches!(byte, b'\n' | b'\r')).map(<[u8]>::trim_ascii);
    for element in elements.iter().filter(|element| !element.properties.is_empty()) {
        let before = begun.min(element.count);
        begun -= before;
        for _ in before..element.count {
            let line = lines.find(|line| !line.is_empty());
            if !line.is_some_and(|line| holds(line, element)) {
                return false;
            }
        }
    }
    true
}

/// True if a line has at least the numbers of an element.
fn holds(line: &[u8], element: &Element) -> bool {
    let words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let mut numbers = words.map_while(number_or_nan::<f64>);
    element.properties.iter().all(|property| match (numbers.next(), property.length) {
        (None, _) => false,
        (Some(_), None) => true,
        // A number that is no length is an error when the element is read.
        (Some(length), Some(_)) => (0..length as u64).all(|_| numbers.next().is_some()),
    })
}
