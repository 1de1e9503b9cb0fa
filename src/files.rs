//! Reading what people give: regular files of a size that can be meant. A pipe or a device may never end.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// Largest text of a robot, a scene or a grid, bytes.
pub const LARGEST_TEXT: u64 = 64 << 20;
/// Largest table, bytes.
pub const LARGEST_TABLE: u64 = 2 << 30;

/// Opens the regular file at `path`, of `largest` bytes at most.
///
/// # Errors
/// If it cannot be opened, or is something else or larger.
pub fn open(path: &Path, largest: u64) -> Result<File> {
    // Looked at first: to open a pipe is to wait for whoever writes into it.
    let about = std::fs::metadata(path)?;
    if about.is_dir() {
        return Err(Error::from(ErrorKind::IsADirectory));
    }
    if !about.is_file() {
        return Err(Error::new(ErrorKind::InvalidInput, "it is a pipe or a device, and a file is needed"));
    }
    if about.len() > largest {
        let (found, most) = (about.len() >> 20, largest >> 20);
        return Err(Error::new(ErrorKind::InvalidInput, format!("it has {found} MiB, and {most} MiB at most are read")));
    }
    File::open(path)
}

/// The bytes of the file at `path`.
///
/// # Errors
/// As [`open`].
pub fn bytes(path: &Path, largest: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // A file that grows while it is read ends here all the same.
    open(path, largest)?.take(largest).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The text of the file at `path`.
///
/// # Errors
/// As [`open`], and if it is no UTF-8, which the error says where.
pub fn text(path: &Path, largest: u64) -> Result<String> {
    String::from_utf8(bytes(path, largest)?).map_err(|wrong| {
        let at = wrong.utf8_error().valid_up_to();
        let line = 1 + wrong.as_bytes()[..at].iter().filter(|byte| **byte == b'\n').count();
        Error::new(ErrorKind::InvalidData, format!("line {line} is no UTF-8 text: save it as UTF-8"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_other_kinds_and_sizes_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, b"one\ntw\xff").unwrap();
        assert!(text(&path, 100).unwrap_err().to_string().contains("line 2 is no UTF-8"));
        assert!(bytes(&path, 2).unwrap_err().to_string().contains("at most are read"));
        assert_eq!(bytes(&path, 100).unwrap().len(), 7);
        assert!(open(folder.path(), 100).is_err());
        #[cfg(unix)]
        assert!(open(Path::new("/dev/zero"), 100).unwrap_err().to_string().contains("a pipe or a device"));
    }
}
