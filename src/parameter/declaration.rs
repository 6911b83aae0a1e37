//! Declarations: one for each shape, texture, material and light, in its own file, and lists of them by family.

use super::kind::ParameterKind;
use super::value::{Value, Varying};

/// A parameter of a shape, a texture, a material or a light.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Its name in scene files.
    pub name: &'static str,
    /// Its description for users.
    pub about: &'static str,
    /// The type and the limits of its values.
    pub kind: ParameterKind,
    /// The meaning of its absence.
    pub absence: Absence,
    /// The value that is left out of a scene's fingerprint: the default of a parameter that was added when films
    /// without it already existed, which must remain resumable.
    pub uncounted: Option<Value>,
}

/// The meaning of the absence of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Absence {
    /// An error: the parameter is required.
    Wrong,
    /// This default value, in TOML.
    Means(&'static str),
    /// No value: the field is an [`Option`].
    Fine,
}

/// The names of a shape, a texture, a material or a light, and its parameters.
#[derive(Clone, Copy, Debug)]
pub struct Declaration {
    /// Its name in scene files: "sphere".
    pub name: &'static str,
    /// With an article: "a sphere".
    pub what: &'static str,
    /// Its description for users.
    pub about: &'static str,
    /// The singular and the plural of its name in counts.
    pub counted: [&'static str; 2],
    /// Whether lists and the JSON Schema leave it out.
    pub is_hidden: bool,
    /// Its parameters.
    pub parameters: &'static [Parameter],
    /// JSON Schema keywords for constraints between several parameters, as a JSON object.
    pub rules: &'static str,
}

/// An error or a warning about the values of several parameters together.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// The name of the invalid parameter.
    pub parameter: &'static str,
    /// The message.
    pub message: String,
    /// A remedy.
    pub help: Option<String>,
}

/// The parameters of a shape, a texture, a material or a light. Implemented by `parameters!`.
pub trait Declared: Sized {
    /// Its names and parameters.
    const DECLARATION: Declaration;

    /// Makes the parameters from values in the order of the declaration.
    ///
    /// # Panics
    ///
    /// If there are more or fewer values than parameters, or of other types.
    fn of(values: &[Value]) -> Self;

    /// The values, in the order of the declaration.
    fn values(&self) -> Vec<Value>;

    /// Returns the parameters if their values are valid in combination. Adds warnings about unusual ones to `warnings`.
    ///
    /// A reader checks the values that it could read even if others are missing: any value may be
    /// [unknown](super::ParameterKind::unknown), which is NaN for numbers and `usize::MAX` for materials. A check must
    /// report only errors that hold for all values of the unknown ones. Comparisons with NaN are false, except for
    /// `!=`: write
    /// `x.abs() > 0.0`, not `x != 0.0`.
    fn check(self, warnings: &mut Vec<Problem>) -> Result<Self, Problem>;

    /// Replaces the indices of materials or textures by new ones.
    fn renumber(&mut self, new: &dyn Fn(usize) -> usize);
}

/// All shapes, all textures, all materials, or all lights. Implemented by `family!`.
pub trait Family: Sized + 'static {
    /// The declarations, in the order of lists.
    const DECLARATIONS: &'static [Declaration];

    /// Makes the member with the declaration at this index, from values.
    ///
    /// # Panics
    ///
    /// If the index is out of range, and as [`Declared::of`].
    fn build(place: usize, values: &[Value], warnings: &mut Vec<Problem>) -> Result<Self, Problem>;

    /// The index of its declaration; `None` for a member without one, such as a mesh.
    fn place(&self) -> Option<usize>;

    /// Its declaration; `None` for a member without one.
    fn declaration(&self) -> Option<&'static Declaration> {
        self.place().map(|place| &Self::DECLARATIONS[place])
    }

    /// The values of its parameters, in the order of the declaration.
    fn values(&self) -> Vec<Value>;

    /// The indices of the materials that it names.
    fn materials(&self) -> impl Iterator<Item = usize> {
        self.values().into_iter().filter_map(|value| match value {
            Value::Material(index) => Some(index),
            _ => None,
        })
    }

    /// The indices of the textures that it names.
    fn textures(&self) -> impl Iterator<Item = usize> {
        self.values().into_iter().filter_map(|value| match value {
            Value::Varying(Varying::Texture(index)) => Some(index),
            _ => None,
        })
    }

    /// Replaces the indices of materials or textures by new ones.
    fn renumber(&mut self, new: &dyn Fn(usize) -> usize);
}

/// Declares the parameters of a shape, a texture, a material or a light: a struct with a field for each, and its
/// [`Declared`].
///
/// The documentation of the struct and of its fields becomes the descriptions in the JSON Schema. After a field's type
/// comes the [`ParameterKind`] of its values and, if the parameter is optional, its default in TOML, or `nothing` for a
/// field that is an [`Option`]. A parameter that is added later must repeat that value as `uncounted`, or films of
/// scenes without it could not be resumed:
///
/// ```text
/// parameters! {
///     /// A dielectric interface.
///     pub struct GlassParameters: "glass", "a glass" {
///         /// Tint of what is reflected.
///         reflectance: Colour = FRACTION => "[1, 1, 1]",
///     }
///     check = tint_is_possible;
/// }
/// ```
///
/// After the names may come their singular and plural for `stride info`, which default to the name and the name with an
/// s. The items after the fields are optional: `check`, a function as [`Declared::check`], `rules`, JSON Schema
/// keywords, and `hidden = true`.
macro_rules! parameters {
    (
        $(#[doc = $summary:literal])+
        pub struct $type:ident: $name:literal, $what:literal $(, $one:literal, $several:literal)? {
            $(
                $(#[doc = $about:literal])+
                $field:ident: $of:ty = $kind:expr $(=> $default:tt $(uncounted $uncounted:expr)?)?,
            )*
        }
        $(check = $check:path;)?
        $(rules = $rules:literal;)?
        $(hidden = $hidden:literal;)?
    ) => {
        $(#[doc = $summary])+
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $type {
            $(
                $(#[doc = $about])+
                pub $field: $of,
            )*
        }

        impl $crate::parameter::Declared for $type {
            const DECLARATION: $crate::parameter::Declaration = $crate::parameter::Declaration {
                name: $name,
                what: $what,
                about: concat!($($summary),+).trim_ascii_start(),
                counted: $crate::parameter::parameters!(@counted $name $(, $one, $several)?),
                is_hidden: false $(|| $hidden)?,
                parameters: &[$(
                    $crate::parameter::Parameter {
                        name: stringify!($field),
                        about: concat!($($about),+).trim_ascii_start(),
                        kind: $kind,
                        absence: $crate::parameter::parameters!(@absence $($default)?),
                        uncounted: $crate::parameter::parameters!(@uncounted $($($uncounted)?)?),
                    },
                )*],
                rules: $crate::parameter::parameters!(@rules $($rules)?),
            };

            fn of(values: &[$crate::parameter::Value]) -> Self {
                match *values {
                    [$($field),*] => Self { $($field: $crate::parameter::Field::of($field)),* },
                    _ => unreachable!("{} values for {}", values.len(), $what),
                }
            }

            fn values(&self) -> Vec<$crate::parameter::Value> {
                let Self { $($field),* } = *self;
                vec![$($crate::parameter::Field::value($field)),*]
            }

            fn check(self, warnings: &mut Vec<$crate::parameter::Problem>) -> Result<Self, $crate::parameter::Problem> {
                $crate::parameter::parameters!(@check self, warnings $(, $check)?)
            }

            fn renumber(&mut self, new: &dyn Fn(usize) -> usize) {
                let Self { $($field),* } = self;
                let _ = new;
                $($crate::parameter::Field::renumber($field, new);)*
            }
        }
    };
    (@counted $name:literal) => { [$name, concat!($name, "s")] };
    (@counted $name:literal, $one:literal, $several:literal) => { [$one, $several] };
    (@absence) => { $crate::parameter::Absence::Wrong };
    (@absence nothing) => { $crate::parameter::Absence::Fine };
    (@absence $default:literal) => { $crate::parameter::Absence::Means($default) };
    (@uncounted) => { None };
    (@uncounted $value:expr) => { Some($value) };
    (@rules) => { "{}" };
    (@rules $rules:literal) => { $rules };
    (@check $parameters:expr, $warnings:ident) => {{
        let _ = $warnings;
        Ok($parameters)
    }};
    (@check $parameters:expr, $warnings:ident, $check:path) => { $check($parameters, $warnings) };
}
pub(crate) use parameters;

/// Defines a family: an enum with a member for each declaration, whose module is a sibling of the list's, and its
/// [`Family`]. Members without a declaration follow after a semicolon, as in an enum. After the enum comes the
/// function that compiles the parameters of a member, all by the same expression, and `else` its result for members
/// without a declaration. Other crates, including the tests, must allow for new members.
macro_rules! family {
    (
        $(#[$attribute:meta])*
        pub enum $family:ident {
            $(
                $(#[cfg($condition:meta)])?
                $member:ident($module:ident::$parameters:ident),
            )*
            $(; $($undeclared:tt)*)?
        }

        $(#[$compiled_attribute:meta])*
        $visibility:vis fn $compile:ident(&self $(, $argument:ident: $of:ty)*) -> $compiled:ty = $declared:ident => $how:expr $(, else $otherwise:expr)?;
    ) => {
        $(
            $(#[cfg($condition)])?
            pub use super::$module::$parameters;
        )*

        $(#[$attribute])*
        #[derive(Clone, Debug, PartialEq)]
        #[non_exhaustive]
        pub enum $family {
            $(
                $(#[cfg($condition)])?
                #[doc = concat!("With [parameters](", stringify!($parameters), ").")]
                $member($parameters),
            )*
            $($($undeclared)*)?
        }

        impl $family {
            $(#[$compiled_attribute])*
            $visibility fn $compile(&self $(, $argument: $of)*) -> $compiled {
                match self {
                    $(
                        $(#[cfg($condition)])?
                        Self::$member($declared) => $how,
                    )*
                    $(_ => $otherwise,)?
                }
            }
        }

        impl $crate::parameter::Family for $family {
            const DECLARATIONS: &'static [$crate::parameter::Declaration] = &[$(
                $(#[cfg($condition)])?
                <$parameters as $crate::parameter::Declared>::DECLARATION,
            )*];

            fn build(
                place: usize,
                values: &[$crate::parameter::Value],
                warnings: &mut Vec<$crate::parameter::Problem>,
            ) -> Result<Self, $crate::parameter::Problem> {
                type Build = fn(
                    &[$crate::parameter::Value],
                    &mut Vec<$crate::parameter::Problem>,
                ) -> Result<$family, $crate::parameter::Problem>;
                const BUILDS: &[Build] = &[$(
                    $(#[cfg($condition)])?
                    |values, warnings| {
                        let parameters = <$parameters as $crate::parameter::Declared>::of(values);
                        $crate::parameter::Declared::check(parameters, warnings).map($family::$member)
                    },
                )*];
                BUILDS[place](values, warnings)
            }

            #[allow(unreachable_patterns, reason = "some families have no members that are not declared")]
            fn place(&self) -> Option<usize> {
                enum Place {
                    $(
                        $(#[cfg($condition)])?
                        $member,
                    )*
                }
                match self {
                    $(
                        $(#[cfg($condition)])?
                        Self::$member(_) => Some(Place::$member as usize),
                    )*
                    _ => None,
                }
            }

            #[allow(unreachable_patterns, reason = "some families have no members that are not declared")]
            fn values(&self) -> Vec<$crate::parameter::Value> {
                match self {
                    $(
                        $(#[cfg($condition)])?
                        Self::$member(parameters) => $crate::parameter::Declared::values(parameters),
                    )*
                    _ => Vec::new(),
                }
            }

            #[allow(unreachable_patterns, reason = "some families have no members that are not declared")]
            fn renumber(&mut self, new: &dyn Fn(usize) -> usize) {
                match self {
                    $(
                        $(#[cfg($condition)])?
                        Self::$member(parameters) => $crate::parameter::Declared::renumber(parameters, new),
                    )*
                    _ => {}
                }
            }
        }

        $(
            $(#[cfg($condition)])?
            impl From<$parameters> for $family {
                fn from(parameters: $parameters) -> Self {
                    Self::$member(parameters)
                }
            }
        )*
    };
}
pub(crate) use family;
