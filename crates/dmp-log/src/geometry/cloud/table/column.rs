//! Numbers beside a point's place, and what the formats call their types.

#[derive(Debug, Clone, Copy)]
pub(crate) struct Column {
    /// Its names in PLY (empty: that in PCD behind `scalar_`), in PCD, and in LAS, where at most 32 bytes of it count.
    pub(crate) names: [&'static str; 3],
    pub(crate) number: Number,
    /// What it is; at most 32 bytes of it count.
    pub(crate) about: &'static str,
}

/// The types of numbers that every format has and its readers know: `Open3D` leaves out a `uint` of PLY.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Number {
    U8,
    I32,
    F32,
    F64,
}

impl Number {
    /// Its bytes, and its name in PLY, in PCD and among the extra bytes of LAS (LAS 1.4 R15, table 24).
    fn table(self) -> (usize, &'static str, &'static str, u8) {
        match self {
            Self::U8 => (1, "uchar", "U", 1),
            Self::I32 => (4, "int", "I", 6),
            Self::F32 => (4, "float", "F", 9),
            Self::F64 => (8, "double", "F", 10),
        }
    }

    pub(crate) fn bytes(self) -> usize {
        self.table().0
    }
}

impl Column {
    pub(super) fn in_ply(&self) -> String {
        let name = match self.names[0] {
            "" => format!("scalar_{}", self.names[1]),
            name => name.to_owned(),
        };
        format!("property {} {name}\n", self.number.table().1)
    }

    /// The record that describes it among the extra bytes of LAS (LAS 1.4 R15, section 2.7.6): 192 bytes, the type at
    /// 2, the name at 4, the description at 160.
    pub(super) fn in_las(&self) -> [u8; 192] {
        let mut record = [0; 192];
        record[2] = self.number.table().3;
        for (at, text) in [(4, self.names[2]), (160, self.about)] {
            let bytes = &text.as_bytes()[..text.len().min(32)];
            record[at..at + bytes.len()].copy_from_slice(bytes);
        }
        record
    }
}

pub(super) fn row_bytes(columns: &[Column]) -> usize {
    columns.iter().map(|column| column.number.bytes()).sum()
}

/// The head of a PCD file, version 0.7, with places as float64.
pub(super) fn pcd_head(columns: &[Column], points: u64) -> String {
    let mut all = ["x", "y", "z"].map(|axis| (axis, Number::F64)).to_vec();
    all.extend(columns.iter().map(|column| (column.names[1], column.number)));
    let row = |cell: &dyn Fn(&(&str, Number)) -> String| all.iter().map(cell).collect::<Vec<_>>().join(" ");
    let names = row(&|(name, _)| (*name).to_owned());
    let sizes = row(&|(_, number)| number.bytes().to_string());
    let types = row(&|(_, number)| number.table().2.to_owned());
    let counts = row(&|_| "1".to_owned());
    format!(
        "# .PCD v0.7\nVERSION 0.7\nFIELDS {names}\nSIZE {sizes}\nTYPE {types}\nCOUNT {counts}\nWIDTH {points}\n\
         HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA binary\n"
    )
}
