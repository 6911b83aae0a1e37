//! Materials as a scene describes them, from the list in `kind.rs`.

use super::kind::materials;
use super::program::MaterialParameters;
use super::row::Row;
use crate::parameter::family;

/// Selects the programs that have parameters, one after the other, then lists these.
macro_rules! described {
    ({} leaves { $($leaves:tt)* } choosers { $($choosers:tt)* }) => {
        described! { {} $($leaves)* $($choosers)* }
    };
    (
        { $($described:tt)* }
        $(#[cfg($cfg:meta)])? $module:ident::$Program:ident($parameters:ident), $($rest:tt)*
    ) => {
        described! { { $($described)* $(#[cfg($cfg)])? $Program($module::$parameters), } $($rest)* }
    };
    ({ $($described:tt)* } $(#[cfg($cfg:meta)])? $module:ident::$Program:ident, $($rest:tt)*) => {
        described! { { $($described)* } $($rest)* }
    };
    ({ $($described:tt)* }) => {
        family! {
            /// A material, as a scene describes it.
            pub enum MaterialKind {
                $($described)*
            }

            /// The row with the parameters of the material's program.
            pub fn row(&self) -> Row = material => material.row();
        }
    };
}
materials!(described);
