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
    /// The index of a word in the list of its kind.
    Word(usize),
    /// A word along u and one along v.
    Words([usize; 2]),
    /// Yes or no.
    Flag(bool),
    /// No value: the parameter is optional and was not given.
    Absent,
    /// A number, a colour or a texture.
    Varying(Varying),
    /// The index of an image file.
    Image(ImageIndex),
}

/// The index of a word in the list of [`ParameterKind::Word`](super::ParameterKind::Word).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word(pub usize);

/// A value that may vary over a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Varying {
    /// A constant; a number is a grey.
    Colour(Colour),
    /// The index of a texture.
    Texture(usize),
}

/// The index of an image file among those of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageIndex(pub usize);

/// The value of a parameter that names a texture. The texture itself is stored beside the parameters, with those that
/// replace numbers and colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Named;

/// The type of a field that holds the value of a parameter.
pub trait Field: Copy {
    /// The value of the field.
    fn value(self) -> Value;

    /// Makes a field from a value.
    ///
    /// # Panics
    ///
    /// If the value has another type, which means that a declaration gives a field the wrong kind.
    fn of(value: Value) -> Self;

    /// Replaces the index of a material or texture by a new one.
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

impl Field for Named {
    fn value(self) -> Value {
        Value::Flag(true)
    }

    fn of(value: Value) -> Self {
        match value {
            Value::Flag(_) => Named,
            other => unreachable!("{other:?} for the name of a texture"),
        }
    }
}

/// For an optional parameter.
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

    fn renumber(&mut self, new: &dyn Fn(usize) -> usize) {
        if let Some(value) = self {
            value.renumber(new);
        }
    }
}
field!(
    Varying,
    Varying,
    fn renumber(&mut self, new: &dyn Fn(usize) -> usize) {
        if let Varying::Texture(index) = self {
            *index = new(*index);
        }
    }
);
field!(ImageIndex, Image);

/// Declares an enum whose members are words in scene files, and makes it a field type.
macro_rules! words {
    (
        $(#[$attribute:meta])*
        pub enum $type:ident { $($(#[$about:meta])* $member:ident = $word:literal,)* }
    ) => {
        $(#[$attribute])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $type { $($(#[$about])* $member,)* }

        impl $type {
            /// The words, in the order of the members.
            pub const WORDS: &'static [&'static str] = &[$($word),*];
            const ALL: &'static [Self] = &[$(Self::$member),*];

            /// The member at an index; the first one for an invalid index.
            fn of_place(place: usize) -> Self {
                Self::ALL.get(place).copied().unwrap_or(Self::ALL[0])
            }
        }

        impl $crate::parameter::Field for $type {
            fn value(self) -> $crate::parameter::Value {
                $crate::parameter::Value::Word(self as usize)
            }

            fn of(value: $crate::parameter::Value) -> Self {
                match value {
                    $crate::parameter::Value::Word(place) => Self::of_place(place),
                    other => unreachable!("{other:?} for a word"),
                }
            }
        }

        impl $crate::parameter::Field for [$type; 2] {
            fn value(self) -> $crate::parameter::Value {
                $crate::parameter::Value::Words(self.map(|word| word as usize))
            }

            fn of(value: $crate::parameter::Value) -> Self {
                match value {
                    $crate::parameter::Value::Words(places) => places.map($type::of_place),
                    other => unreachable!("{other:?} for two words"),
                }
            }
        }
    };
}
pub(crate) use words;
