//! The values of parameters.

use glam::DVec3;

/// A linear Rec. 709 colour or radiance.
pub type Colour = [f64; 3];

/// The value of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A number along u and one along v.
    Pair([f64; 2]),
    /// A colour.
    Colour(Colour),
    /// A point, a displacement or a direction.
    Vector(DVec3),
    /// The index of a material.
    Material(usize),
    /// The place of a word in the list of its kind.
    Word(usize),
    /// Yes or no.
    Flag(bool),
    /// Nothing was given for a parameter that may be absent.
    Absent,
}

/// The place of a word in the list of [`ParameterKind::Word`](super::ParameterKind::Word).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word(pub usize);

/// The type of a field that holds the value of a parameter.
pub trait Field: Copy {
    /// The value in the field.
    fn value(self) -> Value;

    /// The field that holds a value.
    ///
    /// # Panics
    ///
    /// If the value is of another type, which means that a declaration gives a field a kind that its type does not fit.
    fn of(value: Value) -> Self;

    /// Gives the material in the field, if it is one, its new index.
    fn renumber(&mut self, _new: &dyn Fn(usize) -> usize) {}
}

macro_rules! field {
    ($type:ty, $variant:ident $(, $renumber:item)?) => {
        impl Field for $type {
            fn value(self) -> Value {
                Value::$variant(self)
            }

            fn of(value: Value) -> Self {
                match value {
                    Value::$variant(value) => value,
                    other => unreachable!("{other:?} for a {}", stringify!($variant)),
                }
            }

            $($renumber)?
        }
    };
}

field!(f64, Number);
field!([f64; 2], Pair);
field!(Colour, Colour);
field!(DVec3, Vector);
field!(bool, Flag);
field!(
    usize,
    Material,
    fn renumber(&mut self, new: &dyn Fn(usize) -> usize) {
        *self = new(*self);
    }
);

impl Field for Word {
    fn value(self) -> Value {
        Value::Word(self.0)
    }

    fn of(value: Value) -> Self {
        match value {
            Value::Word(place) => Word(place),
            other => unreachable!("{other:?} for a word"),
        }
    }
}

/// Of a parameter that may be absent.
impl<T: Field> Field for Option<T> {
    fn value(self) -> Value {
        self.map_or(Value::Absent, Field::value)
    }

    fn of(value: Value) -> Self {
        match value {
            Value::Absent => None,
            given => Some(T::of(given)),
        }
    }
}
