//! Lines of PLY text, and the elements in them.

use super::header::Element;
use crate::scene::mesh::source::number_or_nan;

/// Whether each element has a line of its own: there are at least as many lines as elements, and each has at least the
/// numbers of its element. Lines without words are ignored, and elements without properties take none.
///
/// `begun` elements precede the text.
///
/// Otherwise, reading numbers without regard to lines would leave some over, unless no line has more numbers than its
/// element.
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

/// Whether a line has at least the numbers of an element.
fn holds(line: &[u8], element: &Element) -> bool {
    let words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let mut numbers = words.map_while(number_or_nan::<f64>);
    element.properties.iter().all(|property| match (numbers.next(), property.length) {
        (None, _) => false,
        (Some(_), None) => true,
        // An invalid length is an error when the element is read.
        (Some(length), Some(_)) => (0..length as u64).all(|_| numbers.next().is_some()),
    })
}
