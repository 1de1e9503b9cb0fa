//! The text of a table as people have it: encodings, separators, decimal commas.

use std::borrow::Cow;

/// What `bytes` are, where they are surely no table.
pub(super) fn foreign(bytes: &[u8]) -> Option<&'static str> {
    let begins = bytes.trim_ascii_start();
    match begins {
        [b'P', b'K', 3, 4, ..] | [0xD0, 0xCF, 0x11, 0xE0, ..] => Some("it is a spreadsheet or an archive: save the sheet as CSV"),
        [b'{' | b'[', ..] => Some("it is JSON: write it as CSV, a column for each key"),
        [b'<', ..] => Some("it is XML or HTML: write it as CSV"),
        [0x89, b'H', b'D', b'F', ..] => Some("it is an HDF5 or MATLAB file: write it as CSV"),
        _ if bytes.starts_with(b"MATLAB 5.0") => Some("it is a MATLAB file: write it as CSV (writetable)"),
        _ if bytes.starts_with(b"\x93NUMPY") => Some("it is a NumPy array: write it as CSV (numpy.savetxt with a header)"),
        _ if bytes.starts_with(b"PAR1") => Some("it is a Parquet file: write it as CSV"),
        _ => None,
    }
}

/// The text of `bytes`: UTF-8, with or without a mark, or UTF-16 with one or with every other byte zero.
///
/// # Errors
/// Where it is neither, with the line of the first byte that is none.
pub(super) fn decoded(bytes: &[u8]) -> Result<String, (u64, String)> {
    let text = in_any_encoding(bytes)?;
    // Lines are counted by their feeds.
    Ok(if text.contains('\r') { text.replace("\r\n", "\n").replace('\r', "\n") } else { text })
}

fn in_any_encoding(bytes: &[u8]) -> Result<String, (u64, String)> {
    let wide = |little: bool, bytes: &[u8]| {
        let units: Vec<u16> = bytes
            .chunks_exact(2)
            .map(|pair| if little { u16::from_le_bytes([pair[0], pair[1]]) } else { u16::from_be_bytes([pair[0], pair[1]]) })
            .collect();
        String::from_utf16(&units).map_err(|_| (1, "is no text: UTF-16 that is broken; save it as UTF-8".to_owned()))
    };
    match bytes {
        [0xEF, 0xBB, 0xBF, rest @ ..] => utf8(rest),
        [0xFF, 0xFE, rest @ ..] => wide(true, rest),
        [0xFE, 0xFF, rest @ ..] => wide(false, rest),
        [first, 0, second, 0, ..] if *first != 0 && *second != 0 => wide(true, bytes),
        [0, first, 0, second, ..] if *first != 0 && *second != 0 => wide(false, bytes),
        _ => utf8(bytes),
    }
}

fn utf8(bytes: &[u8]) -> Result<String, (u64, String)> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.to_owned()),
        Err(error) => {
            let line = bytes[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count() as u64 + 1;
            Err((line, "a byte that is no UTF-8 text; save the table as UTF-8".to_owned()))
        }
    }
}

/// How the numbers of a table are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    /// Between columns.
    pub(super) separator: u8,
    /// Whether the decimal mark is a comma.
    pub(super) decimal_comma: bool,
}

/// The separator of the header, and whether cells have decimal commas: only where these cannot be separators.
pub(super) fn layout(text: &str) -> Layout {
    let mut lines = text.lines().filter(|line| !line.trim().is_empty() && !line.trim_start().starts_with('#'));
    let header = lines.next().unwrap_or_default();
    let count = |separator: u8| header.bytes().filter(|byte| *byte == separator).count();
    // A comma counts only where nothing else separates: `x; y, z` is no name.
    let separator = [b';', b'\t', b','].into_iter().find(|separator| count(*separator) > 0).unwrap_or(b',');
    let mut commas = false;
    if separator != b',' {
        for cell in lines.take(50).flat_map(|line| line.split(char::from(separator))) {
            let cell = cell.trim();
            let numeric =
                !cell.is_empty() && cell.chars().all(|c| c.is_ascii_digit() || matches!(c, ',' | '-' | '+' | 'e' | 'E'));
            commas |= numeric && cell.matches(',').count() == 1;
        }
    }
    Layout { separator, decimal_comma: commas }
}

impl Layout {
    /// A number's text with a decimal point.
    pub(super) fn number<'a>(&self, cell: &'a str) -> Cow<'a, str> {
        if self.decimal_comma && cell.matches(',').count() == 1 && !cell.contains('.') {
            Cow::Owned(cell.replace(',', "."))
        } else {
            Cow::Borrowed(cell)
        }
    }
}

/// Whether a cell says that there is no number.
pub(super) fn is_missing(cell: &str) -> bool {
    matches!(
        cell.to_ascii_lowercase().as_str(),
        "" | "nan" | "-nan" | "na" | "n/a" | "null" | "none" | "inf" | "-inf" | "+inf" | "-" | "?"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_as_people_have_them_and_other_files_are_named() {
        for text in ["a,b\n1,2\n", "a,b\r\n1,2\r\n", "a,b\r1,2\r"] {
            assert_eq!(decoded(text.as_bytes()).unwrap(), "a,b\n1,2\n");
        }
        assert!(foreign(b"PK\x03\x04...").unwrap().contains("spreadsheet"));
        assert!(foreign(b"\n [{\"q\": 1}]").unwrap().contains("JSON"));
        assert_eq!(foreign(b"q1_rad,x_m\n0,1\n"), None);
    }

    #[test]
    fn encodings_are_told() {
        let text = "q1_rad,x_m\n1,ü\n";
        let wide = |little: bool, mark: bool| {
            let mut bytes: Vec<u8> = Vec::new();
            let units = mark.then_some(0xFEFF).into_iter().chain(text.encode_utf16());
            units.for_each(|unit| bytes.extend(if little { unit.to_le_bytes() } else { unit.to_be_bytes() }));
            bytes
        };
        for bytes in [
            text.as_bytes().to_vec(),
            [&[0xEF, 0xBB, 0xBF], text.as_bytes()].concat(),
            wide(true, true),
            wide(false, true),
            wide(true, false),
            wide(false, false),
        ] {
            assert_eq!(decoded(&bytes).unwrap(), text);
        }
        assert_eq!(decoded(b"a,b\n1,\xE9\n").unwrap_err().0, 2);
    }

    #[test]
    fn separators_and_decimal_commas_are_told() {
        let of = |text: &str| layout(text);
        assert_eq!(of("a,b\n1,2\n"), Layout { separator: b',', decimal_comma: false });
        assert_eq!(of("# x;y\na;b\n1,5;2\n"), Layout { separator: b';', decimal_comma: true });
        assert_eq!(of("a\tb\n1.5\t2\n"), Layout { separator: b'\t', decimal_comma: false });
        assert_eq!(of("a;b\n1,5;2\n").number("-1,25e-3"), "-1.25e-3");
    }
}
