//! WGSL expressions of operators, with the required parentheses.

use super::graph::Binary;

/// The outermost operator of an expression. WGSL requires parentheses in more cases than most languages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outermost {
    Primary,
    Unary,
    Multiplicative,
    Additive,
    Shift,
    Comparison,
    /// Operators that mix with no others: `&&`, `||`, `&`, `|` and `^`.
    Chain(&'static str),
}

/// An expression.
#[derive(Clone, Debug)]
pub(super) struct Text {
    pub(super) text: String,
    pub(super) outermost: Outermost,
    /// For a call: the text before the parenthesis, and the arguments.
    pub(super) list: Option<(String, Vec<String>)>,
}

impl Text {
    pub(super) fn new(text: String, outermost: Outermost) -> Text {
        Text { text, outermost, list: None }
    }
    /// A name, or a similarly simple expression.
    pub(super) fn name(text: impl Into<String>) -> Text {
        Text::new(text.into(), Outermost::Primary)
    }
    /// In parentheses unless they are unnecessary.
    pub(super) fn within(self, may: impl Fn(Outermost) -> bool) -> String {
        if may(self.outermost) { self.text } else { format!("({})", self.text) }
    }
    pub(super) fn into_primary(self) -> String {
        self.within(|outermost| outermost == Outermost::Primary)
    }
    /// The negation of a condition.
    pub(super) fn opposite(self) -> String {
        match self.text.strip_prefix('!') {
            Some(text) if self.outermost == Outermost::Unary => text.to_owned(),
            _ => format!("!{}", self.into_primary()),
        }
    }
}

pub(super) fn is_simple(outermost: Outermost) -> bool {
    matches!(outermost, Outermost::Primary | Outermost::Unary)
}
pub(super) fn is_factor(outermost: Outermost) -> bool {
    is_simple(outermost) || outermost == Outermost::Multiplicative
}
pub(super) fn is_term(outermost: Outermost) -> bool {
    is_factor(outermost) || outermost == Outermost::Additive
}

pub(super) fn float(value: f32) -> Text {
    let outermost = if value.is_sign_negative() { Outermost::Unary } else { Outermost::Primary };
    let text = match value {
        f32::MAX => "NOTHING".to_owned(),
        f32::MIN => "-NOTHING".to_owned(),
        _ => format!("{value:?}f"),
    };
    Text::new(text, outermost)
}

pub(super) fn uint(value: u32) -> Text {
    Text::name(if value < 100_000 { format!("{value}u") } else { format!("{value:#010x}u") })
}

pub(super) fn binary(op: Binary, is_mask: bool, a: Text, b: Text) -> Text {
    let (symbol, outermost) = match op {
        Binary::Multiply => ("*", Outermost::Multiplicative),
        Binary::Divide => ("/", Outermost::Multiplicative),
        Binary::Add => ("+", Outermost::Additive),
        Binary::Subtract => ("-", Outermost::Additive),
        Binary::ShiftLeft => ("<<", Outermost::Shift),
        Binary::ShiftRight => (">>", Outermost::Shift),
        Binary::Equal => ("==", Outermost::Comparison),
        Binary::Less => ("<", Outermost::Comparison),
        Binary::LessOrEqual => ("<=", Outermost::Comparison),
        Binary::Greater => (">", Outermost::Comparison),
        Binary::GreaterOrEqual => (">=", Outermost::Comparison),
        Binary::And if is_mask => ("&&", Outermost::Chain("&&")),
        Binary::Or if is_mask => ("||", Outermost::Chain("||")),
        Binary::And => ("&", Outermost::Chain("&")),
        Binary::Or => ("|", Outermost::Chain("|")),
        Binary::Xor => ("^", Outermost::Chain("^")),
    };
    let (a, b) = match outermost {
        Outermost::Multiplicative => (a.within(is_factor), b.within(is_simple)),
        Outermost::Additive => (a.within(is_term), b.within(is_factor)),
        // `a < b >> c` would be parsed as a template list.
        Outermost::Comparison => (a.within(is_term), b.within(is_term)),
        Outermost::Chain("&&" | "||") => {
            let is_condition = |of: Outermost| is_term(of) || of == Outermost::Comparison;
            (a.within(|of| is_condition(of) || of == outermost), b.within(is_condition))
        }
        Outermost::Chain(_) => (a.within(|of| is_simple(of) || of == outermost), b.within(is_simple)),
        _ => (a.within(is_simple), b.within(is_simple)),
    };
    Text::new(format!("{a} {symbol} {b}"), outermost)
}

pub(super) const LETTERS: [&str; 4] = ["x", "y", "z", "w"];
