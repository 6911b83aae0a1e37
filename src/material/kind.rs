//! The list of materials, and the kinds generated from it.

/// The list of materials, each with its file, its program and its parameters: calls a macro with the list, after tokens
/// for that macro.
///
/// A program without parameters in the list is a variant of a material with another program: the parameters select it.
///
/// Leaves scatter light ([`super::Leaf`]); choosers delegate to another row ([`super::Chooser`]). Lobes of the first
/// leaf are computed in all lanes, those of the others only if a lane has one: the most frequent one comes first.
macro_rules! materials {
    ($then:ident $($tokens:tt)*) => {
        $then! {
            { $($tokens)* }
            leaves {
                matte::Matte(MatteParameters),
                mirror::Mirror(MirrorParameters),
                glass::Glass(GlassParameters),
                conductor::Conductor(ConductorParameters),
                conductor::SmoothConductor,
                dielectric::Dielectric(DielectricParameters),
                dielectric::ThinDielectric,
                dielectric::RoughThinDielectric,
                matte::RoughMatte,
                #[cfg(feature = "broken-material")]
                broken::Broken(BrokenParameters),
            }
            choosers {
                checkerboard::Checkerboard(CheckerboardParameters),
                mix::Mix(MixParameters),
            }
        }
    };
}
pub(super) use materials;

/// A set of kinds: those in a scene. Programs and lanes omit the code of others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Kinds(u32);

impl Kinds {
    /// The empty set.
    pub(super) const NONE: Kinds = Kinds(0);

    /// The set with one more kind.
    pub(super) const fn with(self, kind: Kind) -> Kinds {
        Kinds(self.0 | 1 << kind as u32)
    }

    /// Whether a kind is in it.
    #[inline(always)]
    pub(super) const fn has(self, kind: Kind) -> bool {
        self.0 >> kind as u32 & 1 != 0
    }

    /// Whether a kind of another set is in it.
    #[inline(always)]
    pub(super) const fn has_any(self, other: Kinds) -> bool {
        self.0 & other.0 != 0
    }
}

macro_rules! kinds {
    (
        {}
        leaves { $($(#[$leaf_cfg:meta])* $leaf_module:ident::$Leaf:ident $(($leaf_parameters:ident))?,)* }
        choosers { $($(#[$chooser_cfg:meta])* $chooser_module:ident::$Chooser:ident($chooser_parameters:ident),)* }
    ) => {
        /// The kinds of materials, by their programs. The GPU uses these numbers.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u32)]
        pub enum Kind {
            $(
                #[doc = concat!("[`super::", stringify!($Leaf), "`].")]
                $(#[$leaf_cfg])*
                $Leaf,
            )*
            $(
                #[doc = concat!("[`super::", stringify!($Chooser), "`].")]
                $(#[$chooser_cfg])*
                $Chooser,
            )*
        }

        impl Kinds {
            /// All kinds.
            pub const ALL: Kinds = {
                let mut all = Kinds(0);
                $(
                    $(#[$leaf_cfg])*
                    {
                        all = all.with(Kind::$Leaf);
                    }
                )*
                $(
                    $(#[$chooser_cfg])*
                    {
                        all = all.with(Kind::$Chooser);
                    }
                )*
                all
            };
        }

        impl Kind {
            /// Whether the material delegates to another row and has no lobes.
            pub fn is_chooser(self) -> bool {
                match self {
                    $($(#[$leaf_cfg])* Kind::$Leaf => false,)*
                    $($(#[$chooser_cfg])* Kind::$Chooser => true,)*
                }
            }
        }
    };
}
materials!(kinds);
