use super::super::tables::{LightColumns, SurfaceColumns, light_rows, material_rows, surface_rows};
use super::*;
use crate::light::{AreaLight, LightTable, NO_LIGHT, PointLight};
use crate::material::{
    CheckerboardParameters, GlassParameters, MaterialParameters, MaterialTable, MatteParameters,
};
use crate::shape::{Disk, Plane, Shape, Sphere};
use crate::world::{SurfaceAttributes, SurfaceTable};
use glam::DVec3;

/// A number of a column in a row: name, type and bits.
type Read = (String, String, Vec<u32>);

/// Reads a row as the WGSL does: the structure's fields take, in order, the values that the reader passes.
fn read(text: &str, heap: &[HeapWord], row: usize) -> Vec<Read> {
    let between = |from: &str, to: &str| {
        let rest = text.split_once(from).unwrap_or_else(|| panic!("there is no {from:?} in {text}")).1;
        rest.split_once(to).unwrap_or_else(|| panic!("there is no {to:?} in {rest}")).0
    };
    let stride: usize = between("row * ", "u;").parse().unwrap();
    let words: Vec<HeapWord> = between("u;\n", "    return")
        .lines()
        .map(|line| {
            let word = line.split_once("heap_word(at + ").unwrap().1.trim_end_matches("u);");
            heap[row * stride + word.parse::<usize>().unwrap()]
        })
        .collect();
    let values = between("return ", ");\n").split_once('(').unwrap().1.split(", ");
    let fields = between("{\n", "}\n").lines();
    assert_eq!(fields.clone().count(), values.clone().count(), "{text}");
    fields
        .zip(values)
        .map(|(field, value)| {
            let (name, ty) = field.trim().trim_end_matches(',').split_once(": ").unwrap();
            let value = value.strip_prefix(&format!("bitcast<{ty}>(w")).unwrap().trim_end_matches(')');
            let (word, letters) = value.split_once('.').unwrap();
            let word = words[word.parse::<usize>().unwrap()];
            let numbers = letters.chars().map(|letter| word["xyzw".find(letter).unwrap()]).collect();
            (name.to_owned(), ty.to_owned(), numbers)
        })
        .collect()
}

/// The values of a row according to the columns.
fn expected(rows: &Rows<'_>, row: usize) -> Vec<Read> {
    let column = |(name, values): &(&str, Values<'_>)| {
        let numbers = (0..values.width()).map(|i| values.bits(row, i)).collect();
        ((*name).to_owned(), values.wgsl_type().to_owned(), numbers)
    };
    rows.columns.iter().map(column).collect()
}

fn text(rows: &Rows<'_>) -> String {
    rows.text("Row", "row_at", "rows_from")
}

fn is_read_back(rows: &Rows<'_>, heap: &[HeapWord], text: &str) -> bool {
    let count = rows.columns[0].1.len();
    assert!(count > 0);
    (0..count).all(|row| read(text, heap, row) == expected(rows, row))
}

/// Two rows in which all numbers are different.
struct Table {
    weights: [Vec<f32>; 3],
    first: Vec<f32>,
    links: Vec<u32>,
    second: Vec<f32>,
    axes: [Vec<f32>; 3],
    third: Vec<f32>,
}

impl Table {
    fn new() -> Table {
        Table {
            weights: [vec![1.0, 2.0], vec![3.0, 4.0], vec![5.0, 6.0]],
            first: vec![7.0, 8.0],
            links: vec![9, u32::MAX],
            second: vec![f32::NAN, -0.0],
            axes: [vec![10.0, 11.0], vec![12.0, 13.0], vec![14.0, 15.0]],
            third: vec![16.0, 17.0],
        }
    }

    fn rows(&self) -> Rows<'_> {
        let mut rows = Rows::default();
        rows.floats("first", &self.first);
        rows.vectors("weight", &self.weights);
        rows.words("link", &self.links);
        rows.floats("second", &self.second);
        rows.vectors("axis", &self.axes);
        rows.floats("third", &self.third);
        rows
    }
}

#[test]
fn single_numbers_fill_words_behind_vectors() {
    let at = |word, first| FieldOffset { word, first };
    assert_eq!(pack(&[]), (vec![], 0));
    assert_eq!(pack(&[1, 3]), (vec![at(0, 3), at(0, 0)], 1));
    assert_eq!(pack(&[3, 3, 1]), (vec![at(0, 0), at(1, 0), at(0, 3)], 2));
    assert_eq!(pack(&[1, 1, 1, 1, 1]), (vec![at(0, 0), at(0, 1), at(0, 2), at(0, 3), at(1, 0)], 2));
    for widths in
        (0..256).map(|bits: u32| (0..8).map(|i| 1 + 2 * (bits as usize >> i & 1)).collect::<Vec<_>>())
    {
        let (places, words) = pack(&widths);
        let mut taken = vec![[false; NUMBERS]; words];
        for (place, width) in places.iter().zip(&widths) {
            for number in &mut taken[place.word][place.first..place.first + width] {
                assert!(!std::mem::replace(number, true), "{widths:?}: two fields share a place");
            }
        }
        let vectors = widths.iter().filter(|&&width| width == 3).count();
        assert_eq!(words, vectors.max(widths.iter().sum::<usize>().div_ceil(NUMBERS)), "{widths:?}");
    }
}

#[test]
fn the_wgsl_reads_the_values_of_the_columns() {
    let table = Table::new();
    let rows = table.rows();
    let heap = rows.packed();
    assert_eq!(heap.len(), 2 * 3, "two vectors and four single numbers take three words");
    assert!(is_read_back(&rows, &heap, &text(&rows)));
}

#[test]
fn a_wrong_layout_is_noticed() {
    let table = Table::new();
    let rows = table.rows();
    let (heap, right) = (rows.packed(), text(&rows));
    for (from, to) in [
        ("w0.xyz", "w1.xyz"),
        ("w0.w", "w1.w"),
        ("row * 3u", "row * 2u"),
        ("heap_word(at + 1u)", "heap_word(at + 0u)"),
        ("    first: f32,\n", "    last: f32,\n"),
        ("    weight: vec3f,\n    link: u32,", "    link: u32,\n    weight: vec3f,"),
    ] {
        let wrong = right.replacen(from, to, 1);
        assert!(wrong != right, "{from:?} is not in {right}");
        let seen = std::panic::catch_unwind(|| is_read_back(&table.rows(), &heap, &wrong));
        assert!(!seen.is_ok_and(|is_same| is_same), "{to:?} went unnoticed");
    }
    // Rows that were packed from the same columns in another order.
    let mut others = table.rows();
    others.columns.swap(0, 2);
    assert!(!is_read_back(&rows, &others.packed(), &right));
}

#[test]
fn columns_of_different_length_are_rejected() {
    let table = Table { third: vec![0.0], ..Table::new() };
    assert!(std::panic::catch_unwind(|| table.rows().packed()).is_err());
    let table = Table { axes: [vec![0.0; 2], vec![0.0; 2], vec![0.0; 1]], ..Table::new() };
    assert!(std::panic::catch_unwind(|| table.rows().packed()).is_err());
}

#[test]
fn materials_are_read_back_and_need_no_row_for_their_wgsl() {
    let table = MaterialTable::new(vec![
        MatteParameters { reflectance: [0.1, 0.2, 0.3], roughness: 0.0 }.row(),
        GlassParameters { ior: 1.5, reflectance: [0.9, 0.8, 0.7], transmittance: [0.4, 0.5, 0.6] }.row(),
        CheckerboardParameters { even: 0, odd: 1, checks_per_unit: [2.0, 3.0] }.row(),
    ]);
    let rows = material_rows(&table);
    let (heap, text) = (rows.packed(), text(&rows));
    assert!(is_read_back(&rows, &heap, &text));
    // The kind follows the colour.
    let (kind, words) = rows.place("kind").unwrap();
    assert_eq!((kind, heap.len()), (FieldOffset { word: 0, first: 3 }, 3 * words));
    let numbers: Vec<_> = table.rows().iter().map(|row| row.kind as u32).collect();
    assert_eq!(heap.chunks(words).map(|row| row[0][3]).collect::<Vec<_>>(), numbers);

    let nothing = MaterialTable::default();
    assert_eq!(super::tests::text(&material_rows(&nothing)), text);
    assert_eq!(material_rows(&nothing).packed(), Vec::<HeapWord>::new());
}

#[test]
fn surfaces_are_read_back_in_another_order() {
    let mut table = SurfaceTable::default();
    let attributes = SurfaceAttributes {
        material: 7,
        emission: [2.0, 3.0, 4.0],
        emission_texture: 6,
        flip_normal: true,
        entity: 0,
        light: 5,
    };
    table.push(Plane { normal: [0.0, 0.6, 0.8], distance: 9.0 }.surface(), attributes);
    table.push(
        Sphere::new(DVec3::new(7.0, 8.0, 9.0), 0.5).surface(),
        SurfaceAttributes { light: 6, ..attributes },
    );
    table.push(
        Disk::new(DVec3::X, DVec3::Y, 2.0).surface(),
        SurfaceAttributes { light: NO_LIGHT, ..attributes },
    );
    let own = SurfaceColumns::new(&table).unwrap();
    let rows = surface_rows(&table, &own);
    let (order, text) = ([2, 0, 1], text(&rows));
    let heap = rows.packed_as(&order);
    for (place, &row) in order.iter().enumerate() {
        assert_eq!(read(&text, &heap, place), expected(&rows, row as usize));
    }
    // Negative control: in their own order.
    assert_ne!(read(&text, &rows.packed(), 0), expected(&rows, 2));
    // The last column begins a new word.
    assert_eq!(heap.len(), 3 * 7);
}

#[test]
fn lights_are_read_back_with_what_the_device_adds() {
    let mut table = LightTable::default();
    table.push(PointLight { position: [3.0, 1.0, 2.0], intensity: [4.0, 5.0, 6.0] });
    let shape = Sphere::new(DVec3::new(7.0, 8.0, 9.0), 0.5);
    table.push(AreaLight { shape, flipped: true, emission: [10.0, 11.0, 12.0] });
    table.build_tree();
    let own = LightColumns {
        place: vec![20, 21],
        units: vec![22, 23],
        lamp: vec![24, 25],
        delta_light: vec![26, 27],
        infinite_light: vec![28, 29],
    };
    let rows = light_rows(&table, &own);
    let (heap, text) = (rows.packed(), text(&rows));
    assert!(is_read_back(&rows, &heap, &text));
    let (lamp, words) = rows.place("lamp").unwrap();
    assert_eq!([0, 1].map(|row: usize| heap[row * words + lamp.word][lamp.first]), [24, 25]);

    let nothing = (LightTable::default(), LightColumns::default());
    assert_eq!(super::tests::text(&light_rows(&nothing.0, &nothing.1)), text);
}
