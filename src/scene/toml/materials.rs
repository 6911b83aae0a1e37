//! The keys of materials, and what is made of them: names become indices, checkerboards come after the materials that
//! they name, and none contains itself.

use super::limits::{LONGEST, SHORTEST};
use super::report::{Placed, Read, Reported, Reports};
use super::table::{At, Fields, Key, Named, OneOf, Table, Variant};
use super::value::{self, Number, Pair, Word};
use crate::scene::description::limits::MAX_NESTING;
use crate::scene::description::{Colour, Material, MaterialKind};
use crate::scene::names::{self, Disorder, Names};
use crate::scene::spelling::quote;

/// A material as the file has it: other materials are names.
pub(super) enum Raw {
    Matte {
        reflectance: Colour,
    },
    Mirror {
        reflectance: Colour,
    },
    Glass {
        ior: f64,
        reflectance: Colour,
        transmittance: Colour,
    },
    /// Its parts are kept apart, so that a wrong number does not hide a wrong name.
    Checkerboard {
        even: Result<Placed<String>, Reported>,
        odd: Result<Placed<String>, Reported>,
        checks_per_unit: Result<[f64; 2], Reported>,
    },
    #[cfg(feature = "broken-material")]
    Broken,
}

const FRACTION: value::Colour = value::Colour(Number::between(0.0, 1.0));
const REFRACTION: Number = Number::positive(1e-3, 1e3);

// On planes their size is a length.
const CHECKS: Number = Number::positive(SHORTEST, LONGEST);
pub(super) const MATERIAL: OneOf<Raw> = OneOf {
    what: "material",
    variants: &[
        Variant::new("matte", &MATTE_TABLE, matte),
        Variant::new("mirror", &MIRROR_TABLE, mirror),
        Variant::new("glass", &GLASS_TABLE, glass),
        Variant::new("checkerboard", &CHECKERBOARD_TABLE, checkerboard),
        #[cfg(feature = "broken-material")]
        Variant { tag: "broken", table: &BROKEN_TABLE, build: broken, hidden: true },
    ],
};

static MATTE_TABLE: Table = Table::new("a matte material", &[&REFLECTANCE]);
static MIRROR_TABLE: Table = Table::new("a mirror", &[&REFLECTANCE]);
static GLASS_TABLE: Table = Table::new("a glass", &[&IOR, &GLASS_REFLECTANCE, &TRANSMITTANCE]);
static CHECKERBOARD_TABLE: Table = Table::new("a checkerboard", &[&EVEN, &ODD, &CHECKS_PER_UNIT]);

#[cfg(feature = "broken-material")]
static BROKEN_TABLE: Table = Table::new("a broken material", &[]);

static REFLECTANCE: Key<value::Colour> = Key::required(
    "reflectance",
    FRACTION,
    "The fraction of light that is reflected: red, green, blue, each 0 to 1.",
);
static IOR: Key<Number> = Key::required(
    "ior",
    REFRACTION,
    "Index of refraction of the inside over the outside: 1.5 for glass in air, 1.33 for water.",
);
static GLASS_REFLECTANCE: Key<value::Colour> =
    Key::default("reflectance", FRACTION, "[1, 1, 1]", "Tint of what is reflected.");
static TRANSMITTANCE: Key<value::Colour> =
    Key::default("transmittance", FRACTION, "[1, 1, 1]", "Tint of what is transmitted.");
static EVEN: Key<At<Word>> = Key::required(
    "even",
    At(Word),
    "The name of the material where the numbers of the check along u and along v have an even sum.",
);
static ODD: Key<At<Word>> = Key::required("odd", At(Word), "The name of the material elsewhere.");
static CHECKS_PER_UNIT: Key<Pair> = Key::default(
    "checks_per_unit",
    Pair(CHECKS),
    "1",
    "Checks for each unit of uv: one number, or one along u and one along v. A plane's uv are lengths in it.",
);

fn matte(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Raw> {
    Ok(Raw::Matte { reflectance: fields.get(&REFLECTANCE, reports)? })
}

fn mirror(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Raw> {
    Ok(Raw::Mirror { reflectance: fields.get(&REFLECTANCE, reports)? })
}

fn glass(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Raw> {
    let ior = fields.get(&IOR, reports);
    let reflectance = fields.get(&GLASS_REFLECTANCE, reports);
    let transmittance = fields.get(&TRANSMITTANCE, reports);
    Ok(Raw::Glass { ior: ior?, reflectance: reflectance?, transmittance: transmittance? })
}

fn checkerboard(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Raw> {
    let even = fields.get(&EVEN, reports);
    let odd = fields.get(&ODD, reports);
    let checks_per_unit = fields.get(&CHECKS_PER_UNIT, reports);
    Ok(Raw::Checkerboard { even, odd, checks_per_unit })
}

#[cfg(feature = "broken-material")]
fn broken(_: &Fields<'_, '_>, _: &mut Reports<'_>) -> Read<Raw> {
    Ok(Raw::Broken)
}

/// The file's materials, in its order.
pub(super) type RawMaterials = [Named<Result<Raw, Reported>>];

/// The names of the file's materials, in its order.
pub(super) fn names(materials: &RawMaterials) -> Names<'_> {
    Names::new(materials.iter().map(|material| material.name.as_str()))
}

/// The index, in the order of the file, of the material that the file names.
pub(super) fn find(
    name: &Placed<String>,
    names: &Names<'_>,
    reports: &mut Reports<'_>,
) -> Result<usize, Reported> {
    names.find(&name.value).ok_or_else(|| {
        reports.error_with(name.at, format!("no material {}", quote(&name.value)), |_| {
            let none = || "this file has no [materials.NAME]".into();
            Some(names.instead(&name.value).unwrap_or_else(none))
        })
    })
}

/// Materials in their final order.
pub(super) struct Resolved {
    pub(super) materials: Vec<Material>,
    /// The final index of each material in the order of the file.
    pub(super) index_of: Vec<usize>,
}

/// Puts materials in order and resolves their names.
pub(super) fn resolve(
    raw: &RawMaterials,
    names: &Names<'_>,
    reports: &mut Reports<'_>,
) -> Result<Resolved, Reported> {
    let mut edges = vec![Vec::new(); raw.len()];
    let kinds: Vec<_> =
        raw.iter().zip(&mut edges).map(|(material, edges)| link(material, edges, names, reports)).collect();
    let order = order(raw, &edges, names, reports)?;

    let mut index_of = vec![0; raw.len()];
    for (index, &i) in order.iter().enumerate() {
        index_of[i] = index;
    }
    let materials: Result<_, _> = order
        .into_iter()
        .map(|i| {
            let mut kind = kinds[i].clone()?;
            if let MaterialKind::Checkerboard { even, odd, .. } = &mut kind {
                (*even, *odd) = (index_of[*even], index_of[*odd]);
            }
            Ok(Material { name: raw[i].name.clone(), kind })
        })
        .collect();
    Ok(Resolved { materials: materials?, index_of })
}

/// Resolves a material's names to indices in the order of the file, and lists them as `edges`.
fn link(
    material: &Named<Result<Raw, Reported>>,
    edges: &mut Vec<Placed<usize>>,
    names: &Names<'_>,
    reports: &mut Reports<'_>,
) -> Result<MaterialKind, Reported> {
    Ok(match material.value.as_ref().map_err(|reported| *reported)? {
        &Raw::Matte { reflectance } => MaterialKind::Matte { reflectance },
        &Raw::Mirror { reflectance } => MaterialKind::Mirror { reflectance },
        &Raw::Glass { ior, reflectance, transmittance } => {
            MaterialKind::Glass { ior, reflectance, transmittance }
        }
        Raw::Checkerboard { even, odd, checks_per_unit } => {
            let [even, odd] = [even, odd].map(|part| {
                let name = part.as_ref().map_err(|reported| *reported)?;
                let index = find(name, names, reports)?;
                edges.push(Placed { at: name.at, value: index });
                Ok(index)
            });
            MaterialKind::Checkerboard { even: even?, odd: odd?, checks_per_unit: (*checks_per_unit)? }
        }
        #[cfg(feature = "broken-material")]
        Raw::Broken => MaterialKind::Broken,
    })
}

/// The materials in an order in which everything comes after what it names.
fn order(
    raw: &RawMaterials,
    edges: &[Vec<Placed<usize>>],
    names: &Names<'_>,
    reports: &mut Reports<'_>,
) -> Result<Vec<usize>, Reported> {
    let named: Vec<Vec<usize>> =
        edges.iter().map(|edges| edges.iter().map(|edge| edge.value).collect()).collect();
    names::order(&named, |disorder| match disorder {
        Disorder::Circle { nodes, last, edge } => {
            let message = format!("checkerboard contains itself: {}", names.circle(&nodes));
            reports.error(edges[last][edge].at, message)
        }
        Disorder::TooDeep(node) => {
            let name = quote(&raw[node].name);
            let message = format!("checkerboard {name} is nested more than {MAX_NESTING} deep");
            reports.error(raw[node].at, message)
        }
    })
}

/// Warns of materials that no entity shows.
pub(super) fn warn_of_unused(
    raw: &RawMaterials,
    resolved: &Resolved,
    mut used: Vec<bool>,
    reports: &mut Reports<'_>,
) {
    // What a material names comes before it, so going backwards meets every user first.
    for (i, material) in resolved.materials.iter().enumerate().rev() {
        if let (true, &MaterialKind::Checkerboard { even, odd, .. }) = (used[i], &material.kind) {
            used[even] = true;
            used[odd] = true;
        }
    }
    for (material, &index) in raw.iter().zip(&resolved.index_of) {
        if !used[index] {
            let message = format!("material {} is not used", quote(&material.name));
            reports.warn(Some(material.at), message, "no entity shows it");
        }
    }
}
