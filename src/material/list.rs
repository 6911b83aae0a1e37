//! Materials as a scene describes them, by the list of `kind.rs`.

use super::kind::materials;
use super::program::MaterialParameters;
use super::row::Row;
use crate::parameter::family;

macro_rules! described {
    (
        {}
        leaves { $($(#[cfg($leaf_cfg:meta)])? $leaf_module:ident::$Leaf:ident($leaf_parameters:ident),)* }
        choosers {
            $($(#[cfg($chooser_cfg:meta)])? $chooser_module:ident::$Chooser:ident($chooser_parameters:ident),)*
        }
    ) => {
        family! {
            /// What a material does with light, as a scene describes it.
            pub enum MaterialKind {
                $($(#[cfg($leaf_cfg)])? $Leaf($leaf_module::$leaf_parameters),)*
                $($(#[cfg($chooser_cfg)])? $Chooser($chooser_module::$chooser_parameters),)*
            }

            /// The row in which the material's program finds its parameters.
            pub fn row(&self) -> Row = material => material.row();
        }
    };
}
materials!(described);
