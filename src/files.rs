//! Files: what people give is read if it is a regular one of a size that can be meant (a pipe or a device may never end); what is written
//! goes aside first.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::{Path, PathBuf};

/// Largest text of a robot, a scene or a grid, bytes.
pub const LARGEST_TEXT: u64 = 64 << 20;
/// Largest table, bytes: a million readings with everything that a table may have.
pub const LARGEST_TABLE: u64 = 1 << 30;

/// Opens the regular file at `path`, of `largest` bytes at most.
///
/// # Errors
/// If it cannot be opened, or is something else or larger.
pub fn open(path: &Path, largest: u64) -> Result<File> {
    // Looked at first: to open a pipe is to wait for whoever writes into it.
    let about = std::fs::metadata(path)?;
    if about.is_dir() {
        return Err(Error::new(ErrorKind::IsADirectory, "Is a directory"));
    }
    if !about.is_file() {
        return Err(Error::new(ErrorKind::InvalidInput, "it is no regular file, but a pipe or a device"));
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

/// Refuses to write through a link that stands where a file of ours is to be: it would be another file's end.
///
/// # Errors
/// If `path` is a symbolic link.
pub fn no_link(path: &Path) -> Result<()> {
    match std::fs::symlink_metadata(path) {
        Ok(about) if about.file_type().is_symlink() => Err(Error::new(
            ErrorKind::AlreadyExists,
            "a symbolic link stands there: remove it, or choose another folder with --out",
        )),
        _ => Ok(()),
    }
}

/// A file that is gone when this is dropped, unless it is kept.
#[derive(Debug)]
pub struct Aside {
    path: PathBuf,
    kept: bool,
}

impl Aside {
    /// Makes the file at `path` anew.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn create(path: &Path) -> Result<(Aside, File)> {
        no_link(path)?;
        let file = File::create(path)?;
        Ok((Aside { path: path.to_owned(), kept: false }, file))
    }

    /// Renames it to `path`: it is whole.
    ///
    /// # Errors
    /// If it cannot be renamed.
    pub fn become_of(mut self, path: &Path) -> Result<()> {
        std::fs::rename(&self.path, path)?;
        self.kept = true;
        Ok(())
    }
}

impl Drop for Aside {
    fn drop(&mut self) {
        if !self.kept {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_aside_is_gone_or_whole_and_no_link_is_followed() {
        let folder = tempfile::tempdir().unwrap();
        let (aside, whole) = (folder.path().join("a.partial"), folder.path().join("a"));
        drop(Aside::create(&aside).unwrap());
        assert!(!aside.exists());
        Aside::create(&aside).unwrap().0.become_of(&whole).unwrap();
        assert!(whole.exists() && !aside.exists());
        #[cfg(unix)]
        {
            std::fs::write(&whole, "precious").unwrap();
            std::os::unix::fs::symlink(&whole, &aside).unwrap();
            assert!(Aside::create(&aside).unwrap_err().to_string().contains("a symbolic link"));
            assert_eq!(std::fs::read(&whole).unwrap(), b"precious");
        }
    }

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
        assert!(open(Path::new("/dev/zero"), 100).unwrap_err().to_string().contains("no regular file"));
    }
}
