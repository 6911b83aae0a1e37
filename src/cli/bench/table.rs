//! Tables for users, and as CSV for programs.

use std::fmt;

/// A number or a word, formatted for users and for programs.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    shown: String,
    raw: String,
}

impl Cell {
    /// A number with its own format.
    pub(super) fn new(shown: impl Into<String>, raw: f64) -> Cell {
        Cell { shown: shown.into(), raw: raw.to_string() }
    }

    /// A word without commas.
    pub(super) fn word(word: &str) -> Cell {
        Cell { shown: word.to_owned(), raw: word.to_owned() }
    }

    /// A count.
    pub(super) fn count(count: u32) -> Cell {
        Cell::new(count.to_string(), count.into())
    }

    /// Three digits and a unit.
    pub(super) fn measured(value: f64, unit: &str) -> Cell {
        Cell::new(format!("{}{unit}", significant(value, 3)), value)
    }

    /// A time in seconds.
    pub(super) fn seconds(seconds: f64) -> Cell {
        Cell::measured(seconds, " s")
    }

    /// A missing number.
    pub(super) fn nothing() -> Cell {
        Cell { shown: "–".to_owned(), raw: String::new() }
    }
}

/// A number with this many significant digits, but at least all digits before the point.
pub(super) fn significant(value: f64, digits: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let after = digits - 1 - value.abs().log10().floor() as i32;
    // Rounding may carry into another digit: 9.996 is 10.0, not 10.00.
    let rounded = format!("{value:.*}", after.max(0) as usize).parse().unwrap_or(value);
    let after = digits - 1 - f64::abs(rounded).log10().floor().min(1e9) as i32;
    format!("{value:.*}", after.max(0) as usize)
}

/// A column.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    /// The heading for users.
    pub(super) heading: &'static str,
    /// The name for programs, with its unit.
    pub(super) name: &'static str,
}

/// Rows of cells.
#[derive(Clone, Debug)]
pub(super) struct Table {
    columns: Vec<Column>,
    rows: Vec<Vec<Cell>>,
}

impl Table {
    /// A table without rows. Columns without a heading appear only in CSV.
    pub(super) fn new(columns: &[(&'static str, &'static str)]) -> Table {
        let columns = columns.iter().map(|&(heading, name)| Column { heading, name }).collect();
        Table { columns, rows: Vec::new() }
    }

    /// Adds a row.
    pub(super) fn push(&mut self, row: Vec<Cell>) {
        debug_assert_eq!(row.len(), self.columns.len());
        self.rows.push(row);
    }

    /// Whether there are no rows.
    pub(super) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Comma-separated values with a header row; numbers in full, and empty fields for missing ones.
    pub(super) fn csv(&self) -> String {
        let names: Vec<&str> = self.columns.iter().map(|column| column.name).collect();
        let mut text = names.join(",") + "\n";
        for row in &self.rows {
            let cells: Vec<&str> = row.iter().map(|cell| cell.raw.as_str()).collect();
            text += &(cells.join(",") + "\n");
        }
        text
    }
}

/// Right-aligned columns.
impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown: Vec<usize> =
            (0..self.columns.len()).filter(|&column| !self.columns[column].heading.is_empty()).collect();
        let width = |column: usize| {
            let cells = self.rows.iter().map(|row| row[column].shown.chars().count());
            cells.chain([self.columns[column].heading.chars().count()]).max().unwrap_or(0)
        };
        let mut line = |cells: &dyn Fn(usize) -> String| -> fmt::Result {
            let cells: Vec<String> = shown
                .iter()
                .map(|&column| format!("{:>width$}", cells(column), width = width(column)))
                .collect();
            writeln!(f, "{}", cells.join("   "))
        };
        line(&|column| self.columns[column].heading.to_owned())?;
        self.rows.iter().try_for_each(|row| line(&|column| row[column].shown.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_right_aligned_with_any_letters() {
        let mut table = Table::new(&[("Depth", "depth"), ("Time ÷ depth", "ratio"), ("", "hidden")]);
        table.push(vec![Cell::count(2), Cell::seconds(0.5), Cell::new("x", 1.0)]);
        table.push(vec![Cell::count(0), Cell::nothing(), Cell::nothing()]);
        assert_eq!(table.to_string(), "Depth   Time ÷ depth\n    2        0.500 s\n    0              –\n");
        assert_eq!(table.csv(), "depth,ratio,hidden\n2,0.5,1\n0,,\n");
    }

    #[test]
    fn significant_digits() {
        for (value, text) in [
            (0.0, "0"),
            (0.012_345, "0.0123"),
            (0.9996, "1.00"),
            (9.996, "10.0"),
            (73.04, "73.0"),
            (1234.5, "1234"),
            (-0.5, "-0.500"),
        ] {
            assert_eq!(significant(value, 3), text);
        }
    }
}
