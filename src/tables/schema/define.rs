//! How a table is defined: one entry per column, from which come the row, its comments, the columns, readers and writers.
//!
//! ```text
//! table! {
//!     TRACK = "ground.ecsv", "One row per moment of `plot ground`.";
//!     /// One moment of a ground track.
//!     #[derive(Debug, Clone, Default, PartialEq, Serialize)]
//!     pub struct TrackRow {
//!         /// height of the satellite above the ellipsoid
//!         height_km: f64 => "km" ["pos.distance"],
//!     }
//! }
//! ```
//! The comment of a field is the description of its column, its type that of the cells. Behind `=>`, each only where there is
//! one: the unit as astropy spells it, the UCD1+ (IVOA, Cecconi, Louys et al. 2023), and `added_later` for a column that tables
//! of older versions lack. `columns { ... }` instead of a struct defines a table whose cells are made elsewhere.

use serde::Serialize;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Datatype {
    /// UTF-8 text; empty = missing.
    Text,
    /// 64-bit integer or missing.
    Int64,
    /// 32-bit mask, never missing.
    Int32,
    /// 64-bit float or missing, never NaN.
    Float64,
}

impl Datatype {
    /// The name ECSV gives it.
    #[must_use]
    pub fn ecsv(self) -> &'static str {
        match self {
            Datatype::Text => "string",
            Datatype::Int64 => "int64",
            Datatype::Int32 => "int32",
            Datatype::Float64 => "float64",
        }
    }
}

impl Datatype {
    /// What a column of a foreign table holds, by the name that ECSV and VOTable give its type; `None` for arrays and others.
    #[must_use]
    pub fn of_ecsv(name: &str) -> Option<Self> {
        match name {
            "string" | "char" | "unicodeChar" | "bool" | "boolean" => Some(Datatype::Text),
            "int8" | "int16" | "int32" | "int64" | "uint8" | "uint16" | "uint32" | "unsignedByte" | "short" | "int"
            | "long" => Some(Datatype::Int64),
            "float16" | "float32" | "float64" | "float" | "double" => Some(Datatype::Float64),
            _ => None,
        }
    }
}

/// A type of Rust that a cell can hold.
pub(super) trait CellType {
    const DATATYPE: Datatype;
}
impl CellType for String {
    const DATATYPE: Datatype = Datatype::Text;
}
impl CellType for i64 {
    const DATATYPE: Datatype = Datatype::Int64;
}
impl CellType for i32 {
    const DATATYPE: Datatype = Datatype::Int32;
}
impl CellType for f64 {
    const DATATYPE: Datatype = Datatype::Float64;
}
impl<T: CellType> CellType for Option<T> {
    const DATATYPE: Datatype = T::DATATYPE;
}

/// One column of a table. Only [`crate::tables`] can make one, so that no column is written that is not documented.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Column {
    /// Name in the file and of the field of the row.
    pub name: &'static str,
    /// Unit as astropy spells it, or nothing.
    pub unit: &'static str,
    /// The UCD1+ of a column of magnitudes in V, or nothing.
    pub ucd: &'static str,
    /// What the cells hold.
    pub datatype: Datatype,
    /// One line for the reader of the file.
    pub description: &'static str,
    /// Tables of an older version lack it; read as empty there.
    pub(in crate::tables) added_later: bool,
}

impl Column {
    /// A column of a table of others, which is handed on.
    pub(in crate::tables) fn foreign(name: &str, unit: &str, ucd: &str, datatype: Datatype, description: &str) -> Self {
        let text = |text: &str| -> &'static str { if text.is_empty() { "" } else { text.to_owned().leak() } };
        let [name, unit, ucd, description] = [name, unit, ucd, description].map(text);
        Self { name, unit, ucd, datatype, description, added_later: false }
    }

    /// The same column with another name.
    pub(in crate::tables) fn renamed(self, name: &str) -> Self {
        Self { name: name.to_owned().leak(), ..self }
    }

    /// The same column with another description.
    #[must_use]
    pub(super) const fn described(self, description: &'static str) -> Self {
        Self { description, ..self }
    }
}

/// One table: its file, what a row is, its columns in file order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Definition {
    /// The file it is written to unless another name is given.
    pub file: &'static str,
    /// What a row is, in a sentence.
    pub about: &'static str,
    /// The columns, in file order.
    pub columns: &'static [Column],
}

impl Definition {
    /// Its name: that of the file without the ending.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.file.split_once('.').map_or(self.file, |(name, _)| name)
    }

    /// The names of its columns, in file order.
    #[must_use]
    pub fn column_names(&self) -> Vec<&'static str> {
        self.columns.iter().map(|c| c.name).collect()
    }

    /// The first line of it as comma-separated values.
    #[must_use]
    pub fn csv_head(&self) -> String {
        self.column_names().join(",") + "\n"
    }

    /// Its column of this name; a name it does not have fails when the program is built.
    pub(super) const fn column(&self, name: &str) -> Column {
        let mut i = 0;
        while !same(self.columns[i].name, name) {
            i += 1;
        }
        self.columns[i]
    }
}

/// A row of a defined table: one field per column, in file order.
pub trait Row: Serialize {
    /// The table it is a row of.
    const TABLE: Definition;
}

impl<R: Row> Row for &R {
    const TABLE: Definition = R::TABLE;
}

/// Whether two texts are the same, where `==` cannot be used yet.
pub(super) const fn same(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let mut i = 0;
    while i < a.len() && i < b.len() && a[i] == b[i] {
        i += 1;
    }
    i == a.len() && i == b.len()
}

/// The columns of one table and then those of another; `N` is their number.
pub(super) const fn joined<const N: usize>(first: &[Column], second: &[Column]) -> [Column; N] {
    let mut all = [first[0]; N];
    let mut i = 0;
    while i < N {
        all[i] = if i < first.len() { first[i] } else { second[i - first.len()] };
        i += 1;
    }
    all
}

/// Defines a table and its row: see the top of `define.rs`.
macro_rules! table {
    (
        $table:ident = $file:literal, $about:literal;
        columns { $(
            $(#[doc = $doc:literal])+
            $column:ident: $type:ty $(=> $($unit:literal)? $([$ucd:literal])? $($later:ident)?)?
        ),+ $(,)? }
    ) => {
        #[doc = concat!("`", $file, "`: ", $about)]
        pub const $table: super::define::Definition = super::define::Definition {
            file: $file,
            about: $about,
            columns: &[$(
                super::define::Column {
                    name: stringify!($column),
                    unit: concat!("" $($(, $unit)?)?),
                    ucd: concat!("" $($(, $ucd)?)?),
                    datatype: <$type as super::define::CellType>::DATATYPE,
                    description: concat!($($doc),+).trim_ascii_start(),
                    added_later: !<[&str]>::is_empty(&[$($(stringify!($later))?)?]),
                }
            ),+],
        };
    };
    (
        $table:ident = $file:literal, $about:literal;
        $(#[$about_row:meta])+
        pub struct $row:ident { $(
            $(#[doc = $doc:literal])+
            $column:ident: $type:ty $(=> $($unit:literal)? $([$ucd:literal])? $($later:ident)?)?
        ),+ $(,)? }
        $(not written { $( $(#[doc = $hidden_doc:literal])+ $hidden:ident: $hidden_type:ty ),+ $(,)? })?
    ) => {
        super::define::table! {
            $table = $file, $about;
            columns { $(
                $(#[doc = $doc])+
                $column: $type $(=> $($unit)? $([$ucd])? $($later)?)?
            ),+ }
        }

        $(#[$about_row])+
        pub struct $row {
            $(
                $(#[doc = $doc])+
                $($(#[doc = concat!(" \\[", $unit, "\\]")])?)?
                $($(#[serde(default)] #[doc = concat!("\n(", stringify!($later), ")")])?)?
                pub $column: $type,
            )+
            $($( $(#[doc = $hidden_doc])+ #[serde(skip)] pub $hidden: $hidden_type, )+)?
        }

        impl super::define::Row for $row {
            const TABLE: super::define::Definition = $table;
        }
    };
}
pub(super) use table;
